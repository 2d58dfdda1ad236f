"""Collecting demonstrations: sets to learn from, and one to be judged by (§5.10, §6.3)."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from itertools import count as numbers
from itertools import islice

import numpy as np

from irl.choices import check_range
from irl.demonstrations import Demonstrations
from irl.demonstrators import Demonstrator, OracleDemonstrator
from irl.errors import InputError
from irl.rule_trust import AT_THE_END, ON_THE_WAY, Trust, rule_trust
from irl.teacher import Teacher

# Collecting gives up after this many trajectories in a row that brought nothing new.
_PATIENCE = 1000
_ROUND = 20  # runs before the rules are first judged; a third more before each further time


def demonstrate(
    demonstrator: Demonstrator,
    starts: Iterable[int],
    rng: np.random.Generator,
    max_steps: int = 50,
) -> Demonstrations:
    """One trajectory from each start, conflicts included.

    Args:
        demonstrator: who demonstrates.
        starts: state indices, each taken when the trajectory before it has ended, so that they may
            be drawn on the way.
        rng: draws the demonstrator's choices.
        max_steps: length at which a trajectory is broken off.
    """
    return Demonstrations.from_trajectories(
        demonstrator.trajectory(int(start), rng, max_steps) for start in starts
    )


def mislabel(
    demonstrations: Demonstrations, wrong: np.ndarray, share: float, rng: np.random.Generator
) -> Demonstrations:
    """Replace a share of the labels by wrong actions, drawn evenly.

    A wrong action leads elsewhere than the run goes on, so each wrong label is a run of its own,
    numbered after all others; where it stood its run is parted by the gap.

    Args:
        demonstrations: labelled pairs; they stay as they are.
        wrong: the wrong actions of every state, bool ``[n_states, n_actions]``, such as the
            feasible ones that are not optimal. Labels of states without any are left alone, and
            don't count.
        share: of the labels that can be wrong, in 0…1, rounded to a whole number of them.
        rng: draws the labels and their new actions.

    Raises:
        InputError: if ``share`` is out of range.
    """
    check_range("share of wrong labels", share, 0, 1)
    choices = wrong[demonstrations.state]
    fallible = np.flatnonzero(choices.any(axis=1))
    action = demonstrations.action.copy()
    for k in rng.choice(fallible, round(share * fallible.size), replace=False):
        action[k] = rng.choice(np.flatnonzero(choices[k]))
    trajectory, step = demonstrations.trajectory.copy(), demonstrations.step.copy()
    changed = np.flatnonzero(action != demonstrations.action)
    trajectory[changed] = trajectory.max(initial=-1) + 1 + np.arange(changed.size)
    step[changed] = 0
    # Their runs still end where they did, but for those that lose all they had.
    left = np.isin(demonstrations.ends[:, 0], np.setdiff1d(demonstrations.trajectory, trajectory))
    ends = demonstrations.ends[~left]
    return replace(demonstrations, trajectory=trajectory, step=step, action=action, ends=ends)


def demonstrate_to_the_end(
    oracle: OracleDemonstrator,
    starts: Iterable[int],
    rng: np.random.Generator,
    max_steps: int = 50,
) -> Demonstrations:
    """One trajectory from each start, and where it ended, if it did within ``max_steps``.

    From a state where there is nothing to do, the run is its end alone.

    Args:
        oracle: who demonstrates.
        starts: state indices, each taken when the trajectory before it has ended.
        rng: draws the demonstrator's choices, and what comes of them.
        max_steps: length at which a trajectory is broken off, without an end.
    """
    runs: list[list[tuple[int, int]]] = []
    ends: list[int | None] = []
    for start in starts:
        run: list[tuple[int, int]] = []
        state = int(start)
        while not oracle.terminal[state] and len(run) < max_steps:
            run.append((state, oracle.label(state, rng)))
            state = oracle.model.sample(*run[-1], rng)
        runs.append(run)
        ends.append(state if oracle.terminal[state] else None)
    return Demonstrations.from_trajectories(runs, ends)


def _collect(
    demonstrator: Demonstrator,
    starts: np.ndarray,
    count: int,
    prepare: Callable[[Demonstrations], Demonstrations],
    rng: np.random.Generator,
    max_steps: int,
) -> Demonstrations:
    """Gather prepared trajectories from random starts until ``count`` states have a label."""
    gathered = Demonstrations.empty()
    labelled = trajectory = fruitless = 0
    while labelled < count:
        before = labelled
        pairs = demonstrator.trajectory(int(rng.choice(starts)), rng, max_steps)
        prepared = prepare(Demonstrations.from_pairs(pairs, trajectory))
        gathered = Demonstrations.concatenate([gathered, prepared])
        labelled = gathered.n_states_demonstrated
        trajectory += 1
        fruitless = 0 if labelled > before else fruitless + 1
        if fruitless == _PATIENCE:
            raise InputError(
                f"demonstrations: {count} states wanted, but trajectories from the given starts "
                f"reach only {labelled}"
            )
    return gathered


def initial_demonstrations(
    teacher: Teacher,
    starts: np.ndarray,
    count: int,
    rng: np.random.Generator,
    max_steps: int = 50,
) -> Demonstrations:
    """Demonstrate from random starts, generalising, until ``count`` states have a label (§6.3).

    All labels of a state are kept, however often it was shown. The last trajectory may bring too
    many states: the surplus is dropped from the end, generalised ones first.

    Args:
        teacher: who demonstrates, and what follows from it.
        starts: indices of the states a trajectory may start in.
        count: number of distinct states wanted.
        rng: draws the starts, and the demonstrator's choices.
        max_steps: length at which a trajectory is broken off.

    Raises:
        InputError: if trajectories stop bringing new states before ``count`` is reached.
    """
    gathered = _collect(teacher.demonstrator, starts, count, teacher.generalise, rng, max_steps)
    return _of_first_states(gathered, count)


def runs_from(
    oracle: OracleDemonstrator, starts: np.ndarray, rng: np.random.Generator, max_steps: int = 50
) -> Iterator[Demonstrations]:
    """Runs from starts drawn evenly, each with where it ended, one after the other, without end."""
    for number in numbers():
        run = demonstrate_to_the_end(oracle, [int(rng.choice(starts))], rng, max_steps)
        yield replace(
            run, trajectory=run.trajectory + number, ends=run.ends + np.array([number, 0, 0])
        )


def recorded_runs(recording: Demonstrations, rng: np.random.Generator) -> Iterator[Demonstrations]:
    """Each run of a recording once, in random order."""
    for number in rng.permutation(np.unique(recording.trajectory)):
        yield recording.select(recording.trajectory == number)


def by_trusted_rules(
    teacher: Teacher, runs: Iterator[Demonstrations], count: int, least: float
) -> tuple[Demonstrations, Teacher, dict[str, dict[str, Trust]]]:
    """Runs and what follows from them by rules that they themselves bear out.

    Runs are taken until ``count`` states have a label or there are no more; ever so often every
    rule is judged anew, and applied to all runs or to none. Surplus is dropped as by
    ``initial_demonstrations``.

    Args:
        teacher: has the rules that may be used.
        runs: what is shown.
        count: number of distinct states wanted.
        least: share of a rule's labels that must be right; 0 trusts every rule.

    Returns:
        The labels, a teacher who generalises alike, and the trust in each rule.

    Raises:
        InputError: if runs stop bringing new states before ``count`` is reached.
    """
    g = teacher.generalisation
    names = [g.rule_names[k] for k in g.rule_indices(teacher.rules)]
    taken: list[Demonstrations] = []
    labelled = fruitless = 0
    while True:
        size = max(_ROUND, len(taken) // 3)
        more = list(islice(runs, size))
        taken += more
        shown = Demonstrations.concatenate(taken)
        trust = rule_trust(shown, g, names)
        way, end = (
            [name for name in names if trust[name][kind].share >= least]
            for kind in (ON_THE_WAY, AT_THE_END)
        )
        trusting = replace(teacher, rules=way, rules_at_end=end)
        labels = trusting.generalise(shown)
        before, labelled = labelled, labels.n_states_demonstrated
        fruitless = 0 if labelled > before else fruitless + size
        if labelled >= count or len(more) < size:
            return _of_first_states(labels, count), trusting, trust
        if fruitless >= _PATIENCE:
            raise InputError(
                f"demonstrations: {count} states wanted, but trajectories from the given starts "
                f"reach only {labelled}"
            )


def _of_first_states(gathered: Demonstrations, count: int) -> Demonstrations:
    """All labels of the first ``count`` states, those shown before others."""
    return gathered.select(np.isin(gathered.state, gathered.states_by_rank[:count]))


def held_out(
    demonstrator: Demonstrator,
    exclude: np.ndarray,
    starts: np.ndarray,
    rng: np.random.Generator,
    n: int = 100,
    max_steps: int = 50,
) -> Demonstrations:
    """A validation set: ``n`` distinct states on fresh trajectories, none in ``exclude`` (§6.3).

    Each has one label, of those it got the most frequent.

    Args:
        demonstrator: who demonstrates; one without label noise, unless noise is to be scored.
        exclude: indices of the states of the training set.
        starts: indices of the states a trajectory may start in.
        rng: draws the starts, and the demonstrator's choices.
        n: number of states wanted.
        max_steps: length at which a trajectory is broken off.

    Raises:
        InputError: if trajectories stop bringing new states before ``n`` is reached.
    """
    gathered = _collect(
        demonstrator,
        starts,
        n,
        lambda new: new.select(~np.isin(new.state, exclude)),
        rng,
        max_steps,
    )
    return _of_first_states(gathered, n).resolved()
