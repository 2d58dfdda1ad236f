"""How good a policy is, and how sure we are of it."""

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri

from irl.demonstrators import OracleDemonstrator
from irl.errors import InputError
from irl.mdp import TransitionModel
from irl.planning import policy_success

HORIZON = 20


def wilson_interval(successes: int, trials: int, confidence: float = 0.95) -> tuple[float, float]:
    """Wilson's score interval of a probability seen as ``successes`` in ``trials``.

    Raises:
        InputError: unless 0 ≤ successes ≤ trials and trials > 0.
    """
    if not 0 <= successes <= trials or trials == 0:
        raise InputError(f"interval: {successes} successes in {trials} trials is not a share")
    low, high = wilson_intervals(np.array(successes), np.array(trials), confidence)
    return float(low), float(high)


def wilson_intervals(
    successes: np.ndarray, trials: np.ndarray, confidence: float = 0.95
) -> tuple[np.ndarray, np.ndarray]:
    """Wilson's score intervals, element by element; NaN without trials.

    Args:
        successes: ``[...]``, from 0 to the number of trials.
        trials: ``[...]``.
        confidence: coverage aimed at.
    """
    z = float(ndtri(0.5 + confidence / 2))
    n = np.where(trials > 0, trials, np.nan)
    share = successes / n
    centre = share + z * z / (2 * n)
    half = z * np.sqrt(share * (1 - share) / n + (z / (2 * n)) ** 2)
    scale = 1 + z * z / n
    # Rounding must not push the ends outside what is possible.
    return np.maximum(0.0, (centre - half) / scale), np.minimum(1.0, (centre + half) / scale)


def bootstrap_interval(
    values: np.ndarray,
    rng: np.random.Generator,
    confidence: float = 0.95,
    resamples: int = 10_000,
) -> tuple[float, float]:
    """Percentile bootstrap interval of a mean, such as of one value per seed.

    Args:
        values: ``[n]``, independent.
        rng: draws the resamples.
        confidence: coverage aimed at.
        resamples: number of resamples.

    Raises:
        InputError: if there are no values or one is not finite.
    """
    values = np.asarray(values, dtype=np.float64)
    if values.ndim != 1 or not values.size or not np.isfinite(values).all():
        raise InputError("interval: one or more finite values wanted")
    # Counts per value instead of copies: resamples × n integers at most.
    counts = rng.multinomial(values.size, np.full(values.size, 1 / values.size), size=resamples)
    tail = (1 - confidence) / 2
    low, high = np.quantile(counts @ values / values.size, [tail, 1 - tail])
    return float(low), float(high)


@dataclass(frozen=True)
class Share:
    """Successes out of trials.

    Attributes:
        successes: number of successes.
        trials: number of trials.
    """

    successes: int
    trials: int

    @property
    def value(self) -> float:
        """The share; NaN without trials."""
        return self.successes / self.trials if self.trials else float("nan")

    @property
    def interval(self) -> tuple[float, float]:
        """Wilson's 95 % interval."""
        return wilson_interval(self.successes, self.trials)


def accuracy_strict(action: np.ndarray, states: np.ndarray, labels: np.ndarray) -> Share:
    """How often the policy's action is the demonstrated one (§6.3).

    Args:
        action: the policy, integer ``[n_states]``, −1 for none.
        states: indices of the states compared.
        labels: the actions demonstrated there.
    """
    hits = action[states] == labels
    return Share(int(hits.sum()), hits.size)


def accuracy_optimal(action: np.ndarray, states: np.ndarray, optimal_actions: np.ndarray) -> Share:
    """How often the policy's action is co-optimal for the demonstrator.

    Args:
        action: the policy, integer ``[n_states]``, −1 for none.
        states: indices of the states compared.
        optimal_actions: bool ``[n_states, n_actions]``.
    """
    chosen = action[states]
    hits = (chosen >= 0) & optimal_actions[states, chosen]
    return Share(int(hits.sum()), hits.size)


def unseen_states(
    model: TransitionModel, starts: np.ndarray, demonstrated: np.ndarray, terminal: np.ndarray
) -> np.ndarray:
    """The states over which the ``…_all`` accuracies are taken.

    Args:
        model: the transition model.
        starts: indices of the states runs start in.
        demonstrated: indices of the states that have a label.
        terminal: bool ``[n_states]`` or indices, where a run ends.

    Returns:
        Indices, ascending, of all states that are reachable, not demonstrated, have a feasible
        action and don't end a run.
    """
    unseen = model.reachable(starts) & model.mask.any(axis=1)
    unseen[demonstrated] = False
    unseen[terminal] = False
    return np.flatnonzero(unseen)


def accuracy_on_unseen(
    action: np.ndarray, demonstrated: np.ndarray, oracle: OracleDemonstrator, starts: np.ndarray
) -> Share:
    """``accuracy_optimal_all``: `accuracy_optimal` over all `unseen_states`.

    Args:
        action: the policy, integer ``[n_states]``, −1 for none.
        demonstrated: indices of the states that have a label.
        oracle: whose co-optimal actions, runs' ends and transition model are the measure.
        starts: indices of the states runs start in.
    """
    unseen = unseen_states(oracle.model, starts, demonstrated, oracle.terminal)
    return accuracy_optimal(action, unseen, oracle.optimal_actions)


def success_mdp(
    model: TransitionModel,
    policy: np.ndarray,
    goal_states: np.ndarray,
    starts: np.ndarray,
    horizon: int = HORIZON,
) -> float:
    """Probability of reaching the goal within ``horizon`` actions, averaged over ``starts``.

    Exact under the transition model: what it lacks is an interval over seeds, not over runs. For
    the oracle's ceiling, hand in ``irl.planning.uniform_policy`` of its co-optimal actions; for
    ``…_all``, ``np.flatnonzero(model.reachable(starts))`` as starts.

    Args:
        model: the transition model.
        policy: actions ``[n_states]`` or probabilities ``[n_states, n_actions]``.
        goal_states: indices.
        starts: indices.
        horizon: largest number of actions.

    Raises:
        InputError: if ``policy`` has a wrong shape or ``starts`` is empty.
    """
    if not np.size(starts):
        raise InputError("success: at least one start state wanted")
    return float(policy_success(model, policy, goal_states, horizon)[starts].mean())
