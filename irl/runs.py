"""What runs of demonstrations may be.

Of one moment they tell one thing, and of none after their end; in a transition model, their pairs,
moves and ends are possible.
"""

from typing import TYPE_CHECKING

import numpy as np

from irl.errors import InputError
from irl.mdp import TransitionModel

if TYPE_CHECKING:
    from irl.demonstrations import Demonstrations


def check_consistent(shown: "Demonstrations") -> None:
    """Check that no two demonstrated pairs are one moment of a run, and none is after its end.

    Raises:
        InputError: naming the trajectory and step.
    """
    rows = ~shown.generalised
    moments, count = np.unique(
        np.stack([shown.trajectory[rows], shown.step[rows]]), axis=1, return_counts=True
    )
    for trajectory, step in moments[:, count > 1].T[:1]:
        raise InputError(
            f"trajectory {trajectory} has step {step} more than once; give every run a number "
            "of its own and every move its step",
            place="demonstrations",
        )
    runs, count = np.unique(shown.ends[:, 0], return_counts=True)
    for trajectory in runs[count > 1][:1]:
        raise InputError(f"trajectory {trajectory} ends more than once", place="demonstrations")
    if not len(runs):
        return
    said = dict(shown.ends[:, :2].tolist())
    of_ended = np.isin(shown.trajectory, runs)
    pairs = zip(shown.trajectory[of_ended].tolist(), shown.step[of_ended].tolist(), strict=True)
    for trajectory, step in pairs:
        if step >= said[trajectory]:
            raise InputError(
                f"trajectory {trajectory} has step {step}, though it is said to end before "
                f"step {said[trajectory]}",
                place="demonstrations",
            )


def impossible_moves(shown: "Demonstrations", model: TransitionModel) -> np.ndarray:
    """Demonstrated pairs that never lead to the state of the next pair of their run.

    Args:
        shown: every pair must be feasible in ``model``.
        model: the transition model.

    Returns:
        int64 ``[n, 2]``, the rows of the pair and the next, run after run as their steps go.
    """
    rows = shown.in_order
    before, after = rows[:-1], rows[1:]
    follows = shown.trajectory[before] == shown.trajectory[after]
    follows &= shown.step[before] + 1 == shown.step[after]
    moves = np.stack([before[follows], after[follows]], axis=1)
    if not len(moves):
        return moves
    pair = model.pair_index(shown.state[moves[:, 0]], shown.action[moves[:, 0]])
    return moves[np.asarray(model.P[pair, shown.state[moves[:, 1]]]).ravel() <= 0]


def check_possible(shown: "Demonstrations", model: TransitionModel, place: str) -> None:
    """As `Demonstrations.check`, which has arguments and errors."""
    for column, limit in (("state", model.n_states), ("action", model.n_actions)):
        values = getattr(shown, column)
        for row in np.flatnonzero((values < 0) | (values >= limit))[:1]:
            raise InputError(
                f"row {row}, field '{column}' is {values[row]}, must lie in 0…{limit - 1}",
                place=place,
            )
    for row in np.flatnonzero(model.pair_index(shown.state, shown.action) < 0)[:1]:
        state = int(shown.state[row])
        raise InputError(
            f"row {row}, field 'action' is {shown.action[row]}, not feasible in state {state}",
            place=place,
            valid=model.actions_of(state).tolist() or ["none"],
        )
    _check_ends(shown, model, place)
    for b, a in impossible_moves(shown, model)[:1]:
        raise InputError(
            f"trajectory {shown.trajectory[b]}, step {shown.step[b]}: action {shown.action[b]} in "
            f"state {shown.state[b]} never leads to state {shown.state[a]}, where the run goes "
            "on; if runs were joined there, part them: Demonstrations.parted(model)",
            place=place,
        )


def _check_ends(shown: "Demonstrations", model: TransitionModel, place: str) -> None:
    """Check that runs end in states there are, where their last moves may lead."""
    for trajectory, step, state in shown.ends:
        if not 0 <= state < model.n_states:
            raise InputError(
                f"trajectory {trajectory} ends in state {state}, must lie in "
                f"0…{model.n_states - 1}",
                place=place,
            )
        last = (shown.trajectory == trajectory) & (shown.step == step - 1) & ~shown.generalised
        for pair in model.pair_index(shown.state[last], shown.action[last]):
            if model.P[pair, state] == 0:
                raise InputError(
                    f"trajectory {trajectory}, step {step - 1} never leads to state {state}, "
                    "where the run is said to end",
                    place=place,
                )
