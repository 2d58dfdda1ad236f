"""Lessons and files, and two teachers' lessons: nothing lost, nothing doubled, nothing decided."""

import json
from dataclasses import replace

import numpy as np
import pytest

from irl.demonstrations import Demonstrations
from irl.domains.gridworld import GridWorld
from irl.errors import InputError
from irl.lesson import Lesson
from irl.lesson_events import (
    DONE,
    Advised,
    Answered,
    Began,
    Excluded,
    Imported,
    Undo,
    hash_of_states,
)
from irl.lesson_exchange import (
    demonstrations_of,
    next_trajectory,
    read_advice,
    read_demonstrations,
    save_advice,
)
from irl.lesson_merge import merge
from irl.lesson_taught import Taught

WORLD = GridWorld(5, (2, 2))
X, Y = WORLD.cells.T
CLUSTERS = {"left": np.flatnonzero(X < 2), "low": np.flatnonzero(Y < 2)}
BEGAN = Began("a" * 64, {}, {}, [[0, 0, 6, 0, "demonstrator"]], [])
RUN = [Answered(5, 0, 1, 0), Answered(6, 0, 1, 1), Answered(7, 1, 1, 2), Answered(12, DONE, 1, 3)]
RIGHT, UP, LEFT, DOWN = range(4)


@pytest.fixture
def lesson(tmp_path):
    made = []

    def make(name: str, *events, began: Began = BEGAN) -> Lesson:
        made.append(Lesson.begin(tmp_path / f"{name}.db", began))
        for event in events:
            made[-1].append(event)
        return made[-1]

    yield make
    for each in made:
        each.close()


def test_demonstrations_go_out_and_come_into_another_lesson(lesson, tmp_path):
    out = lesson("a", *RUN, Answered(8, 2, 2, 0, purpose="audit"))
    demonstrations_of(out).save(tmp_path / "d.csv")
    back = lesson("b", *RUN, began=replace(BEGAN, initial=[]))
    event = read_demonstrations(tmp_path / "d.csv", WORLD.model, back)
    assert min(row[0] for row in [*event.rows, *event.ends]) == next_trajectory(back) == 2
    back.append(event)
    shown = demonstrations_of(back)
    assert sorted(shown.pairs) == sorted([*demonstrations_of(out).pairs, (5, 0), (6, 0), (7, 1)])
    shown.check(WORLD.model)


def test_what_cannot_be_done_does_not_come_in(lesson, tmp_path):
    here = lesson("a")
    Demonstrations.from_pairs([(0, LEFT)]).save(tmp_path / "wall.csv")
    Demonstrations.empty().save(tmp_path / "none.csv")
    for name in ("wall.csv", "none.csv", "missing.csv"):
        with pytest.raises(InputError, match=name):
            read_demonstrations(tmp_path / name, WORLD.model, here)


def test_advice_goes_out_and_comes_in(lesson, tmp_path):
    states = hash_of_states(np.intersect1d(*CLUSTERS.values()))
    out = lesson(
        "a", Advised("left ∩ low", states, [1], [2]), Advised("left", "", [], [3]), Undo(3)
    )
    save_advice(out, tmp_path / "advice.json")
    event = read_advice(tmp_path / "advice.json", "a" * 64, CLUSTERS, 4)
    assert event.advice == [["left ∩ low", states, [1], [2]]]
    assert Taught.of([event]).advised == [Advised("left ∩ low", states, [1], [2])]


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"schema_version": 2}, "schema_version"),
        ({"task_hash": "b" * 64}, "another task"),
        ({"advice": 3}, "must be a list"),
        ({"advice": [{"cluster": "left"}]}, "advice 0"),
        ({"advice": [{"cluster": "no"}]}, "unknown name 'no'"),
        ({"advice": [{"preferred": [4]}]}, "0…3"),
        ({"advice": [{"preferred": [2]}]}, "both preferred and avoided"),
        ({"advice": [{"states_hash": "c" * 64}]}, "other states"),
        ({"more": 1}, "wanted"),
    ],
)
def test_wrong_advice_is_refused_by_field(tmp_path, change, told):
    piece = {"cluster": "left", "preferred": [1], "avoided": [2], "states_hash": ""}
    whole = {"schema_version": 1, "task_hash": "a" * 64, "advice": [piece]}
    if isinstance(change.get("advice"), list):
        only = change["advice"][0]
        incomplete = only == {"cluster": "left"}
        change = {"advice": [only if incomplete else piece | only]}
    path = tmp_path / "advice.json"
    path.write_text(json.dumps(whole | change))
    with pytest.raises(InputError, match=told) as refused:
        read_advice(path, "a" * 64, CLUSTERS, 4)
    assert refused.value.place.startswith(str(path))


