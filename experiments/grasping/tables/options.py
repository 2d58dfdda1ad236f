"""What the commands on the network have in common: seeds, processes, how figures are told."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import numpy as np

from experiments.kit.executors import MOST_WORKERS
from experiments.kit.shipped_data import SHIPPED_TASK
from irl.choices import Limits, Settings
from irl.metrics import bootstrap_interval


@dataclass(frozen=True)
class Measurement(Settings):
    """Something that is measured on many seeds."""

    task: Path = SHIPPED_TASK
    """The folder of the task data."""
    seeds: Annotated[int, Limits(1, 100_000)] = 10
    """How many seeds there are."""
    workers: Annotated[int, Limits(1, MOST_WORKERS)] = 2
    """How many processes; the results do not depend on it."""
    cluster: str = ""
    """The address of a dask scheduler that runs them instead, such as tcp://host:8786."""
    seed: int = 0
    """The first seed. Settings were chosen on those from 100 to 104."""
    out: Path = field(default_factory=lambda: Path("out/grasping"))
    """The folder that the results are written to."""

    @property
    def all_seeds(self) -> range:
        """The seeds, one after the other."""
        return range(self.seed, self.seed + self.seeds)


def spread(values: Sequence[float]) -> list[float]:
    """Mean and bootstrap 95 % interval over seeds: [mean, low, high]."""
    low, high = bootstrap_interval(np.array(values), np.random.default_rng(0), resamples=2000)
    return [float(np.mean(values)), low, high]


def told(values: Sequence[float]) -> str:
    """The same in per cent, as a table prints it."""
    mean, low, high = spread(values)
    return f"{mean:6.1%} [{low:.1%}, {high:.1%}]"
