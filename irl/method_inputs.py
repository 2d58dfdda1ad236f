"""Demonstrations and features in the forms that some methods want them in."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.distance import cdist

from irl.advice import Advice
from irl.demonstrations import Demonstrations
from irl.errors import InputError
from irl.mdp import TransitionModel
from irl.problem import LearningProblem


@dataclass(frozen=True, eq=False)
class Inputs:
    """What every method is given.

    Attributes:
        problem: what is known before anyone demonstrates.
        demonstrations: labelled pairs.
        rng: the only source of chance.
        advice: preferred and avoided actions, None if there is no advice.
    """

    problem: LearningProblem
    demonstrations: Demonstrations
    rng: np.random.Generator
    advice: Advice | None = None

    @property
    def model(self) -> TransitionModel:
        """The transition model."""
        return self.problem.model

    @property
    def gamma(self) -> float:
        """The discount factor."""
        return self.problem.gamma


def demonstrated(demonstrations: Demonstrations) -> Demonstrations:
    """What was demonstrated, without what follows from it."""
    return demonstrations.select(~demonstrations.generalised)


def walks(demonstrations: Demonstrations) -> Demonstrations:
    """What was demonstrated, every run of consecutive steps being a trajectory of its own."""
    shown = demonstrated(demonstrations)
    shown = shown.select(np.lexsort((shown.step, shown.trajectory)))
    breaks = (np.diff(shown.trajectory) != 0) | (np.diff(shown.step) != 1)
    return replace(shown, trajectory=np.r_[0, np.cumsum(breaks)][: len(shown)])


def labelled_policy(model: TransitionModel, demonstrations: Demonstrations) -> np.ndarray:
    """The demonstrated actions, int64 ``[n_states]``; −1, a run's end, where there is none.

    Raises:
        InputError: if there is no demonstration, or a pair is infeasible.
    """
    if len(demonstrations) == 0:
        raise InputError("demonstrations: at least one (state, action) pair is needed")
    demonstrations.check(model, "demonstrations")
    labels = demonstrations.resolved()
    policy = np.full(model.n_states, -1, dtype=np.int64)
    policy[labels.state] = labels.action
    return policy


def inverse_temperature(demonstrations: Demonstrations) -> float:
    """β for a VR network: 10 times the moves of the longest walk, at least 30.

    f lies in (−1, 1) and must rise along the walk, so that a move changes it by no more than about
    one over its length.
    """
    _, length = np.unique(walks(demonstrations).trajectory, return_counts=True)
    return 10.0 * max(3, int(length.max(initial=0)))


def gaussian_bumps(features: np.ndarray, number: int, rng: np.random.Generator) -> np.ndarray:
    """Basis functions for (3.10), one at each of ``number`` states drawn evenly.

    Each is as wide as the bumps are apart, in the median. Features are first brought to unit
    variance.

    Returns:
        float64 ``[n_states, number]``.
    """
    spread = features.std(axis=0)
    x = features / np.where(spread > 0, spread, 1.0)
    centres = x[np.sort(rng.permutation(len(x))[:number])]
    apart = cdist(centres, centres)
    apart[apart == 0] = np.inf
    width = np.median(apart.min(axis=1))
    return np.exp(-cdist(x, centres, "sqeuclidean") / (2 * width**2))
