"""How a gymnasium environment numbers its states and actions, and its table ``P``.

``irl`` counts states and actions from 0; ``Discrete(n, start=k)`` counts from k, and tables come as
dicts, as lists or as arrays.
"""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from irl.errors import InputError
from irl.integers import integers


def numbering(env: Any, name: str) -> tuple[int, int | None]:
    """The first number of a discrete space, and how many it has: 0 and None without the space.

    Args:
        env: an environment.
        name: ``"observation_space"`` or ``"action_space"``.

    Raises:
        InputError: if the space is not discrete.
    """
    space = getattr(env, name, None)
    if space is None:
        return 0, None
    if not isinstance(getattr(space, "n", None), (int, np.integer)):
        raise InputError(
            f"a discrete space wanted, one number each, got {space}",
            place=f"environment {env}: {name}",
        )
    return int(getattr(space, "start", 0)), int(space.n)


def table_entries(env: Any, n_states: int, n_actions: int) -> list[tuple]:
    """Every (state, action, probability, next state, reward, terminated) of ``env.P``, from 0.

    ``P[s][a]`` lists (probability, next state, reward, terminated). ``P`` may be a dict of dicts, a
    list of lists, or an array ``[n_states, n_actions, outcomes, 4]``. Rows of lists and arrays
    count from 0. Keys, and next states, may count as the environment's spaces do.

    Args:
        env: the environment, unwrapped.
        n_states: number of states.
        n_actions: number of actions.

    Raises:
        InputError: if the table is of another form, or it cannot be told from where it counts.
    """
    place = f"environment {env}: P"
    first_state, _ = numbering(env, "observation_space")
    first_action, _ = numbering(env, "action_space")
    entries = []
    for s, row in _rows(env.P, place):
        for a, outcomes in _rows(row, f"{place}[{s}]"):
            for outcome in outcomes:
                entries.append((s, a, *_outcome(outcome, f"{place}[{s}][{a}]")))
    keyed = isinstance(env.P, Mapping)
    after = [entry[3] for entry in entries]
    states = [entry[0] for entry in entries] if keyed else []
    state_shift = _counts_from(states + after, first_state, n_states, f"{place}, states")
    keyed_actions = any(isinstance(row, Mapping) for _, row in _rows(env.P, place))
    actions = [entry[1] for entry in entries] if keyed_actions else []
    action_shift = _counts_from(actions, first_action, n_actions, f"{place}, actions")
    row_shift = state_shift if keyed else 0
    moved = [
        (s - row_shift, a - action_shift, p, t - state_shift, reward, ends)
        for s, a, p, t, reward, ends in entries
    ]
    for s, a, _, t, reward, _ in moved:
        if not (0 <= s < n_states and 0 <= a < n_actions and 0 <= t < n_states):
            raise InputError(
                f"state {s}, action {a}, next state {t}: states must lie in 0…{n_states - 1}, "
                f"actions in 0…{n_actions - 1}",
                place=place,
            )
        if not np.isfinite(reward):
            raise InputError(f"state {s}, action {a}: the reward is {reward}", place=place)
    told = {entry[0] for entry in moved}
    for s, a, p, t, _, ends in moved:
        if p > 0 and not ends and t not in told:
            raise InputError(
                f"state {s}, action {a} leads to state {t}, of which nothing is told", place=place
            )
    return moved


def _rows(table: Any, place: str) -> Iterable[tuple[int, Any]]:
    if isinstance(table, Mapping):
        integers(list(table), f"{place}: keys")
        return table.items()
    if isinstance(table, (list, tuple, np.ndarray)):
        return enumerate(table)
    raise InputError(f"a dict, a list or an array wanted, got {type(table).__name__}", place=place)


def _outcome(outcome: Any, place: str) -> tuple[float, int, float, bool]:
    try:
        p, after, reward, ends = outcome
        whole = int(after)
        if whole == after:
            return float(p), whole, float(reward), bool(ends)
    except (TypeError, ValueError, OverflowError):
        pass
    raise InputError(
        f"(probability, next state, reward, terminated) wanted, got {outcome}", place=place
    )


def _counts_from(numbers: Iterable[int], first: int, count: int, place: str) -> int:
    """Whether ``numbers`` count from 0 or from ``first``, as some of them show."""
    found = set(numbers)
    if first == 0 or not found:
        return 0
    from_zero, own = range(count), range(first, first + count)
    fits = [k for k, valid in ((0, from_zero), (first, own)) if all(n in valid for n in found)]
    if len(fits) != 1:
        raise InputError(
            f"{min(found)}…{max(found)} fit counting from {'either' if fits else 'neither'}",
            place=place,
            valid=(f"0…{count - 1}", f"{first}…{first + count - 1}, as the environment's space"),
        )
    return fits[0]
