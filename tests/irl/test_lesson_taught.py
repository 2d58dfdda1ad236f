"""What a lesson's events come to: undo at any depth, edits in place, runs, ends and gaps."""

import numpy as np
import pytest

from irl.errors import InputError
from irl.lesson_events import (
    DONE,
    Advised,
    Answered,
    Asked,
    Edit,
    Excluded,
    Imported,
    Outcome,
    Skipped,
    Undo,
)
from irl.lesson_standing import last_said, stands
from irl.lesson_taught import Taught


def answer(state, action, step=0, trajectory=5, purpose="learn"):
    return Answered(state, action, trajectory, step, purpose=purpose)


RUN = [answer(1, 10), answer(2, 20, 1), answer(3, 30, 2), answer(4, DONE, 3)]


def random_lesson(rng: np.random.Generator, n: int) -> list:
    """Events of every kind that changes what holds, as a person might make them."""
    events = []
    while len(events) < n:
        kind, last = rng.integers(8), last_said(events)
        if kind < 3:
            events.append(answer(int(rng.integers(50)), int(rng.integers(4)), len(events)))
        elif kind == 3:
            events.append(Advised("all", "", [int(rng.integers(4))], []))
        elif kind == 4:
            events.append(Skipped(int(rng.integers(50))))
        elif kind == 5 and last is not None:
            events.append(Undo(last))
        elif kind == 6:
            said = [n for n, e in stands(events).items() if isinstance(e, Answered)]
            if said:
                events.append(Edit(int(rng.choice(said)), {"action": int(rng.integers(4))}))
        else:
            events.append(Outcome(1, 2))
    return events


def by_hand(events) -> dict:
    """The same by another way: a stack of what was said, each undo takes its top."""
    stack = []
    for number, event in enumerate(events, start=1):
        if isinstance(event, Undo):
            assert stack.pop()[0] == event.of
        elif isinstance(event, Answered | Advised | Skipped | Edit):
            stack.append((number, event))
    holds = {n: e for n, e in stack if not isinstance(e, Edit)}
    for _, edit in stack:
        if isinstance(edit, Edit) and edit.of in holds:
            values = vars(holds[edit.of]) | edit.changes
            holds[edit.of] = type(holds[edit.of])(**values)
    return holds


@pytest.mark.parametrize("seed", range(20))
def test_what_holds_is_what_a_stack_of_what_was_said_holds(seed):
    events = random_lesson(np.random.default_rng(seed), 80)
    assert stands(events) == by_hand(events)
    bit_by_bit = Taught()
    for k in range(0, 80, 7):
        bit_by_bit.add(events[k : k + 7])
    whole = Taught.of(events)
    assert bit_by_bit.answers == whole.answers and bit_by_bit.advised == whole.advised
    assert bit_by_bit.skipped == whole.skipped
    for run in whole.trajectories:
        assert bit_by_bit.run(run).pairs == whole.run(run).pairs


def test_undo_goes_back_to_the_beginning():
    events = [*RUN, Advised("all", "", [1], [])]
    while (last := last_said(events)) is not None:
        events.append(Undo(last))
    taught = Taught.of(events)
    assert not taught.answers and not taught.advised and not taught.runs()


def test_a_run_has_its_steps_and_its_end():
    run = Taught.of(RUN).run(5)
    assert run.pairs == [(1, 10), (2, 20), (3, 30)]
    assert run.step.tolist() == [0, 1, 2] and run.ends.tolist() == [[5, 3, 4]]


def test_after_an_edited_answer_a_run_has_a_gap_since_nobody_knows_what_came_of_it():
    run = Taught.of([*RUN, Edit(2, {"action": 21})]).run(5)
    assert run.pairs == [(1, 10), (2, 21), (3, 30)]
    assert run.step.tolist() == [0, 1, 3] and run.ends.tolist() == [[5, 4, 4]]
    back = Taught.of([*RUN, Edit(2, {"action": 21}), Undo(5)]).run(5)
    assert back.step.tolist() == [0, 1, 2]


def test_what_was_shown_after_what_became_an_end_is_a_run_of_its_own():
    taught = Taught.of([*RUN, Edit(2, {"action": DONE})])
    run = taught.run(5)
    assert run.pairs == [(1, 10), (3, 30)]
    assert run.trajectory[0] != run.trajectory[1]
    assert {(int(t), int(s)) for t, _, s in run.ends} == {
        (5, 2),
        (int(run.trajectory[1]), 4),
    }


def test_what_an_answer_taken_back_led_to_is_refused_no_more():
    said = [answer(1, 2), Excluded(1, [[7, 2]])]
    assert Taught.of(said).excluded == {(7, 2)}
    assert Taught.of([*said, Undo(1)]).excluded == set()


def test_answers_for_a_test_or_held_out_are_not_among_the_runs():
    events = [
        answer(1, 2, trajectory=0),
        answer(3, 4, trajectory=1, purpose="audit"),
        answer(5, 6, trajectory=2, purpose="held_out"),
    ]
    taught = Taught.of(events)
    assert [run.pairs for run in taught.runs()] == [[(1, 2)]]
    assert sorted(taught.demonstrations().pairs) == [(1, 2), (3, 4), (5, 6)]


def test_what_came_from_a_file_is_taken_back_like_anything_else():
    event = Imported("d.csv", [[0, 0, 1, 2, "human"]], [[0, 1, 3]], [["all", "", [1], [2]]], [])
    taught = Taught.of([event])
    assert taught.runs()[0].pairs == [(1, 2)] and taught.advised[0].avoided == [2]
    back = Taught.of([event, Undo(1)])
    assert not back.runs() and not back.advised


@pytest.mark.parametrize(
    "wrong",
    [
        Undo(0),
        Undo(9),
        Undo(1),
        Edit(1, {"action": 1}),
        Edit(2, {"state": 1}),
        Edit(9, {"action": 1}),
    ],
)
def test_nobody_undoes_or_edits_what_nobody_said(wrong):
    asked = Asked(3, "start", 0.0, -1, 1, 0, None, "learn", "t0")
    with pytest.raises(InputError):
        Taught.of([asked, answer(1, 2), wrong])
