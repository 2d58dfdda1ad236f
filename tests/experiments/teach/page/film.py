"""Moving pictures of a lesson: ``python -m tests.experiments.teach.page.film FOLDER FILE.gif``.

A soak test that is run with a folder in ``TEACH_PICTURES`` takes the pictures, each named by its
place and by how long it stands there.
"""

import os
import sys
from pathlib import Path

from PIL import Image

WIDTH, COLOURS = 960, 255
ACCENTS = (
    *("#1f5fbf", "#f5b301", "#157347", "#dff3e6", "#e5eefb", "#b42318"),
    *("#d9261f", "#33a640", "#f7d126", "#f2801a", "#2961d1", "#8040a6"),
)
"""Colours of the page and of the cube's faces: too little of a picture to be kept otherwise."""


class Film:
    """Pictures of one window; none without a folder to keep them in."""

    def __init__(self, one, folder=None):
        self._one, folder = one, folder or os.environ.get("TEACH_PICTURES", "")
        self.folder = Path(folder) if folder else None
        self._taken = 0

    def take(self, seconds):
        """One picture, which stands for so many seconds."""
        if self.folder is not None:
            name = f"film_{self._taken:03d}_{round(1000 * seconds)}.png"
            self._one.page.screenshot(path=str(self.folder / name))
            self._taken += 1

    def advice(self):
        """What advice looks like, without giving any."""
        if self.folder is not None:
            self._one.press("a")
            self._one.page.focus("[data-cluster]")
            self._one.press("Space")
            self._one.page.wait_for_selector("[data-teach=group]")
            self.take(2.0)
            self._one.press("Escape", "g", "Escape")


def join(folder: Path, target: Path) -> None:
    """Make one moving picture of a folder's."""
    names = sorted(folder.glob("film_*.png"))
    pictures = []
    for name in names:
        picture = Image.open(name).convert("RGB")
        size = (WIDTH, round(WIDTH * picture.height / picture.width))
        pictures.append(picture.resize(size, Image.Resampling.LANCZOS))
    some = pictures[:: max(1, len(pictures) // 4)]
    width, height = some[0].size
    sheet = Image.new("RGB", (width, height * (len(some) + 1)))
    for k, picture in enumerate(some):
        sheet.paste(picture, (0, k * height))
    for k, colour in enumerate(ACCENTS):
        strip = (width // len(ACCENTS) * k, height * len(some), width, height * (len(some) + 1))
        sheet.paste(colour, strip)
    palette = sheet.quantize(COLOURS, method=Image.Quantize.MEDIANCUT)
    frames = [each.quantize(palette=palette, dither=Image.Dither.NONE) for each in pictures]
    durations = [int(name.stem.rpartition("_")[2]) for name in names]
    frames[0].save(
        target, save_all=True, append_images=frames[1:], duration=durations, loop=0, optimize=True
    )


if __name__ == "__main__":
    join(Path(sys.argv[1]), Path(sys.argv[2]))
