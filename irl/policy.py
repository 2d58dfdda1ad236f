"""The learnt policy, and the file it travels in."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from irl.errors import InputError
from irl.files import atomic_path
from irl.integers import reals, unmasked
from irl.tensor_file import digest, from_bytes, to_bytes

SCHEMA_VERSION = 1
_METADATA = ("algorithm", "schema_version", "seed", "task_hash")
_WEIGHT = "weights."


@dataclass(frozen=True, eq=False)
class Policy:
    """A deterministic policy and the action values it came from.

    Attributes:
        action: int64 ``[n_states]``, −1 where nothing is feasible.
        q: float32 ``[n_states, n_actions]``, −∞ where infeasible.
        weights: the learner's parameters by name; may be empty.
        task_hash: hash of the task data it was learnt on; empty if on none.
        algorithm: the method's key.
        seed: the seed it was learnt with.
    """

    action: np.ndarray
    q: np.ndarray
    weights: dict[str, np.ndarray] = field(default_factory=dict)
    task_hash: str = ""
    algorithm: str = ""
    seed: int = 0

    @classmethod
    def from_q(
        cls,
        q: np.ndarray,
        mask: np.ndarray,
        *,
        weights: dict[str, np.ndarray] | None = None,
        task_hash: str = "",
        algorithm: str = "",
        seed: int = 0,
    ) -> "Policy":
        """Act by (3.3), π(s) = argmax_a Q(s, a), over feasible actions; ties go to the lowest.

        The actions are decided by the numbers as they come. What is kept of them, float32, has its
        largest entry in each row at the action chosen, whatever their scale and offset.

        Args:
            q: action values ``[n_states, n_actions]``; −∞ marks an avoided action, which is
                taken only where every feasible action is avoided.
            mask: bool ``[n_states, n_actions]``, the feasible pairs.
            weights: the learner's parameters by name.
            task_hash: hash of the task data.
            algorithm: the method's key.
            seed: the seed.

        Raises:
            InputError: if shapes differ, or a feasible pair's value is NaN or +∞.
        """
        q, mask = reals(q, "policy: q"), unmasked(mask, "policy: mask")
        if np.shape(q) != np.shape(mask) or np.ndim(q) != 2:
            raise InputError(f"policy: q {np.shape(q)} and mask {np.shape(mask)} must agree")
        q = np.where(mask, q, -np.inf).astype(np.float64)
        if np.isnan(q).any() or np.isposinf(q).any():
            raise InputError("policy: field 'q' holds NaN or +∞ for a feasible pair")
        # Lifting −∞ to the lowest finite number keeps avoided actions above infeasible ones.
        ranked = np.where(mask, np.maximum(q, np.finfo(np.float64).min), -np.inf)
        action = np.where(mask.any(axis=1), ranked.argmax(axis=1), -1).astype(np.int64)
        return cls(action, _rounded(q, action), dict(weights or {}), task_hash, algorithm, seed)


def _rounded(q: np.ndarray, action: np.ndarray) -> np.ndarray:
    """``q`` as float32, the first largest entry of each row where ``action`` is, if not −1.

    Numbers that float32 cannot tell apart would leave ties, and numbers that it cannot hold become
    infinite; where that hides the choice, the action chosen gets the next number above the others.
    """
    most = np.nextafter(np.finfo(np.float32).max, np.float32(0))  # leaves one above
    kept = np.where(np.isneginf(q), q, np.clip(q, -most, most)).astype(np.float32)
    hidden = np.flatnonzero((action >= 0) & (kept.argmax(axis=1) != action))
    kept[hidden, action[hidden]] = np.nextafter(kept[hidden].max(axis=1), np.float32(np.inf))
    return kept


def save_policy(policy: Policy, path: Path) -> None:
    """Write ``policy`` as safetensors, whole or not at all; equal policies give equal bytes.

    Raises:
        OSError: if the file cannot be written.
    """
    tensors = {"action": policy.action, "q": policy.q}
    tensors |= {f"{_WEIGHT}{name}": array for name, array in policy.weights.items()}
    metadata = {
        "algorithm": policy.algorithm,
        "schema_version": str(SCHEMA_VERSION),
        "seed": str(policy.seed),
        "task_hash": policy.task_hash,
    }
    metadata["digest"] = digest(tensors, metadata)
    with atomic_path(path) as temporary:
        temporary.write_bytes(to_bytes(tensors, metadata))


def load_policy(path: Path, task_hash: str | None = None, mask: np.ndarray | None = None) -> Policy:
    """Read a policy.

    Args:
        path: the safetensors file.
        task_hash: hash of the task data it must have been learnt on; any if ``None``.
        mask: bool ``[n_states, n_actions]``, the task's feasible pairs, which the policy must
            fit; not looked at if ``None``.

    Raises:
        InputError: if the file is missing, damaged, of another schema or for another task, does
            not have the digest that it names, or a field is missing, or has a wrong type, shape or
            value; with a mask also if an action is not feasible or not of the largest value,
            absent where something is feasible, or there where nothing is.
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(f"{path}: no such policy file")
    try:
        tensors, metadata = from_bytes(path.read_bytes())
    except (InputError, OSError) as error:
        raise InputError(f"{path}: not a readable policy file ({error})") from error
    version = metadata.get("schema_version")
    if version != str(SCHEMA_VERSION):
        raise InputError(
            f"{path}: field 'schema_version' is {version!r}; supported: '{SCHEMA_VERSION}'"
        )
    for name in _METADATA:
        if name not in metadata:
            raise InputError(f"{path}: metadata field '{name}' is missing")
    told = metadata.pop("digest", None)  # which files of old lack
    if told is not None and told != digest(tensors, metadata):
        raise InputError(
            f"{path}: field 'digest' is not that of what the file holds, so it was damaged or "
            "changed; save the policy again"
        )
    for name in sorted(metadata.keys() - _METADATA):  # such as a digest whose name was damaged
        raise InputError(f"{path}: metadata field {name!r} is unknown")
    if task_hash is not None and metadata["task_hash"] != task_hash:
        raise InputError(
            f"{path}: field 'task_hash' is {metadata['task_hash'][:12]!r}…, learnt on another "
            f"task than {task_hash[:12]!r}…; give a policy learnt on this task"
        )
    try:
        seed = int(metadata["seed"])
    except ValueError:
        raise InputError(
            f"{path}: field 'seed' must be an integer, is {metadata['seed']!r}"
        ) from None
    _check(path, tensors)
    if mask is not None:
        _check_fit(path, tensors["action"], tensors["q"], mask)
    weights = {
        name.removeprefix(_WEIGHT): array
        for name, array in tensors.items()
        if name.startswith(_WEIGHT)
    }
    return Policy(
        tensors["action"],
        tensors["q"],
        weights,
        metadata["task_hash"],
        metadata["algorithm"],
        seed,
    )


