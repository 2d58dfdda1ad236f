"""Runs of states whose actions were not recorded, and learning from them.

An action is not guessed but inferred: of those that can lead from a state to the one that came
after, each has the posterior probability P(a | s, s') ∝ π(a | s) P(s' | s, a). What is done in a
state, π, is first what makes the moves out of it likely, and then also what the method learnt
(expectation and maximisation by turns; Dempster, Laird and Rubin 1977).
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from irl.choices import check_choice, check_number, check_range
from irl.demonstrations import Demonstrations
from irl.errors import InputError
from irl.integers import integers
from irl.mdp import TransitionModel
from irl.methods import METHODS, Learnt, learn
from irl.outcomes import SoftPolicy
from irl.problem import LearningProblem

LEARN_FROM_STATES = (
    *("fa_mlirl", "max_ent", "deep_max_ent", "bellman_gradient", "linear_mlirl"),
    *("behaviour_cloning", "planning"),
)
"""Methods whose likelihood is a mean over labels, which may be shares of one move."""
COPIES = 20
"""How often each run is labelled: a share of a label is told to 1 / 20."""
_SHARPNESS = np.geomspace(0.1, 1000, 25)


@dataclass(frozen=True, eq=False)
class StateRuns:
    """Runs of states, in the order they were given.

    Attributes:
        runs: each int64 ``[n + 1]``, the states of n ≥ 1 moves, the last being where it ended.

    Raises:
        InputError: if a run is not integers from 0, or has no move; names the run.
    """

    runs: tuple[np.ndarray, ...]

    def __post_init__(self) -> None:
        """Check the runs."""
        runs = tuple(integers(run, f"run {k}: states") for k, run in enumerate(self.runs))
        for k, run in enumerate(runs):
            if run.size < 2:
                raise InputError("two states or more wanted, a move leads to one", place=f"run {k}")
        if not runs:
            raise InputError("at least one run wanted", place="states")
        object.__setattr__(self, "runs", runs)

    @classmethod
    def of(cls, runs: Iterable[Any]) -> "StateRuns":
        """Runs from anything that gives sequences of states, such as episodes' observations."""
        return cls(tuple(runs))

    @property
    def moves(self) -> NDArray[np.int64]:
        """(run, step, state, next state) of every move, int64 ``[n, 4]``."""
        parts = [
            np.stack([np.full(r.size - 1, k), np.arange(r.size - 1), r[:-1], r[1:]], axis=1)
            for k, r in enumerate(self.runs)
        ]
        return np.concatenate(parts)


def possible_actions(model: TransitionModel, runs: StateRuns) -> NDArray[np.float64]:
    """P(s' | s, a) of every move for every action, float64 ``[n, n_actions]``, 0 where infeasible.

    Raises:
        InputError: if a state is not the model's, or no action leads on; names run and step.
    """
    for k, run in enumerate(runs.runs):
        integers(run, f"run {k}: states", below=model.n_states)
    run, step, state, after = runs.moves.T
    likelihood = np.zeros((state.size, model.n_actions))
    for a in range(model.n_actions):
        pair = model.pair_index(state, a)
        can = np.flatnonzero(pair >= 0)
        likelihood[can, a] = np.asarray(model.P[pair[can], after[can]]).ravel()
    for k in np.flatnonzero(~likelihood.any(axis=1))[:1]:
        raise InputError(
            f"no action leads from state {state[k]} to state {after[k]}; if two runs were joined "
            "there, or states left out, give what is whole as runs of their own",
            place=f"run {run[k]}, step {step[k]}",
        )
    return likelihood


def action_posterior(
    model: TransitionModel, runs: StateRuns, prior: np.ndarray | None = None, weight: float = 1.0
) -> NDArray[np.float64]:
    """P(a | s, s') of every move, what is done in a state being learnt from all moves out of it.

    Args:
        model: the transition model.
        runs: the states.
        prior: what is believed to be done, probabilities ``[n_states, n_actions]``; evenly among
            the feasible actions if None.
        weight: how many moves out of a state the belief counts for.

    Returns:
        float64 ``[n, n_actions]``, rows sum to 1, in the order of ``StateRuns.moves``.

    Raises:
        InputError: as ``possible_actions``, or if ``weight`` is not above 0.
    """
    check_range("weight", weight, 0, open_low=True)
    likelihood = possible_actions(model, runs)
    state = runs.moves[:, 2]
    if prior is None:
        prior = model.mask / np.maximum(model.mask.sum(axis=1, keepdims=True), 1)
    # What a method is sure of never forbids what was seen.
    belief = weight * np.where(model.mask, np.maximum(prior, 1e-6), 0.0)
    policy = belief.copy()
    seen = np.unique(state)
    for _ in range(200):
        share = policy[state] * likelihood
        share /= share.sum(axis=1, keepdims=True)
        counted = belief.copy()
        np.add.at(counted, state, share)
        counted[seen] /= counted[seen].sum(axis=1, keepdims=True)
        settled = np.abs(counted[seen] - policy[seen]).max() < 1e-6
        policy = counted
        if settled:
            break
    share = policy[state] * likelihood
    return share / share.sum(axis=1, keepdims=True)


