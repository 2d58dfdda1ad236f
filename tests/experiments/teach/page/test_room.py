"""One lesson for all windows, without a browser: what they say, and what comes of it."""

import asyncio
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("nicegui")

from diagrams.state_view import Posture, Preview
from experiments.kit.shipped_data import SHIPPED_TASK
from experiments.teach.desk import Desk
from experiments.teach.page.board import Board, RobotReasons
from experiments.teach.page.motions import RobotMotions
from experiments.teach.page.room import Room
from experiments.teach.students import student_config
from experiments.teach.worlds import grid_world, robot_world
from irl.lesson import Lesson
from irl.lesson_events import (
    Acted,
    Advised,
    Answered,
    Excluded,
    Imported,
    Result,
    Undo,
    hash_of_states,
)
from irl.lesson_replay import began, replay
from models.scenes.planning_scene import HOME
from tests.experiments.teach.page.rooms import GOAL, SIDE, begin, enter, events, right, say


@pytest.fixture(scope="module")
def world():
    return grid_world(SIDE)


def test_a_synchronous_page_learns_what_the_desk_learns_and_the_replay(world, tmp_path):
    async def by_the_page():
        desk = begin(world, tmp_path / "page.db", synchronous=True)
        room = enter(desk)
        for number in range(14):
            asked = desk.question
            await say(room, number, kind="answer", question=asked.token, action=right(world, asked))
        return desk

    desk = begin(world, tmp_path / "desk.db", synchronous=True)
    for _ in range(14):
        desk.answer(desk.question.token, right(world, desk.question))
    page = asyncio.run(by_the_page())
    hashes = [[event.policy_hash for event in events(each, Result)] for each in (page, desk)]
    assert hashes[0] == hashes[1]
    assert len(hashes[0]) > 5
    assert replay(page.lesson, world.subject).policy_hash == hashes[0][-1]


def test_a_message_counts_once_and_nonsense_not_at_all(world, tmp_path):
    async def lead():
        desk = begin(world, tmp_path / "lesson.db")
        room = enter(desk)
        asked = desk.question
        answer = {"kind": "answer", "question": asked.token, "action": right(world, asked)}
        answer["seconds"] = "nan"
        for _ in range(3):
            await say(room, 1, **answer)
        await say(room, 2, **answer)  # in other clothes
        assert events(desk, Answered)[0].seconds == 0.0
        assert len(events(desk, Answered)) == 1
        before = len(desk.lesson.events)
        for number, message in enumerate(
            (
                {"kind": "answer", "question": desk.question.token, "action": "up"},
                {"kind": "answer", "question": desk.question.token, "action": 99},
                {"kind": "answer", "question": desk.question.token},
                {"kind": "exclude", "number": 1, "pairs": [[1]]},
                {"kind": "advise", "cluster": "../../etc/passwd", "preferred": [], "avoided": []},
                {"kind": "group", "names": ["<b>"]},
                {"kind": "__class__"},
                {"kind": "hear"},
                {},
            )
        ):
            assert await say(room, f"x{number}", **message) == {}
        assert room.hear({"kind": "undo"}) == {}  # without a token of its own
        assert len(desk.lesson.events) == before
        await say(room, 3, kind="undo")
        assert len(events(desk, Undo)) == 1

    asyncio.run(lead())


