"""Every speed figure, side by side with its alternative, in one run.

Peers, the packages compared with, live in a virtual environment of their own, which
``make bench`` builds.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

from tqdm import tqdm

from experiments.bench import episodes, kinematics, landings, learning, lessons, max_ent, trials
from experiments.bench.comparison import Peers, Row
from experiments.kit.command import Output
from irl.choices import Members, Settings

SUBJECTS: dict[str, Callable[[Peers, int], list[Row]]] = {
    "episodes": episodes.rows,
    "kinematics": kinematics.rows,
    "landings": landings.rows,
    "learning": learning.rows,
    "lessons": lessons.rows,
    "max_ent": max_ent.rows,
    "trials": trials.rows,
}


@dataclass
class Config(Settings):
    """Time our work and the alternatives' on the same inputs."""

    subjects: Annotated[tuple[str, ...], Members(tuple(SUBJECTS))] = tuple(SUBJECTS)
    """Which subjects are compared."""
    peers: Path = Peers().python
    """The Python interpreter of the environment that has the packages compared with."""
    seed: int = 0
    """The seed of the inputs."""
    out: Path = field(default_factory=lambda: Path("out/bench"))
    """The folder that the results are written to."""


def main(config: Config, output: Output) -> dict[str, Any]:
    """Run the chosen subjects one after the other; print and tabulate."""
    peers = Peers(config.peers)
    peers.require()
    rows: list[Row] = []
    for subject in tqdm(config.subjects, desc="bench", unit="subject"):
        rows += SUBJECTS[subject](peers, config.seed)
    for row in rows:
        print(
            f"{row.ratio:10.3g} ×  {row.work}: {row.ours_s:.3g} s, {row.other} {row.other_s:.3g} s"
        )
    return {"rows": [{**vars(row), "ratio": row.ratio} for row in rows]}
