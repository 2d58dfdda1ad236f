"""Options that all commands share that run trials."""

from dataclasses import dataclass, field
from importlib.metadata import version
from typing import Annotated

from diagrams.trials.database import Campaign
from diagrams.trials.record import TrialConfig
from diagrams.trials.rig import MODEL_FILES
from experiments.kit.executors import MOST_WORKERS
from irl.choices import Limits, Settings
from models.scenes.parsing import description_hash


@dataclass(frozen=True)
class Running(Settings):
    """How trials run, and where."""

    workers: Annotated[int, Limits(1, MOST_WORKERS)] = 2
    """How many processes run trials; the trials are the same whatever their number."""
    cluster: str = ""
    """The address of a dask scheduler that runs them instead, such as tcp://host:8786."""
    trial: TrialConfig = field(default_factory=TrialConfig)
    """How a trial runs, and what noise it has."""


def floating_campaign(trial: TrialConfig, seed: int) -> Campaign:
    """What trials with the floating gripper have in common."""
    return Campaign(trial, seed, description_hash(MODEL_FILES), version("drake"))