def test_advice_counts_the_answers_that_say_otherwise(world, tmp_path):
    async def lead():
        desk = begin(world, tmp_path / "lesson.db")
        room = enter(desk)
        asked = desk.question
        action = right(world, asked)
        await say(room, 1, kind="answer", question=asked.token, action=action)
        name = next(n for n, states in world.clusters.items() if asked.state in states)
        group = (await say(room, 2, kind="group", names=[name]))["group"]
        assert group["count"] == len(world.clusters[name])
        shown = {each["a"]: each["shown"] for each in group["actions"]}
        assert shown[action] == 1
        assert sum(shown.values()) == 1
        (pictured,) = (each["answers"] for each in group["actions"] if each["a"] == action)
        (row,) = pictured
        assert desk.taught.answers[row["number"]].state == asked.state
        assert row["where"] == world.say_state(asked.state)
        await say(room, 3, kind="advise", cluster=name, preferred=[], avoided=[action])
        assert "1 of your answers" in room.snapshot()["state"]["note"]
        assert events(desk, Advised)[0].avoided == [action]
        # What was said of a group last holds, down to nothing at all; undone, what was before.
        first, *_ = (e for e in room.snapshot()["panels"]["said"] if e["what"].startswith("avoid"))
        await say(room, 4, kind="advise", cluster=name, preferred=[], avoided=[])
        assert not any(piece.avoided for piece in desk.taught.advised)
        assert "avoid" not in str([e["what"] for e in room.snapshot()["panels"]["said"]])
        group = (await say(room, 5, kind="group", names=[name]))["group"]
        assert group["avoided"] == []
        await say(room, 6, kind="undo")
        assert [piece.avoided for piece in desk.taught.advised] == [[action]]
        assert first in room.snapshot()["panels"]["said"]

    asyncio.run(lead())


def test_advice_is_changed_however_its_group_is_called_and_also_what_came_from_a_file(
    world, tmp_path
):
    async def lead():
        desk = begin(world, tmp_path / "lesson.db")
        room = enter(desk)
        states = desk.members("left ∩ below")
        piece = ["left ∩ below", hash_of_states(states), [0, 1], []]
        desk.take([Imported("theirs.json", [], [], [piece], [])])

        def advice():
            rows = room.snapshot()["panels"]["said"]
            return [(each["what"], each["names"]) for each in rows if "names" in each]

        assert advice() == [("prefer right, up", ["left", "below"])]
        names = ["below", "left"]
        group = (await say(room, 1, kind="group", names=names))["group"]
        assert (group["preferred"], group["avoided"]) == ([0, 1], [])
        given = {"kind": "advise", "cluster": group["expression"]}
        await say(room, 2, **given, preferred=[0], avoided=[2])
        assert advice() == [("prefer right; avoid left", ["left", "below"])]
        assert [(p.preferred, p.avoided) for p in desk.taught.advised] == [([0], [2])]
        await say(room, 3, **given, preferred=[], avoided=[])
        assert not any(each.preferred + each.avoided for each in desk.taught.advised)
        await say(room, 4, kind="undo")
        assert advice() == [("prefer right; avoid left", ["left", "below"])]
        await say(room, 5, kind="advise", cluster="above", preferred=[3], avoided=[])
        assert len(desk.taught.advised) == 2  # of other states

    asyncio.run(lead())


def test_what_cannot_be_changed_is_taken_back_from_the_list(world, tmp_path):
    async def lead():
        desk = begin(world, tmp_path / "lesson.db")
        room = enter(desk)
        aside = desk.question.state
        await say(room, 1, kind="skip", question=desk.question.token)
        asked = desk.question
        await say(room, 2, kind="answer", question=asked.token, action=right(world, asked))
        assert aside in desk.taught.skipped
        (row,) = (each for each in room.snapshot()["panels"]["said"] if each.get("back"))
        await say(room, 3, kind="undo", number=row["number"])
        assert not desk.taught.skipped
        assert len(desk.taught.answers) == 1
        assert not any(each.get("back") for each in room.snapshot()["panels"]["said"])
        await say(room, 4, kind="undo", number=row["number"])
        assert f"nothing said under {row['number']}" in room.note

    asyncio.run(lead())


def test_answers_are_held_out_from_when_the_teacher_says_so(world, tmp_path):
    async def lead():
        config = student_config("goal_posterior", 0, grid=True)
        lesson = Lesson.begin(tmp_path / "lesson.db", began(world.subject, config))
        desk = Desk(world, lesson, NoLearner())
        room = enter(desk)
        for number in range(14):
            asked = desk.question
            await say(room, number, kind="answer", question=asked.token, action=right(world, asked))
            if number == 11:
                assert not any(each.purpose == "held_out" for each in events(desk, Answered))
                await say(room, "on", kind="hold_out", on=True)
                assert room.snapshot()["state"]["holdsOut"]
        assert any(each.purpose == "held_out" for each in events(desk, Answered))

    asyncio.run(lead())


