"""A learner: a VR network that is fitted again, and again, as labels come in (Algorithm 4.1).

`irl.training` does one fit; here is what stays from one fit to the next.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from irl.bellman import BellmanTerm
from irl.checkpoint import Checkpoint
from irl.demonstrations import Demonstrations
from irl.likelihood import LikelihoodProblem
from irl.problem import LearningProblem
from irl.training import Training, train
from irl.training_config import TrainingConfig
from irl.vr_function import VRFunction, pin


@dataclass
class Learner:
    """A network, and where its training stands.

    Attributes:
        problem: the learning problem, whose features the network sees.
        network: the VR function, changed in place by ``fit``.
        beta: the inverse temperature that the last training ended with.
        caution: the dislike of uncertain outcomes that it ended with; None before it.
        carry_beta: whether a training starts from ``beta`` instead of its own setting.
        weight: float64 ``[n_states]``, how much a state's labels count; all alike if None.
    """

    problem: LearningProblem
    network: VRFunction
    beta: float = 1.0
    carry_beta: bool = False
    weight: np.ndarray | None = None
    caution: float | None = None

    def fit(
        self,
        labels: Demonstrations,
        config: TrainingConfig,
        rng: np.random.Generator,
        report: Callable[[int, float], None] | None = None,
        checkpoint: Checkpoint | None = None,
    ) -> Training:
        """Train on ``labels`` from the present weights; arguments as ``irl.training.train``.

        Raises:
            InputError: if a label is infeasible, or training diverges.
        """
        at = self.problem
        if self.carry_beta:
            config = replace(config, beta=self.beta)
        if config.learn_caution and self.caution is not None:
            config = replace(config, caution=max(self.caution, 0.0))
        problem = LikelihoodProblem.of(
            at.model, labels, self.weight, at.fixed_vr, cautious=config.cautious
        )
        bellman = None
        if config.bellman_weight > 0:
            bellman = BellmanTerm(
                at.model,
                at.gamma,
                at.fixed_vr,
                batch=config.bellman_batch,
                delta=config.bellman_delta,
                cautious=config.cautious,
            )
        x = at.required_features(np.float32)
        run = train(self.network, problem, x, config, rng, report, bellman, checkpoint)
        self.beta, self.caution = run.beta, run.caution
        return run

    def values(self) -> np.ndarray:
        """F of all states, float64 ``[n_states]``, the known ones at their values."""
        x = self.problem.required_features(np.float32)
        return pin(self.network.values(x), self.problem.fixed_vr)
