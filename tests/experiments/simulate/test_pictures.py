"""Moving pictures and film strips: what they show, and how large they are."""

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image

from diagrams.camera import StillCamera
from experiments.simulate.pictures import draw_film_strip, write_gif
from tests.experiments.kit.still import FAR, NEAR, still


def yellow(picture):
    """Pixels of the cube's upper face."""
    red, green, blue = np.asarray(picture).astype(int)[..., :3].transpose(2, 0, 1)
    return (red > 150) & (green > 110) & (blue < 90) & (green - blue > 60)


def test_a_moving_picture_is_small_and_keeps_the_cubes_colours(tmp_path):
    here, there = still(FAR, 4.0), still(NEAR, 4.0)
    here.frames[48:] = there.frames[48:]
    write_gif(tmp_path / "a.gif", here, StillCamera(size=(280, 200)))
    assert (tmp_path / "a.gif").stat().st_size < 1e6
    with Image.open(tmp_path / "a.gif") as picture:
        assert picture.n_frames >= 2
        places = []
        for number in (0, picture.n_frames - 1):
            picture.seek(number)
            places.append(np.argwhere(yellow(picture.convert("RGB"))).mean(axis=0))
    assert np.linalg.norm(places[0] - places[1]) > 5


def test_a_film_strip_shows_the_cube_large():
    camera = StillCamera(size=(160, 120))
    figure = Figure()
    draw_film_strip(figure, still(FAR), "Start 1", camera)
    shown = figure.axes[0].images[0].get_array()
    # The upper face, 34 mm wide, from 0.38 m and 27° above, in a picture of 0.30 by 0.40 m there.
    share = 0.034**2 * np.sin(np.radians(27.0)) / (0.30 * 0.40)
    assert yellow(shown).mean() == pytest.approx(share, rel=0.25)
    assert figure.get_suptitle().startswith("Start 1: ")