def test_it_says_that_it_learns_only_once_a_first_trajectory_has_ended(world, tmp_path):
    async def lead():
        desk = begin(world, tmp_path / "lesson.db")
        room = enter(desk)
        told = []
        while desk.policy is None:
            asked = desk.question
            action = right(world, asked)
            await say(room, len(told), kind="answer", question=asked.token, action=action)
            told.append((action, room.given["waits"]))
        assert len(told) > 1
        assert [waits for _, waits in told] == [action != -1 for action, _ in told]

    asyncio.run(lead())


def test_the_robot_acts_alone_while_it_is_sure_and_asks_in_doubt(world, tmp_path):
    async def lead():
        desk = begin(world, tmp_path / "lesson.db")
        room = enter(desk)
        for number in range(25):
            asked = desk.question
            await say(room, number, kind="answer", question=asked.token, action=right(world, asked))
            for _ in range(200):
                if room.snapshot()["state"]["phase"] == "asking":
                    break
                await asyncio.sleep(0.02)
        acted = events(desk, Acted)
        assert acted
        good = world.oracle.optimal_actions
        assert np.mean([good[each.state, each.action] for each in acted]) > 0.9
        assert GOAL not in [each.state for each in acted]  # it stops there
        asked = [each["asked"] for each in room.snapshot()["progress"]["episodes"]]
        assert asked[-1] < asked[0]

    asyncio.run(lead())


class FakeViewer:
    """Another viewer, in the place of Meshcat."""

    def __init__(self):
        self.shown = []

    def show(self, state):
        self.shown.append(state)

    def preview(self, state, action):
        return Preview(
            state, action, ((state, 0.6), (state + 1, 0.4)), (Posture(HOME, 0.08, None),)
        )

    def pose(self, posture):
        self.shown.append(posture)

    def ghosts(self, states):
        self.shown.append(list(states))


class NoLearner:
    """Learns nothing, and takes its time."""

    lost = False

    def start(self, order):
        pass

    def poll(self):
        return None


def test_what_rules_would_label_too_is_shown_in_pictures_and_can_be_refused(tmp_path):
    world = robot_world(SHIPPED_TASK)
    rules = tuple(world.subject.generalisation.rule_names)
    config = replace(student_config("goal_posterior", 0), rules=rules)

    async def lead():
        lesson = Lesson.begin(tmp_path / "lesson.db", began(world.subject, config))
        desk, viewer = Desk(world, lesson, NoLearner()), FakeViewer()
        room = Room(desk, Board(world, RobotReasons()), RobotMotions(viewer, world))
        asked = desk.question
        action = int(asked.feasible[0])  # a grasp, which is as good at other places
        await say(room, 1, kind="answer", question=asked.token, action=action)
        assert [asked.state, asked.state + 1] in viewer.shown  # ghosts of what may come of it
        lower, upper = (np.ravel(group["rows"]) for group in room.board.groups(0, set())[:2])
        assert [each["here"] for each in lower] == [k == 0 for k in range(9)]  # where the cube lies
        assert not any(each["here"] for each in upper)
        given = room.snapshot()["panels"]["given"]
        assert given["count"] > len(given["follows"]) > 0
        assert len(given["follows"]) <= 6
        pair = given["follows"][0]["pair"]
        assert pair[1] == action
        assert pair[0] != asked.state
        assert given["follows"][0]["picture"].startswith("<svg")
        await say(room, 2, kind="exclude", number=given["number"], pairs=[pair])
        assert [event.pairs for event in events(desk, Excluded)] == [[pair]]
        lesson.close()

    asyncio.run(lead())


