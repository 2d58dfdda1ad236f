"""From what people have to demonstrations: arrays, moves, other libraries' episodes.

What another library keeps is recognised by its attributes, so none of them needs to be installed.
Where a run begins and ends is never guessed: a record that does not say is refused, with what to
do. Frames and CSV files are read by `irl.tables`. Short examples: ``experiments/own_data.md``.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from irl.demonstrations import Demonstrations
from irl.errors import InputError
from irl.integers import integers

_OBSERVATIONS, _ACTIONS = ("obs", "observations"), ("acts", "actions")


def from_arrays(
    state: Any, action: Any, *, ends: Any = None, lengths: Any = None, source: str = "demonstrator"
) -> Demonstrations:
    """Runs one after the other in flat arrays, as recordings and data sets for learning keep them.

    Args:
        state: integers ``[n]``.
        action: integers ``[n]``, what was done in each.
        ends: bool ``[n]``, true at the last pair of each run, terminated or truncated alike:
            ``terminals | timeouts``. What comes after the last one is a run that was cut off.
        lengths: integers ``[k]`` in place of ``ends``: how many pairs each run has.
        source: who says so, a name in ``irl.demonstrations.SOURCES``.

    Returns:
        The runs, numbered from 0.

    Raises:
        InputError: if neither or both of ``ends`` and ``lengths`` are given, or a type, length or
            value is wrong.
    """
    state = integers(state, "state")
    action = integers(action, "action")
    n = state.size
    if action.size != n:
        raise InputError(f"as many as states wanted, {n}, got {action.size}", place="action")
    if (ends is None) == (lengths is None):
        raise InputError(
            "give one of both, to say where runs end; if it is all one run, lengths=[len(state)]",
            place="ends, lengths",
        )
    if lengths is None:
        last = np.asarray(ends)
        if last.shape != (n,) or last.dtype != np.bool_:
            raise InputError(
                f"bool [{n}] wanted, got {last.dtype} {list(last.shape)}; 0 and 1 become bool by "
                ".astype(bool)",
                place="ends",
            )
        cuts = np.flatnonzero(last[:-1]) + 1
    else:
        sizes = integers(lengths, "lengths", low=1)
        if sizes.sum() != n:
            raise InputError(f"must sum to {n} pairs, sum to {sizes.sum()}", place="lengths")
        cuts = np.cumsum(sizes)[:-1]
    pairs = np.stack([state, action], axis=1)
    runs = np.split(pairs, cuts) if n else []
    return _numbered(runs, source)


def from_moves(runs: Iterable[Any], *, source: str = "demonstrator") -> Demonstrations:
    """Runs of moves (state, action, next state).

    Args:
        runs: each integers ``[n, 3]``, a run from its beginning, every move going on from where
            the one before led.
        source: who says so, a name in ``irl.demonstrations.SOURCES``.

    Returns:
        The runs, numbered from 0; where the last move of each led is not kept.

    Raises:
        InputError: if a run is not of such moves, or does not go on where a move led; names run
            and move.
    """
    runs = list(runs)
    if runs and np.ndim(runs[0]) == 1:
        raise InputError(
            "a list of runs wanted, each of moves (state, action, next state), got moves; if they "
            "are one run, give [moves]; if they are unrelated, Demonstrations.from_labels of "
            "states and actions",
            place="moves",
        )
    kept = []
    for number, run in enumerate(runs):
        moves = integers(run, f"moves: run {number}", columns=3)
        for k in np.flatnonzero(moves[:-1, 2] != moves[1:, 0])[:1]:
            raise InputError(
                f"move {k} leads to state {moves[k, 2]}, but move {k + 1} begins in "
                f"{moves[k + 1, 0]}; if two runs were joined there, give them apart",
                place=f"moves: run {number}",
            )
        kept.append(moves[:, :2])
    return _numbered(kept, source)


def from_episodes(
    episodes: Any,
    *,
    state_of: Callable[[Any], Any] | None = None,
    source: str = "demonstrator",
) -> Demonstrations:
    """Episodes of other libraries: each with one observation more than actions.

    Recognised are objects with ``obs`` and ``acts`` (`imitation`'s trajectories), with
    ``observations`` and ``actions`` (Minari's episodes), mappings with these names, and whole data
    sets that have ``iterate_episodes``. Neither library needs to be installed.

    Args:
        episodes: an iterable of episodes, or a data set.
        state_of: from an episode's observations, n + 1 of them, to the indices of their states;
            without it observations must be such indices.
        source: who says so, a name in ``irl.demonstrations.SOURCES``.

    Returns:
        The runs, numbered from 0, as pairs of the first n observations and the n actions; the last
        observation, where a run ended, is not kept.

    Raises:
        InputError: if an episode is none of these, has another number of observations, or they are
            not indices; names the episode.
    """
    if _field(episodes, _OBSERVATIONS) is not None:
        raise InputError(
            "a list of episodes wanted, got one; if it is a single run, give [episode]",
            place="episodes",
        )
    if hasattr(episodes, "iterate_episodes"):
        episodes = episodes.iterate_episodes()
    runs = []
    for number, episode in enumerate(episodes):
        place = f"episode {number}"
        seen, done = _field(episode, _OBSERVATIONS), _field(episode, _ACTIONS)
        if seen is None or done is None:
            raise InputError(
                f"{type(episode).__name__} has neither obs and acts nor observations and actions",
                place=place,
            )
        state = _states(seen, state_of, f"{place}: observations")
        action = integers(done, f"{place}: actions")
        if state.size != action.size + 1:
            raise InputError(
                f"{state.size} observations and {action.size} actions; one observation more than "
                "actions wanted, the last being where the run ended; for flat arrays see "
                "irl.records.from_arrays",
                place=place,
            )
        runs.append(np.stack([state[:-1], action], axis=1))
    return _numbered(runs, source)


def _states(seen: Any, state_of: Callable[[Any], Any] | None, place: str) -> np.ndarray:
    if state_of is not None:
        return integers(state_of(seen), f"{place}, by state_of")
    try:
        return integers(seen, place)
    except InputError as error:
        raise InputError(
            f"{error.reason}; if they are not indices of states, give state_of, which makes "
            "indices of them",
            place=place,
        ) from None


def _field(thing: Any, names: tuple[str, ...]) -> Any:
    """What an object or a mapping holds under the first of these names; None without any."""
    for name in names:
        if isinstance(thing, Mapping):
            if name in thing:
                return thing[name]
        elif hasattr(thing, name):
            return getattr(thing, name)
    return None


def _numbered(runs: Iterable[np.ndarray], source: str) -> Demonstrations:
    """Runs of pairs, ``[n, 2]`` each, numbered from 0."""
    runs = list(runs)
    length = np.array([len(run) for run in runs], dtype=np.int64)
    pairs = np.concatenate([np.zeros((0, 2), dtype=np.int64), *runs])
    # One run of all, and then its parts: many runs one by one would take minutes.
    whole = Demonstrations.from_pairs(pairs, source=source)
    begins = np.repeat(np.cumsum(length) - length, length)
    return replace(
        whole, trajectory=np.repeat(np.arange(length.size), length), step=whole.step - begins
    )
