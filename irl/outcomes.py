"""What comes of learning besides a policy of one action a state: a reward, a policy by chance.

save_reward(LearntReward.of(learnt, gamma=task.gamma, task_hash=task.task_hash), path)
q = load_reward(path, task.task_hash).q(task.model)  # planned with it, anywhere
"""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from irl.choices import check_range
from irl.errors import InputError
from irl.evaluation import TOLERANCE
from irl.integers import reals, unmasked
from irl.kept_arrays import read_arrays, write_arrays
from irl.mdp import TransitionModel
from irl.planning import value_iteration

if TYPE_CHECKING:  # torch, which files need not wait for
    from irl.methods import Learnt

Number = TypeVar("Number", int, float)

_REWARD, _POLICY, _CAUTION = "reward", "soft policy", "caution"
REWARD_VERSION = "2"
"""Of files of rewards. In version 1 there was no caution."""
_TOLD = ("algorithm", "seed", "task_hash")


@dataclass(frozen=True, eq=False)
class LearntReward:
    """A reward, and what it was learnt with.

    Attributes:
        reward: float64 ``[n_states]``, earned on entering a state, or ``[n_states, n_actions]``,
            earned by acting; finite.
        gamma: the discount factor it was learnt with.
        task_hash: hash of the task data it was learnt on; empty if on none.
        algorithm: the method's key.
        seed: the seed it was learnt with.
        caution: u, from 0: acting earns u (1 − max P) less.

    Raises:
        InputError: naming the field that is none of these.
    """

    reward: np.ndarray
    gamma: float
    task_hash: str = ""
    algorithm: str = ""
    seed: int = 0
    caution: float = 0.0

    @classmethod
    def of(
        cls,
        learnt: "Learnt",
        *,
        gamma: float,
        task_hash: str = "",
        algorithm: str = "",
        seed: int = 0,
    ) -> "LearntReward":
        """The reward that a method learnt.

        Raises:
            InputError: if it learnt none, as behaviour cloning does.
        """
        if learnt.reward is None:
            raise InputError("this method learns no reward; keep its policy", place="reward")
        return cls(learnt.reward, gamma, task_hash, algorithm, seed, learnt.caution)

    def __post_init__(self) -> None:
        """Check the fields."""
        reward = reals(self.reward, "reward")
        if reward.ndim not in (1, 2) or not np.isfinite(reward).all():
            raise InputError(
                f"finite numbers [n_states] or [n_states, n_actions] wanted, got "
                f"{list(reward.shape)}",
                place="reward",
            )
        check_range("gamma", self.gamma, 0, 1, open_high=True)
        check_range("caution", self.caution, 0)
        object.__setattr__(self, "reward", reward)

    def q(self, model: TransitionModel, terminal: np.ndarray | None = None) -> np.ndarray:
        """Optimal action values for the reward, ``[n_states, n_actions]``, −∞ where infeasible.

        Args:
            model: the transition model.
            terminal: indices of states where a run ends; a state without actions ends it too.

        Raises:
            InputError: if the model has another number of states or actions.
        """
        doubt = self.caution * model.surprise if self.caution else 0.0
        return value_iteration(model, self.reward, self.gamma, -doubt, terminal)[1]


