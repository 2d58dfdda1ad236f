"""How likely the demonstrations are once a reward has been planned with: R → V → f → (3.19)."""

from dataclasses import dataclass

import numpy as np

from irl.baselines.ascent import AscentConfig, Callback, ascend
from irl.baselines.differentiable_planning import Maximum, Planner, PNorm
from irl.baselines.features import Features
from irl.choices import check_range
from irl.demonstrations import Demonstrations
from irl.likelihood import LikelihoodProblem
from irl.mdp import TransitionModel


@dataclass
class PlannedLikelihood:
    """The demonstrator acts by π(a | s) ∝ exp(β Q(s, a)), Q = P f being planned for the reward.

    For a p-norm, which needs values from 0, the reward is first shifted by its least entry.
    One evaluation begins where the last one's planning ended.

    Attributes:
        problem: the demonstrations, prepared.
        planner: solves Bellman's equation.
        beta: inverse temperature β.
    """

    problem: LikelihoodProblem
    planner: Planner
    beta: float

    @classmethod
    def build(
        cls,
        model: TransitionModel,
        demonstrations: Demonstrations,
        gamma: float,
        maximum: Maximum,
        beta: float,
        of_pairs: bool = False,
    ) -> "PlannedLikelihood":
        """Prepare; rewards are those of states, or of pairs if told so.

        Raises:
            InputError: if there is no demonstration, a pair is infeasible, β is not above 0, or
                gamma is out of range.
        """
        check_range("beta", beta, 0.0, open_low=True)
        return cls.over(
            LikelihoodProblem.of(model, demonstrations),
            Planner(model, gamma, maximum, of_pairs=of_pairs),
            beta,
        )

    @classmethod
    def over(cls, problem: LikelihoodProblem, planner: Planner, beta: float) -> "PlannedLikelihood":
        """From demonstrations prepared for a reward of states, whatever the planner plans for."""
        return cls(problem.of_pairs() if planner.of_pairs else problem, planner, beta)

    def value_and_gradient(self, reward: np.ndarray) -> tuple[float, np.ndarray]:
        """Mean log-likelihood (≤ 0) at a reward ``[n_states]``, and its gradient in the reward.

        So for a reward of pairs ``[n_pairs]``, if rewards are those of pairs.

        Raises:
            InputError: if the reward is not finite.
        """
        reward = np.asarray(reward, dtype=np.float64)
        least = reward.argmin()
        shifted = isinstance(self.planner.maximum, PNorm)
        value, g = self.of_values(self.planner.solve(reward - reward[least] * shifted))
        gradient = self.planner.pull(g)
        if shifted:
            gradient[least] -= gradient.sum()
        return value, gradient

    def in_weights(self, features: Features, weights: np.ndarray) -> tuple[float, np.ndarray]:
        """The same for R = Φ ω (3.10): the value, and its gradient in ω ``[d]``."""
        value, gradient = self.value_and_gradient(features @ weights)
        return value, features.T @ gradient

    def climb(
        self, features: Features, config: AscentConfig, callback: Callback | None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Climb (3.14) from ω = 0; R = Φ ω and ω ``[d]``."""
        answer = ascend(
            lambda weights: self.in_weights(features, weights),
            np.zeros(features.shape[1]),
            config,
            callback,
        )
        return features @ answer.x, answer.x

    def of_values(self, f: np.ndarray) -> tuple[float, np.ndarray]:
        """Mean log-likelihood at what the planner's `solve` returns, and its gradient in that."""
        value, df, _ = self.problem.value_and_gradient(f[self.problem.states], self.beta)
        g = np.zeros(f.size)
        g[self.problem.states] = df
        return value, g
