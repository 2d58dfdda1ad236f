"""The page, as a person uses it to teach the grid: by the keyboard, in a real browser."""

import json
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("nicegui")

from experiments.teach.worlds import grid_world
from irl.active import ActiveConfig, active_fa_mlirl
from irl.lesson import Lesson
from irl.lesson_events import DONE, Result
from irl.lesson_replay import config_of
from irl.lesson_taught import Taught
from irl.policy import Policy
from irl.session import policy_hash
from irl.teacher import Teacher

ROOT = Path(__file__).resolve().parents[4]

SIDE = 7
GOAL = 24  # the middle of the grid
ARROWS = {"ArrowRight": 0, "ArrowUp": 1, "ArrowLeft": 2, "ArrowDown": 3}


def towards_the_goal(state, favourite=None):
    """A key that leads nearer to the goal, the favourite's if it does; None there."""
    (y, x), (gy, gx) = divmod(state, SIDE), divmod(GOAL, SIDE)
    good = [
        key for key, far in zip(ARROWS, (gx - x, gy - y, x - gx, y - gy), strict=True) if far > 0
    ]
    return next((key for key in good if str(ARROWS[key]) == favourite), good[0] if good else None)


def teach_once(one):
    """Answer one question by the keyboard alone."""
    token = one.asked("token")
    key = towards_the_goal(int(one.asked("state")), one.asked("favourite"))
    one.press(key or "d")
    wanted = str(ARROWS.get(key, -1))
    one.wait_for(
        "([a, t]) => { const q = document.querySelector('[data-teach=question]').dataset;"
        " return q.chosen === a || q.token !== t }",
        wanted,
        token,
    )
    if one.asked("token") == token:  # else the robot went on by itself
        one.press("Enter")
        one.wait_for_another(token)


def teach_a_trajectory(one):
    while int(one.asked("state")) != GOAL:
        teach_once(one)
    teach_once(one)


def wait_for_learning(one, rounds=1):
    one.press("g")
    one.wait_for(
        "([n]) => +(document.querySelector('[data-teach=progress]')?.innerText"
        ".match(/(\\d+) rounds?/)?.[1] ?? 0) >= n",
        rounds,
    )
    one.press("Escape")


def test_the_tutorial_from_the_first_question_until_it_is_enough(teaching, window):
    lesson = teaching("--grid", str(SIDE)).start()
    one = window(lesson.url)
    assert "What should the robot do here?" in one.read("question")
    assert "row" in one.read("words")
    assert one.asked("favourite") is None  # it has learnt nothing yet
    teach_a_trajectory(one)
    wait_for_learning(one)
    one.page.wait_for_selector("[data-teach=next]")
    assert "tells me most for your time" in one.read("next")
    for _ in range(200):
        if "enough, because" in one.read("enough"):
            break
        if one.phase == "acting":
            time.sleep(0.1)
        else:
            teach_once(one)
    assert "I have learnt enough, because" in one.read("enough")
    assert "I have learnt enough" in one.read("learnt")  # over the view, whatever panel is open
    curve = one.page.get_attribute("[data-teach=curve]", "points")
    assert len(curve.split()) > 2
    results = [json.loads(body) for body in lesson.events("result")]
    assert results[-1]["told"]["enough"]
    assert not one.errors
    assert not one.abroad


class AsAtThePage:
    """Shows what was answered at the page, in the same order."""

    def __init__(self, answers):
        self.left = list(answers)

    def trajectory(self, state, rng, max_steps=50):
        answer = self.left.pop(0)
        assert answer.state == state
        return [] if answer.action == DONE else [(state, answer.action)]


