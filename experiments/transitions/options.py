"""Options that all commands share that run trials."""

from dataclasses import dataclass, field
from importlib.metadata import version

from diagrams.trials.database import Campaign
from diagrams.trials.record import TrialConfig
from diagrams.trials.rig import MODEL_FILES
from irl.choices import check_range
from models.scenes.parsing import description_hash


@dataclass(frozen=True)
class Running:
    """How trials run, and where."""

    workers: int = 2
    """How many processes run trials; the trials are the same whatever their number."""
    cluster: str = ""
    """The address of a dask scheduler that runs them instead, such as tcp://host:8786."""
    trial: TrialConfig = field(default_factory=TrialConfig)
    """How a trial runs, and what noise it has."""

    def check(self) -> None:
        """Refuse what cannot be run.

        Raises:
            InputError: naming the option.
        """
        check_range("--workers", self.workers, 1)


def floating_campaign(trial: TrialConfig, seed: int) -> Campaign:
    """What trials with the floating gripper have in common."""
    return Campaign(trial, seed, description_hash(MODEL_FILES), version("drake"))