def test_what_a_planner_does_otherwise_for_an_answer_is_pictured_and_may_be_picked(world, tmp_path):
    async def lead():
        desk = begin(world, tmp_path / "lesson.db")
        room = enter(desk)
        firsts, pictured = [], []
        for number in range(12):
            asked, before = desk.question, desk.policy
            await say(room, number, kind="answer", question=asked.token, action=right(world, asked))
            room.tick()
            given = room.snapshot()["panels"]["given"]
            assert not given["rules"] and not given["follows"]
            if before is None and desk.policy is not None:
                firsts.append(given["learnt"])
            elif before is not None and before is not desk.policy:
                assert len(given["changed"]) <= 6
                differs = (desk.policy.action != before.action).any()
                assert ("something else in" if differs else "as before") in given["learnt"]
                for each in given["changed"]:
                    state, action = each["pair"]
                    assert desk.policy.action[state] == action != before.action[state]
                pictured += given["changed"]
        assert firsts == ["Now I have a first idea of what you want."]
        state = pictured[-1]["pair"][0]
        await say(room, "picked", kind="ask", state=state)
        assert (desk.question.state, desk.question.strategy) == (state, "picked")
        lesson_before = len(desk.lesson.events)
        await say(room, "none", kind="ask", state=9999)
        assert len(desk.lesson.events) == lesson_before

    asyncio.run(lead())


def test_answers_that_disagree_with_the_rest_are_listed_and_changed_from_there(world, tmp_path):
    async def lead():
        desk = begin(world, tmp_path / "lesson.db")
        room = enter(desk)
        await say(room, "first", kind="odd")
        assert room.snapshot()["panels"]["odd"]["rows"] == []
        for number in range(25):
            asked = desk.question
            await say(room, number, kind="answer", question=asked.token, action=right(world, asked))
            room.acting.end()
        await say(room, "picked", kind="ask", state=GOAL + 1)
        asked = desk.question
        good = world.oracle.optimal_actions[asked.state]
        slip = next(a for a in asked.feasible if not good[a])
        await say(room, "slip", kind="answer", question=asked.token, action=int(slip))
        await say(room, "look", kind="odd")
        room.tick()
        report = room.snapshot()["panels"]["report"]
        assert any("answers in" in line for line in report)
        told = room.snapshot()["panels"]["odd"]
        (row, *_) = told["rows"]
        number = max(n for n, each in desk.taught.answers.items() if each.state == asked.state)
        assert (row["number"], row["action"]) == (number, slip)
        rather = [world.say_action(int(a)) for a in np.flatnonzero(good)]
        assert row["rather"] in rather
        assert not told["old"]
        instead = int(np.flatnonzero(good)[0])
        await say(room, "edit", kind="edit", number=number, action=instead)
        told = room.snapshot()["panels"]["odd"]
        assert number not in [each["number"] for each in told["rows"]]
        assert told["old"]
        await say(room, "again", kind="odd")
        room.tick()
        told = room.snapshot()["panels"]["odd"]
        assert number not in [each["number"] for each in told["rows"]]
        assert not told["old"]

    asyncio.run(lead())


def test_the_page_says_what_tells_most_and_advice_keeps_the_seconds_that_it_took(world, tmp_path):
    async def teach():
        desk = begin(world, tmp_path / "next.db")
        room = enter(desk)
        assert room.snapshot()["state"]["next"] is None
        for number in range(30):
            if desk.suggestion is not None:
                break
            asked = desk.question
            await say(room, number, kind="answer", question=asked.token, action=right(world, asked))
        assert room.snapshot()["state"]["next"]["words"] == desk.suggestion.words != ""
        # The learner asks, and whoever wants something else gets it.
        await say(room, "other", kind="suggested")
        assert desk.question.strategy in ("picked", "run")
        assert desk.suggestion.kind != "trajectory" or desk.question.strategy == "run"
        assert room.snapshot()["state"]["leads"]
        await say(room, "led", kind="lead", on=False)
        assert not room.snapshot()["state"]["leads"]
        one, other, *_ = world.clusters
        told = {"kind": "advise", "preferred": [], "avoided": []}
        await say(room, "timed", **told, cluster=one, seconds=7.5)
        await say(room, "untimed", **told, cluster=other, seconds=-1.0)
        assert [each.seconds for each in events(desk, Advised)] == [7.5, 0.0]

    asyncio.run(teach())