def test_the_oracle_at_the_page_gives_the_algorithms_policy_and_the_terminal_replays_it(
    teaching, window
):
    lesson = teaching("--grid", str(SIDE), "--learner", "fa_mlirl", "--synchronous").start()
    one = window(lesson.url)
    one.page.evaluate("window.teach.say({kind: 'alone', on: false})")
    teach_a_trajectory(one)
    for _ in range(3):
        teach_once(one)
    lesson.stop()
    world = grid_world(SIDE)
    with Lesson(lesson.lesson, writable=False) as kept:
        config, taught = config_of(kept, world.subject), Taught.of(kept.events)
        recorded = [each.policy_hash for each in kept.events if isinstance(each, Result)]
    first = taught.run(taught.trajectories[0])
    answers = list(taught.answers.values())
    later = answers[[each.action for each in answers].index(DONE) + 1 :]
    assert len(later) == 3
    settings = ActiveConfig(**config.options, budget=len(later), cluster_query="none")
    result = active_fa_mlirl(
        world.subject.problem,
        first,
        Teacher(AsAtThePage(later)),
        settings,
        rng=np.random.default_rng(config.seed),
    )
    task_hash = world.subject.task_hash
    policy = Policy.from_q(result.q, world.model.mask, task_hash=task_hash)
    assert policy_hash(policy) == recorded[-1]
    command = [sys.executable, "-m", "experiments.teach", "--grid", str(SIDE), "--terminal"]
    told = subprocess.run(
        [*command, "--replay", str(lesson.lesson), "--out", str(lesson.lesson.parent / "again")],
        cwd=ROOT, capture_output=True, text=True, timeout=300, check=True,
    ).stdout  # fmt: skip
    assert f"round {len(recorded) - 1}: {recorded[-1]}" in told


def test_what_was_said_is_taken_back_and_changed(teaching, window):
    lesson = teaching("--grid", str(SIDE)).start()
    one = window(lesson.url)
    first, state = one.asked("token"), one.asked("state")
    teach_once(one)
    one.wait_until_asked()
    second = one.asked("token")
    one.press("u")
    one.wait_for_another(second)
    assert one.asked("state") == state  # asked again
    assert one.asked("token") != first
    teach_once(one)
    one.press("h", "Enter")  # the first button there: change the last answer
    one.page.wait_for_selector("[data-edit]")
    number = int(one.page.get_attribute("[data-edit]", "data-edit"))
    one.page.select_option("[data-edit]", "-1")
    one.wait_for("() => !document.querySelector('[data-edit]')")
    for _ in range(100):
        if lesson.events("edit"):
            break
        time.sleep(0.05)
    assert json.loads(lesson.events("edit")[0]) == {"of": number, "changes": {"action": -1}}
    assert len(lesson.events("undo")) == 1
    assert not one.errors


def test_advice_is_changed_from_the_list_and_what_contradicts_it_is_shown_by_the_keyboard(
    teaching, window
):
    lesson = teaching("--grid", str(SIDE)).start()
    one = window(lesson.url)
    world, state = grid_world(SIDE), int(one.asked("state"))
    name = next(each for each, states in world.clusters.items() if state in states)
    token, shown = one.asked("token"), int(world.model.actions_of(state)[0])
    one.press(list(ARROWS)[shown], "Enter")
    one.wait_for_another(token)
    one.wait_until_asked()
    one.press("a")
    one.page.focus(f"[data-cluster={name}]")
    one.press("Enter")
    one.page.wait_for_selector(f"[data-advise='{shown}']")
    one.page.focus(f"[data-advise='{shown}']")
    one.press("Enter", "Enter")  # avoid
    one.page.wait_for_selector("[data-teach=against]")
    assert one.read("against").startswith("1 of your answers")
    number = one.page.get_attribute("[data-teach=advice] [data-change]", "data-change")
    one.page.focus("[data-do=advise]")
    one.press("Enter")
    one.page.wait_for_selector("[data-teach=note]")
    assert "1 of your answers says otherwise" in one.read("note")

    one.page.focus("[data-teach=advice] [data-change]")  # the answer is changed where it is shown
    one.press("Enter")
    one.page.wait_for_selector(f"[data-teach=advice] [data-edit='{number}']")
    one.page.select_option(f"[data-edit='{number}']", "-1")
    one.wait_for("() => !document.querySelector('[data-teach=against]')")
    edit = {"of": int(number), "changes": {"action": -1}}
    assert [json.loads(each) for each in lesson.events("edit")] == [edit]

    one.press("Escape", "h")  # and the advice from the list
    one.page.focus("[data-advice]")
    one.press("Enter")
    one.page.wait_for_selector(f"[data-advise='{shown}'].avoid")
    one.page.focus(f"[data-advise='{shown}']")
    one.press("Enter")  # neither
    one.page.wait_for_selector(f"[data-advise='{shown}'][title=neither]")
    one.page.focus("[data-do=advise]")
    one.press("Enter")
    one.press("Escape", "h")
    one.wait_for(
        "() => document.querySelector('[data-teach=said]')?.innerText.includes('no advice')"
    )
    changes = {"preferred": [], "avoided": []}
    assert json.loads(lesson.events("edit")[-1])["changes"] == changes
    assert len(lesson.events("advised")) == 1
    assert not one.errors