def test_two_lessons_become_one_with_all_that_both_said(lesson):
    here = lesson("a", *RUN)
    there = lesson("b", Answered(20, 3, 1, 0), Answered(21, 3, 2, 0, purpose="audit"),
                   Answered(22, 3, 3, 0, purpose="held_out"), Advised("low", "", [0], []),
                   Excluded(2, [[3, 0]]))  # fmt: skip
    merged = merge(here, there, CLUSTERS)
    assert not merged.conflicts
    here.append(merged.events)
    taught = Taught.of(here.events)
    pairs = Demonstrations.concatenate(taught.runs()).pairs
    assert sorted(pairs) == [
        (5, 0),
        (6, 0),
        (7, 1),
        (20, 3),
        (21, 3),
    ]  # not (22, 3), not twice (6, 0)
    assert taught.advised[0].preferred == [0] and taught.excluded == {(3, 0)}
    with pytest.raises(InputError, match="taken into this lesson before"):
        merge(here, there, CLUSTERS)
    here.append(Undo(len(here.events)))
    assert (
        Taught.of(here.events).answers.keys() == {2, 3, 4, 5} and not Taught.of(here.events).imports
    )
    merge(here, there, CLUSTERS)  # which was taken back, and may come again


def test_what_both_begin_with_alike_comes_once(lesson):
    here, there = lesson("a", *RUN), lesson("b", *RUN, Answered(20, 3, 2, 0))
    event = merge(here, there, CLUSTERS).events[-1]
    assert isinstance(event, Imported)
    assert [row[2:4] for row in event.rows] == [[20, 3]] and not event.ends


def test_answers_that_contradict_are_listed_and_both_count(lesson):
    here = lesson("a", Answered(7, 1, 1, 0), Answered(12, DONE, 2, 0), Answered(8, 1, 3, 0))
    there = lesson("b", Answered(7, 2, 1, 0), Answered(12, 0, 2, 0), Answered(8, 1, 3, 0),
                   Answered(8, 2, 4, 0), Answered(6, 1, 5, 0))  # fmt: skip
    merged = merge(here, there, CLUSTERS)
    told = [(c.kind, c.about, c.here, c.there) for c in merged.conflicts]
    assert told == [
        ("answer", "state 6", (0,), (1,)),  # the first demonstration says otherwise
        ("answer", "state 7", (1,), (2,)),
        ("answer", "state 12", (DONE,), (0,)),
    ]
    here.append(merged.events)
    said = Demonstrations.concatenate(Taught.of(here.events).runs()).counted
    assert {(7, 1), (7, 2)} <= set(zip(said.state.tolist(), said.action.tolist(), strict=True))


def test_advice_that_contradicts_is_set_aside_on_both_sides(lesson):
    here = lesson("a", Advised("left", "", [0, 1], [2]), Advised("low", "", [3], []))
    there = lesson("b", Advised("low", "", [2], [0]), Answered(20, 2, 1, 0))
    merged = merge(here, there, CLUSTERS)
    assert [(c.kind, c.about, c.here, c.there) for c in merged.conflicts] == [
        ("advice", "left here, low there", (0,), (2,)),
        # The first demonstration, and an answer there, do what the other avoids.
        ("advice against answer", "state 6, of low there", (), (0,)),
        ("advice against answer", "state 20, of left here", (2,), ()),
    ]
    here.append(merged.events)
    advised = Taught.of(here.events).advised
    assert [(a.cluster, a.preferred, a.avoided) for a in advised] == [
        ("left", [1], []),
        ("low", [3], []),
        ("low", [], []),
    ]
    for _ in merged.events:  # and may be taken back, one by one
        here.append(Undo(len(here.events) if isinstance(here.events[-1], Imported) else 4))
    assert [a.preferred for a in Taught.of(here.events).advised] == [[0, 1], [3]]


def test_a_lesson_about_another_task_is_not_taken_in(lesson):
    here, there = lesson("a"), lesson("b", began=replace(BEGAN, task_hash="b" * 64))
    with pytest.raises(InputError, match=r"b\.db: is about the task"):
        merge(here, there, CLUSTERS)