def _check(path: Path, tensors: dict[str, np.ndarray]) -> None:
    for name, dtype, dimensions in (("action", np.int64, 1), ("q", np.float32, 2)):
        if name not in tensors:
            raise InputError(f"{path}: field '{name}' is missing")
        array = tensors[name]
        if array.dtype != dtype or array.ndim != dimensions:
            raise InputError(
                f"{path}: field '{name}' must be {np.dtype(dtype)} with {dimensions} dimensions, "
                f"is {array.dtype} with {array.ndim}"
            )
    action, q = tensors["action"], tensors["q"]
    if action.shape[0] != q.shape[0]:
        raise InputError(
            f"{path}: fields 'action' [{action.shape[0]}] and 'q' [{q.shape[0]}] "
            "must have one row per state"
        )
    if np.isnan(q).any():
        raise InputError(f"{path}: field 'q' holds NaN")
    if action.size and (action.min() < -1 or action.max() >= q.shape[1]):
        raise InputError(f"{path}: field 'action' must lie in −1…{q.shape[1] - 1}")


def _check_fit(path: Path, action: np.ndarray, q: np.ndarray, mask: np.ndarray) -> None:
    """Refuse a policy whose actions are not those of its values, over the task's feasible pairs."""
    if q.shape != mask.shape:
        raise InputError(
            f"{path}: field 'q' has {q.shape[0]} states and {q.shape[1]} actions, the task has "
            f"{mask.shape[0]} and {mask.shape[1]}"
        )
    n = np.arange(action.size)
    some = mask.any(axis=1)
    # What is avoided is −∞ as well, and taken for want of anything else.
    best = np.where(mask, q, -np.inf).max(axis=1, initial=-np.inf)
    chosen, is_feasible = q[n, action], mask[n, action]  # of the last action where there is none
    wrongs = (
        ((action < 0) & some, "though something is feasible there"),
        ((action >= 0) & ~some, "where nothing is feasible"),
        ((action >= 0) & ~is_feasible, "which is not feasible there"),
        ((action >= 0) & (chosen < best), "though field 'q' gives another action more"),
    )
    for wrong, why in wrongs:
        for state in np.flatnonzero(wrong)[:1]:
            raise InputError(f"{path}: field 'action' is {action[state]} in state {state}, {why}")
    for state, infeasible in np.argwhere(~mask & ~np.isneginf(q))[:1]:
        raise InputError(
            f"{path}: field 'q' gives a value to action {infeasible} in state {state}, which is "
            "not feasible there"
        )
