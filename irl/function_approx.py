"""FunctionApprox of thesis Algorithm 4.1: a VR network that is fitted again as labels come in."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from irl.bellman import BellmanTerm
from irl.demonstrations import Demonstrations
from irl.likelihood import LikelihoodProblem
from irl.mdp import TransitionModel
from irl.training import Training, TrainingConfig, train
from irl.vr_function import VRFunction, pin


@dataclass(frozen=True)
class Surroundings:
    """What all learners of one task share.

    Attributes:
        model: the transition model.
        features: float32 ``[n_states, n_features]``, the networks' input.
        gamma: discount factor, used by the Bellman penalty alone.
        fixed_vr: state → VR value known beforehand.
    """

    model: TransitionModel
    features: np.ndarray
    gamma: float
    fixed_vr: Mapping[int, float]


@dataclass
class Learner:
    """A network, and where its training stands.

    Attributes:
        surroundings: the task.
        network: the VR function, changed in place by ``fit``.
        beta: the inverse temperature that the last training ended with.
        carry_beta: whether a training starts from ``beta`` instead of its own setting.
        weight: float64 ``[n_states]``, how much a state's label counts; all alike if None.
    """

    surroundings: Surroundings
    network: VRFunction
    beta: float = 1.0
    carry_beta: bool = False
    weight: np.ndarray | None = None

    def fit(
        self,
        labels: Demonstrations,
        config: TrainingConfig,
        rng: np.random.Generator,
        report: Callable[[int, float], None] | None = None,
    ) -> Training:
        """Train on ``labels`` from the present weights; arguments as ``irl.training.train``.

        Raises:
            InputError: if a label is infeasible, or training diverges.
        """
        at = self.surroundings
        if self.carry_beta:
            config = replace(config, beta=self.beta)
        weight = None if self.weight is None else self.weight[labels.state]
        problem = LikelihoodProblem.build(
            at.model, labels.state, labels.action, weight=weight, fixed_vr=at.fixed_vr
        )
        bellman = None
        if config.bellman_weight > 0:
            bellman = BellmanTerm(
                at.model,
                at.gamma,
                at.fixed_vr,
                batch=config.bellman_batch,
                delta=config.bellman_delta,
            )
        run = train(self.network, problem, at.features, config, rng, report, bellman)
        self.beta = run.beta
        return run

    def values(self) -> np.ndarray:
        """F of all states, float64 ``[n_states]``, the known ones at their values."""
        return pin(self.network.values(self.surroundings.features), self.surroundings.fixed_vr)