def test_a_slip_is_listed_as_at_odds_and_changed_from_there_by_the_keyboard(teaching, window):
    lesson = teaching("--grid", str(SIDE), "--initial", "12").start()
    one = window(lesson.url)
    one.page.evaluate("window.teach.say({kind: 'alone', on: false})")
    one.wait_for(  # what it learns while the question stands there is preselected
        "() => { const q = document.querySelector('[data-teach=question]').dataset;"
        " return q.favourite !== undefined && q.chosen === q.favourite }"
    )
    while int(one.asked("state")) == GOAL:
        teach_once(one)
    state = int(one.asked("state"))
    away = next(
        key
        for key, back in zip(ARROWS, ("Left", "Down", "Right", "Up"), strict=True)
        if towards_the_goal(state) == f"Arrow{back}"
    )
    if one.page.locator(f"[data-a='{ARROWS[away]}'][aria-disabled=true]").count():
        away = next(key for key in ARROWS if key not in (away, towards_the_goal(state)))
    token = one.asked("token")
    one.press(away, "Enter")
    one.wait_for_another(token)
    one.press("h")
    one.page.wait_for_selector(".line.odd [data-change]")
    number = int(one.page.get_attribute(".line.odd [data-change]", "data-change"))
    said = json.loads(lesson.events("answered")[-1])
    assert (said["state"], said["action"]) == (state, ARROWS[away])
    one.page.focus(".line.odd [data-change]")
    one.press("Enter")
    one.page.wait_for_selector(".line.odd [data-edit]")
    wanted = str(ARROWS[towards_the_goal(state)])
    one.page.select_option(".line.odd [data-edit]", wanted)
    one.wait_for("() => !document.querySelector('.line.odd')")
    edit = {"of": number, "changes": {"action": int(wanted)}}
    assert json.loads(lesson.events("edit")[0]) == edit
    one.page.focus("[data-do=odd]")
    one.press("Enter")
    one.wait_for(
        "() => document.querySelector('[data-teach=odd]').innerText.includes('agree with one')"
    )
    assert not one.errors


def test_a_reload_a_second_window_and_a_lost_connection_lose_nothing(teaching, window):
    lesson = teaching("--grid", str(SIDE)).start()
    one = window(lesson.url)
    teach_once(one)
    one.page.reload()  # while it learns
    one.page.wait_for_selector("[data-token]")
    token = one.asked("token")
    two = window(lesson.url)
    assert two.asked("token") == token
    one.page.wait_for_function("window.did_handshake")
    one.wait_until_asked()
    teach_once(one)
    two.wait_for_another(token)
    two.wait_until_asked()
    assert two.asked("token") == one.asked("token")

    one.page.evaluate("window.socket.disconnect()")
    said = len(lesson.events("answered"))
    key = towards_the_goal(int(one.asked("state"))) or "d"
    one.press(key, "Enter", "Enter")  # into the void
    time.sleep(5)
    assert len(lesson.events("answered")) == said
    token = one.asked("token")
    one.page.evaluate("window.socket.connect()")
    one.wait_for_another(token)
    assert len(lesson.events("answered")) == said + 1
    assert not two.errors


def test_markup_is_text_and_motions_have_keys(teaching, window):
    lesson = teaching("--grid", str(SIDE)).start()
    one = window(lesson.url)
    one.page.evaluate("window.teach.say({kind: 'group', names: ['<img src=x onerror=alert(1)>']})")
    one.page.wait_for_selector("[data-teach=note]")
    assert "<img" in one.read("note")  # told as it was said
    assert one.page.locator("[data-teach=note] img").count() == 0
    key = towards_the_goal(int(one.asked("state"))) or "ArrowUp"
    mark = "document.querySelector('[data-teach=mark]').style.transform"
    before = one.page.evaluate(mark)
    one.press(key, "Space")
    one.wait_for(f"([was]) => {mark} !== was", before)
    token = one.asked("token")
    one.press("n")
    one.wait_for_another(token)
    token = one.asked("token")
    one.press("s")
    one.wait_for_another(token)
    assert len(lesson.events("skipped")) == 1
    assert not lesson.events("answered")
