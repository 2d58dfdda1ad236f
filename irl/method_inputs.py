"""What every method is given and hands back, and demonstrations in the forms that some want."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from inspect import signature
from typing import Any

import numpy as np

from irl.advice import Advice
from irl.demonstrations import Demonstrations
from irl.errors import InputError
from irl.mdp import TransitionModel
from irl.problem import LearningProblem

Progress = Callable[[int, float], None]
"""Told, while a method learns, how many iterations are done, and the objective's value there."""


@dataclass(frozen=True, eq=False)
class Inputs:
    """What every method is given.

    Attributes:
        problem: what is known before anyone demonstrates.
        demonstrations: labelled pairs.
        rng: the only source of chance.
        advice: preferred and avoided actions, None if there is no advice.
        progress: told, after each iteration, how many are done, and the objective's value.
    """

    problem: LearningProblem
    demonstrations: Demonstrations
    rng: np.random.Generator
    advice: Advice | None = None
    progress: Progress | None = None

    @property
    def model(self) -> TransitionModel:
        """The transition model."""
        return self.problem.model

    @property
    def gamma(self) -> float:
        """The discount factor."""
        return self.problem.gamma


@dataclass(frozen=True, eq=False)
class Found:
    """What a method hands back: q or, if q follows from them, reward and caution.

    All is as in `Learnt`, which is in ``irl.methods``.
    """

    reward: np.ndarray | None = None
    q: np.ndarray | None = None
    iterations: int | None = None
    converged: bool | None = None
    note: str = ""
    lower: Mapping[str, float] = field(default_factory=dict)
    caution: float = 0.0


@dataclass
class Count:
    """A callback that counts iterations, and passes them on to whoever follows the learning."""

    progress: Progress | None
    done: int = 0

    def __call__(self, done: int, value: float) -> None:
        """Note an iteration."""
        self.done = done
        if self.progress is not None:
            self.progress(done, value)


# What a method is given, and no option of it.
_NO_OPTIONS = frozenset(
    (
        *("given", "model", "policy", "demonstrations", "advice", "features", "gamma"),
        *("rng", "config", "callback", "options"),
    )
)


def option_names(*takes: Callable[..., Any]) -> tuple[str, ...]:
    """The options that functions, or classes of settings, take between them, sorted."""
    names = {name for each in takes for name in signature(each).parameters}
    return tuple(sorted(names - _NO_OPTIONS))


def demonstrated(demonstrations: Demonstrations) -> Demonstrations:
    """What was demonstrated, without what follows from it."""
    return demonstrations.select(~demonstrations.generalised)


def walks(demonstrations: Demonstrations) -> Demonstrations:
    """What was demonstrated, every run of consecutive steps being a trajectory of its own."""
    shown = demonstrated(demonstrations)
    shown = shown.select(shown.in_order)
    breaks = (np.diff(shown.trajectory) != 0) | (np.diff(shown.step) != 1)
    number = np.r_[0, np.cumsum(breaks)][: len(shown)]
    ended = {(run, step): end for run, step, end in shown.ends.tolist()}
    ends = [
        [number[k], shown.step[k] + 1, ended[moment]]
        for k, moment in enumerate(
            zip(shown.trajectory.tolist(), (shown.step + 1).tolist(), strict=True)
        )
        if moment in ended
    ]
    return replace(shown, trajectory=number, ends=np.array(ends))


def walk_ends(model: TransitionModel, runs: Demonstrations) -> np.ndarray:
    """The states where walks ended, int64 ``[n]``, the most frequent first.

    That is the likeliest outcome of each walk's last action, whichever came about.

    Args:
        model: the transition model.
        runs: demonstrations as `walks` gives them.
    """
    last = np.append(np.diff(runs.trajectory) != 0, True)[: len(runs)]
    rows = model.pair_index(runs.state[last], runs.action[last])
    ends = np.asarray(model.P[rows].argmax(axis=1)).ravel()
    states, count = np.unique(ends, return_counts=True)
    return states[np.argsort(-count, kind="stable")]


def labelled_policy(model: TransitionModel, demonstrations: Demonstrations) -> np.ndarray:
    """The actions demonstrated most often, int64 ``[n_states]``; −1, a run's end, where none was.

    Raises:
        InputError: if there is no demonstration, or a pair is infeasible.
    """
    if len(demonstrations) == 0:
        raise InputError("demonstrations: at least one (state, action) pair is needed")
    demonstrations.check(model, "demonstrations")
    return demonstrations.counted.policy(model.n_states)


def inverse_temperature(demonstrations: Demonstrations) -> float:
    """β for a VR network: 10 times the moves of the longest walk, at least 30.

    f lies in (−1, 1) and must rise along the walk, so that a move changes it by no more than about
    one over its length.
    """
    _, length = np.unique(walks(demonstrations).trajectory, return_counts=True)
    return 10.0 * max(3, int(length.max(initial=0)))