def labelled(
    runs: StateRuns, posterior: np.ndarray, rng: np.random.Generator, copies: int = COPIES
) -> Demonstrations:
    """Every run several times, each action as often as its posterior says, to less than one copy.

    Args:
        runs: the states.
        posterior: ``[n, n_actions]``, see ``action_posterior``.
        rng: draws where the rounding falls, and which copy gets which label.
        copies: how often each run is there.

    Returns:
        ``copies`` times the runs, numbered from 0.
    """
    run, step, state, _ = runs.moves.T
    # Systematic draws: one point in each of ``copies`` equal parts of [0, 1), all shifted alike.
    points = (np.arange(copies) + rng.random((state.size, 1))) / copies
    bounds = np.cumsum(posterior, axis=1)[:, None, :-1]
    action = rng.permuted((points[:, :, None] >= bounds).sum(axis=2), axis=1)
    number = run[:, None] + len(runs.runs) * np.arange(copies)
    parts = np.broadcast_arrays(number, step[:, None], state[:, None], action)
    trajectory, place, where, done = (part.T.ravel() for part in parts)
    return Demonstrations(trajectory, place, where, done, np.zeros(done.size, dtype=np.uint8))


def learn_from_states(
    name: str,
    problem: LearningProblem | TransitionModel,
    runs: StateRuns,
    features: np.ndarray | None = None,
    *,
    gamma: float | None = None,
    rng: np.random.Generator,
    rounds: int = 3,
    **options: Any,
) -> Learnt:
    """Learn from runs of states by the method of that name, as ``irl.methods.learn`` does.

    Args:
        name: a name in ``LEARN_FROM_STATES``.
        problem: what is known beforehand, or the transition model alone.
        runs: the states.
        features: as for ``learn``.
        gamma: as for ``learn``.
        rng: the only source of chance.
        rounds: how often actions are inferred and learnt from; what was learnt is the prior of the
            next round.
        options: the method's own.

    Returns:
        Of all rounds, what makes the moves likeliest; ``seconds`` are those of all.

    Raises:
        InputError: if the method needs the actions, a move is impossible, or as ``learn``.
    """
    check_choice("method", name, METHODS)
    if name not in LEARN_FROM_STATES:
        raise InputError(
            f"{name} needs the actions, and states alone were shown",
            place="method",
            valid=LEARN_FROM_STATES,
        )
    check_number("rounds", rounds, whole=True)
    check_range("rounds", rounds, 1)
    model = problem if isinstance(problem, TransitionModel) else problem.model
    likelihood = possible_actions(model, runs)
    state = runs.moves[:, 2]
    prior, seconds, best, found = None, 0.0, -np.inf, None
    for _ in range(rounds):
        shown = labelled(runs, action_posterior(model, runs, prior), rng)
        learnt = learn(name, problem, shown, features, gamma=gamma, rng=rng, **options)
        seconds += learnt.seconds
        prior, value = _likeliest(learnt.q, model, state, likelihood)
        if value > best:
            best, found = value, learnt
    assert found is not None
    return replace(found, seconds=seconds)


def _likeliest(
    q: np.ndarray, model: TransitionModel, state: np.ndarray, likelihood: np.ndarray
) -> tuple[np.ndarray, float]:
    """Of the policies π ∝ exp(β q) that under which the moves are likeliest, and their mean log."""
    spread = np.ptp(q[np.isfinite(q)])
    choices = []
    for beta in _SHARPNESS / (spread if spread > 0 else 1.0):
        policy = SoftPolicy.from_q(q, model.mask, beta=beta).probability
        with np.errstate(divide="ignore"):
            told = np.log((policy[state] * likelihood).sum(axis=1)).mean()
        choices.append((float(told), policy))
    value, policy = max(choices, key=lambda choice: choice[0])
    return policy, value
