"""A policy that plays: paused, corrected, handed back, and asking in doubt."""

from types import SimpleNamespace

import pytest

pytest.importorskip("nicegui")

from experiments.teach.page.playing import DOUBTS, PAUSED, PAUSING, PLAYING, Playing
from experiments.teach.worlds import grid_world
from irl.lesson_events import (
    Answered,
)
from tests.experiments.teach.page.rooms import SIDE, begin, events, right


@pytest.fixture(scope="module")
def world():
    return grid_world(SIDE)


class FakeLink:
    """In place of a process that simulates."""

    pid, starts = 1, 1

    def __init__(self):
        self.told = []

    def tell(self, message):
        self.told.append(message)

    def restart(self):
        self.told.append("restart")


def playing_on(world, path):
    desk = begin(world, path)
    while desk.policy is None:
        desk.answer(desk.question.token, right(world, desk.question))
    playing = Playing(desk, SimpleNamespace(frame=lambda posture: None, caption=""), lambda: None)
    playing._link = FakeLink()
    playing.phase = PLAYING
    return desk, playing


def test_a_playing_policy_is_paused_corrected_and_handed_back(world, tmp_path):
    desk, playing = playing_on(world, tmp_path / "lesson.db")
    told = playing._link.told
    desk.learnt.sure[:] = 1.0
    playing._hear(("decides", 7))
    assert told == [-1]  # by itself
    playing.toggle()
    assert playing.phase == PAUSING
    playing._hear(("decides", 8))
    assert playing.phase == PAUSED
    assert (playing.question.state, told) == (8, [-1])  # it waits
    before = len(events(desk, Answered))
    playing.correct("another token", 0)
    assert told == [-1]
    token = playing.question.token
    playing.correct(token, 1)
    playing.correct(token, 1)
    assert told == [-1, 1]
    playing._hear(("decides", 13))
    playing.correct(playing.question.token, 2)
    playing._hear(("decides", 12))
    playing.toggle()
    assert (playing.phase, told) == (PLAYING, [-1, 1, 2, -1])
    first, second = events(desk, Answered)[before:]
    assert [(a.state, a.action) for a in (first, second)] == [(8, 1), (13, 2)]
    assert second.trajectory == first.trajectory  # one run, corrected twice


def test_a_playing_policy_asks_in_doubt_and_ends(world, tmp_path):
    desk, playing = playing_on(world, tmp_path / "lesson.db")
    desk.learnt.sure[:] = 1.0
    desk.learnt.sure[8] = 0.2
    playing._hear(("decides", 8))
    assert playing.phase == DOUBTS
    playing.correct(playing.question.token, 1)
    assert (playing.phase, playing._link.told) == (PLAYING, [1])  # and goes on
    playing._hear(("over", "goal", True))
    assert not playing.phase
    playing.stop()  # nothing plays any more
    assert "goal" in playing.told
    assert playing._link.told == [1]
    playing.phase = PLAYING
    playing.stop()
    assert playing._link.told[-1] == "restart"
    assert not playing.phase
