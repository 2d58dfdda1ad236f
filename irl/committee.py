"""A committee of VR networks: several answers to the same demonstrations.

Members differ in their initial weights and in how much each label counts: a Bayesian bootstrap
(Rubin 1981), whose exponential weights leave no label out. A state's weight is drawn once, so
that a member stays the same resample as labels come in. Where members differ, the
demonstrations have not settled the matter.
"""

from collections.abc import Sequence

import numpy as np

from irl.checkpoint import Checkpoint
from irl.demonstrations import Demonstrations
from irl.function_approx import Learner
from irl.problem import LearningProblem
from irl.training_config import TrainingConfig
from irl.vr_function import VRFunction, torch_generator


class Committee:
    """Members that are trained in turn, each as the main network is.

    Attributes:
        members: the learners.
        rng: the committee's own source of chance, batches of the Bellman term included, so
            that a committee at work leaves other draws as they are.
    """

    def __init__(
        self,
        problem: LearningProblem,
        size: int,
        hidden: Sequence[int],
        rng: np.random.Generator,
        beta: float = 1.0,
        carry_beta: bool = False,
        device: str = "cpu",
    ) -> None:
        """Draw ``size`` members with hidden layers of the given widths; the rest as ``Learner``."""
        self.rng = rng
        n_states, n_features = problem.required_features().shape
        self.members = [
            Learner(
                problem,
                VRFunction(n_features, hidden, generator=torch_generator(rng), device=device),
                beta,
                carry_beta,
                weight=rng.standard_exponential((n_states,)),
            )
            for _ in range(size)
        ]

    def fit(
        self,
        labels: Demonstrations,
        config: TrainingConfig,
        checkpoints: Sequence[Checkpoint | None] | None = None,
    ) -> None:
        """Train every member on its resample of ``labels``.

        Args:
            labels: all labels.
            config: how to train.
            checkpoints: one a member; none of them if absent.

        Raises:
            InputError: as ``Learner.fit``.
        """
        each = checkpoints or [None] * len(self.members)
        for member, checkpoint in zip(self.members, each, strict=True):
            member.fit(labels, config, self.rng, checkpoint=checkpoint)