@dataclass(frozen=True, eq=False)
class SoftPolicy:
    """A policy that chooses by chance.

    Attributes:
        probability: float64 ``[n_states, n_actions]``; rows sum to 1, or are 0 where nothing is
            to be done.
        task_hash: hash of the task data it was learnt on; empty if on none.
        algorithm: the method's key.
        seed: the seed it was learnt with.

    Raises:
        InputError: naming the state whose row is neither.
    """

    probability: np.ndarray
    task_hash: str = ""
    algorithm: str = ""
    seed: int = 0

    @classmethod
    def from_q(
        cls,
        q: np.ndarray,
        mask: np.ndarray,
        *,
        beta: float = 1.0,
        task_hash: str = "",
        algorithm: str = "",
        seed: int = 0,
    ) -> "SoftPolicy":
        """Choose by π(a | s) ∝ exp(β Q(s, a)) over the feasible actions.

        Args:
            q: action values ``[n_states, n_actions]``; −∞ marks an avoided action, which is
                taken only where every feasible action is avoided, each then alike.
            mask: bool ``[n_states, n_actions]``, the feasible pairs.
            beta: inverse temperature β, from 0.
            task_hash: hash of the task data.
            algorithm: the method's key.
            seed: the seed.

        Raises:
            InputError: if shapes differ, a feasible pair's value is NaN or +∞, or β is negative.
        """
        check_range("beta", beta, 0)
        q, mask = reals(q, "soft policy: q"), unmasked(mask, "soft policy: mask")
        if q.shape != mask.shape or q.ndim != 2 or mask.dtype != np.bool_:
            raise InputError(
                f"numbers and a mask of one shape wanted, got {list(q.shape)} and {mask.dtype} "
                f"{list(mask.shape)}",
                place="soft policy: q",
            )
        for s, a in np.argwhere(mask & (np.isnan(q) | np.isposinf(q)))[:1]:
            raise InputError(f"is {q[s, a]} for a feasible pair", place=f"soft policy: q[{s}, {a}]")
        open_to = mask & (np.isfinite(q) | ~(mask & np.isfinite(q)).any(axis=1, keepdims=True))
        value = np.where(np.isfinite(q), q, 0.0)
        peak = np.where(open_to, value, -np.inf).max(axis=1, keepdims=True, initial=-np.inf)
        below = np.where(open_to, value - np.where(np.isfinite(peak), peak, 0.0), 0.0)
        weight = np.where(open_to, np.exp(beta * below), 0.0)
        total = weight.sum(axis=1, keepdims=True)
        probability = weight / np.where(total > 0, total, 1.0)
        return cls(probability, task_hash, algorithm, seed)

    def __post_init__(self) -> None:
        """Check the probabilities."""
        table = reals(self.probability, "probability")
        if table.ndim != 2:
            raise InputError(
                f"[n_states, n_actions] wanted, got {list(table.shape)}", place="probability"
            )
        total = table.sum(axis=1)
        right = (np.abs(total - 1) <= TOLERANCE) | (total == 0)
        for s in np.flatnonzero(~((table >= 0).all(axis=1) & right))[:1]:
            raise InputError(
                f"row {s} must hold probabilities that sum to 1, or be all 0; sums to "
                f"{total[s]:.9g}",
                place="probability",
            )
        object.__setattr__(self, "probability", table)


def save_reward(reward: LearntReward, path: Path) -> None:
    """Write a reward as safetensors, whole or not at all; equal rewards give equal bytes.

    Raises:
        OSError: if the file cannot be written.
    """
    numbers = {"gamma": reward.gamma, _CAUTION: reward.caution}
    told = _told(reward) | {name: repr(float(value)) for name, value in numbers.items()}
    write_arrays(path, _REWARD, {"reward": reward.reward}, told, REWARD_VERSION)


def load_reward(path: Path, task_hash: str | None = None) -> LearntReward:
    """Read a reward.

    Args:
        path: the file.
        task_hash: hash of the task data it must have been learnt on; any if None.

    Raises:
        InputError: if the file is missing, damaged, of another kind or for another task; names the
            file and the field.
    """
    named, versions = (*_TOLD, "gamma"), ("1", REWARD_VERSION)
    arrays, told = read_arrays(path, _REWARD, named, task_hash, versions)
    array = _only(path, arrays, "reward")
    gamma, seed = _number(path, told, "gamma", float), _number(path, told, "seed", int)
    if told["schema_version"] != REWARD_VERSION:
        told[_CAUTION] = "0"
    caution = _number(path, told, _CAUTION, float)
    try:
        return LearntReward(array, gamma, told["task_hash"], told["algorithm"], seed, caution)
    except InputError as error:
        raise InputError(str(error), place=str(path)) from None


def save_soft_policy(policy: SoftPolicy, path: Path) -> None:
    """Write a policy as safetensors, whole or not at all; equal policies give equal bytes.

    Raises:
        OSError: if the file cannot be written.
    """
    write_arrays(path, _POLICY, {"probability": policy.probability}, _told(policy))


def load_soft_policy(path: Path, task_hash: str | None = None) -> SoftPolicy:
    """Read a policy by chance.

    Args:
        path: the file.
        task_hash: hash of the task data it must have been learnt on; any if None.

    Raises:
        InputError: as ``load_reward``.
    """
    arrays, told = read_arrays(path, _POLICY, _TOLD, task_hash)
    array = _only(path, arrays, "probability")
    seed = _number(path, told, "seed", int)
    try:
        return SoftPolicy(array, told["task_hash"], told["algorithm"], seed)
    except InputError as error:
        raise InputError(str(error), place=str(path)) from None


def _told(kept: LearntReward | SoftPolicy) -> dict[str, str]:
    return {name: str(getattr(kept, name)) for name in _TOLD}


def _only(path: Path, arrays: dict[str, np.ndarray], name: str) -> np.ndarray:
    """The one array that the file must hold, of float64."""
    if arrays.keys() != {name} or arrays[name].dtype != np.float64:
        found = {key: str(array.dtype) for key, array in arrays.items()}
        raise InputError(f"one array '{name}' of float64 wanted, got {found}", place=str(path))
    return arrays[name]


def _number(path: Path, told: dict[str, str], name: str, kind: type[Number]) -> Number:
    try:
        return kind(told.get(name, ""))
    except ValueError:
        raise InputError(
            f"field '{name}' must be a number, is {told.get(name)!r:.40}", place=str(path)
        ) from None
