"""How a VR network is trained: the choices of one fit."""

import math
from dataclasses import dataclass
from typing import Annotated

from irl.choices import Limits, Settings, check_choice
from irl.optimizers import OPTIMIZERS

SCHEDULES = ("cosine", "none")


@dataclass(frozen=True)
class TrainingConfig(Settings):
    """How to climb the likelihood.

    The thesis' algorithm is ``sgd`` with ``schedule="none"`` and no Bellman weight.
    """

    iterations: Annotated[int, Limits(0, 10_000_000)] = 2000
    """How many steps are taken at most."""
    optimizer: str = "adam"
    """The optimiser: adam or sgd."""
    step: Annotated[float, Limits(0, 1e6, open_low=True)] = 1e-3
    """The learning rate α of thesis (3.14), on the mean log-likelihood."""
    schedule: str = "cosine"
    """With cosine the step decays to 0 over the iterations; with none it stays."""
    beta: Annotated[float, Limits(0, 1e9, open_low=True)] = 30.0
    """The inverse temperature β of (3.19), or where it starts if it is learnt."""
    learn_beta: bool = False
    """Whether β is adjusted with the weights."""
    caution: Annotated[float, Limits(0, 1e6)] = 0.0
    """What an action loses in units of f, times the probability that its likeliest outcome does not
    come, or where this starts if it is learnt. 0 in the thesis: no f on states can say it."""
    learn_caution: bool = False
    """Whether that is adjusted with the weights."""
    tolerance: Annotated[float, Limits(0, 1)] = 0.0
    """Training stops once the mean log-likelihood of 100 iterations changes by less; 0 never."""
    weight_decay: Annotated[float, Limits(0, 1e6)] = 0.0
    """By how much the weights shrink per unit of step (decoupled for adam)."""
    bellman_weight: Annotated[float, Limits(0, 1e9)] = 0.0
    """The weight of the Bellman penalty against the mean log-likelihood; 0 in the thesis."""
    bellman_batch: Annotated[int, Limits(1, 10_000_000)] = 256
    """How many states a batch of the penalty has; if there are no more, it is on all."""
    bellman_delta: Annotated[float, Limits(0, 1e9, open_low=True)] = 0.01
    """The deviation of the reward, in units of f, from which on the penalty is linear."""

    def __post_init__(self) -> None:
        """Refuse values outside their range.

        Raises:
            InputError: naming the field and what it may be.
        """
        super().__post_init__()
        check_choice("optimizer", self.optimizer, OPTIMIZERS)
        check_choice("schedule", self.schedule, SCHEDULES)

    def step_after(self, done: int) -> float:
        """The step's size once ``done`` iterations were taken."""
        if self.schedule == "none":
            return self.step
        return self.step * (1 + math.cos(math.pi * done / self.iterations)) / 2

    @property
    def cautious(self) -> bool:
        """Whether uncertain outcomes are disliked, or may come to be."""
        return self.learn_caution or self.caution > 0
