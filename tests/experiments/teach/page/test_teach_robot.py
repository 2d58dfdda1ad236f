"""The page, as a person uses it to teach the robot: the 3D view, previews, advice, corrections."""

import json
import os
import time
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("nicegui")

from experiments.kit.shipped_data import SHIPPED_TASK
from irl.task_data import load_task

PICTURES = os.environ.get("TEACH_PICTURES", "")
"""A folder that screenshots are kept in."""


def keep(one, name):
    if PICTURES:
        one.page.screenshot(path=str(Path(PICTURES) / f"{name}.png"))


@pytest.fixture(scope="module")
def task():
    return load_task(SHIPPED_TASK)


@pytest.fixture(scope="module")
def robot(tmp_path_factory, start_teaching):
    """One server for the tests that do not mind one another."""
    lesson = start_teaching(tmp_path_factory.mktemp("robot"))
    yield lesson
    lesson.stop()


def wait_for_a_policy(one):
    one.press("g")
    one.wait_for(
        "() => +(document.querySelector('[data-teach=progress]')?.innerText"
        ".match(/(\\d+) rounds?/)?.[1] ?? 0) >= 1"
    )
    one.press("Escape", "f", "Escape")


def test_a_question_is_read_previewed_and_answered_from_within_the_3d_view(robot, window, task):
    lesson = robot
    one = window(lesson.url)
    state = int(one.asked("state"))
    assert state in task.start_states
    assert one.read("words").startswith("on the table")
    refused = one.page.locator(".option[aria-disabled=true]")
    feasible = {int(a) for a in np.flatnonzero(task.model.mask[state])}
    shown = one.page.locator(".option[data-a]")
    assert shown.count() == task.model.n_actions + 1  # and that there is nothing to do
    assert shown.count() - refused.count() == len(feasible) + 1
    one.page.evaluate("document.querySelector(\"[data-a='54']\").click()")
    assert "the hand is empty" in one.read("choice")

    frame = one.page.frame_locator("iframe")
    frame.locator("canvas").first.wait_for()
    time.sleep(1.0)
    keep(one, "question")
    frame.locator("canvas").first.click(position={"x": 200, "y": 300})
    assert one.page.evaluate("document.activeElement.tagName") == "IFRAME"
    one.press("ArrowRight")
    one.wait_for(
        "() => document.querySelector('[data-teach=question]').dataset.chosen !== undefined"
    )
    chosen = int(one.asked("chosen"))
    assert chosen in feasible
    one.press("Space")
    one.wait_for("() => document.querySelector('.caption')?.innerText.startsWith('grasp')")
    token = one.asked("token")
    one.press("Enter")
    one.wait_for_another(token)
    answered = json.loads(lesson.events("answered")[0])
    assert (answered["state"], answered["action"], answered["previews"]) == (state, chosen, 1)
    assert one.read("words").startswith("held")
    one.wait_until_asked()
    keep(one, "held")
    assert not one.errors
    assert not one.abroad  # no request leaves the machine


def test_advice_is_given_about_an_intersection_by_the_keyboard(robot, window, task):
    lesson = robot
    one = window(lesson.url)
    one.press("a")
    for name in ("grasped", "gripper_down", "under_limit"):
        one.page.focus(f"[data-cluster={name}]")
        one.press("Space")
        one.wait_for(
            "([n]) => document.querySelector(`[data-cluster=${n}]`).ariaPressed === 'true'", name
        )
    clusters = task.clusters
    members = (
        set(clusters["gripper_down"]) & set(clusters["under_limit"]) & set(clusters["grasped"])
    )
    one.wait_for(
        "([n]) => document.querySelector('[data-teach=count]')?.innerText === n",
        f"{len(members):,}",
    )
    assert 0 < one.page.locator("[data-teach=advice] svg").count() <= 6
    one.page.focus("[data-advise='54']")
    one.press("Enter")  # prefer
    one.page.focus("[data-advise='36']")
    one.press("Enter", "Enter")  # avoid
    one.wait_for("() => document.querySelector(\"[data-advise='36']\").title === 'avoid'")
    keep(one, "advice")
    one.page.focus("[data-do=advise]")
    one.press("Enter")
    one.page.wait_for_selector("[data-teach=note]")
    assert f"{len(members):,} states" in one.read("note")
    said = json.loads(lesson.events("advised")[0])
    assert set(said["cluster"].split(" ∩ ")) == {"grasped", "gripper_down", "under_limit"}
    assert (said["preferred"], said["avoided"]) == ([54], [36])
    assert not one.errors


@pytest.mark.parametrize("scale", [1.0, 1.5])
def test_everything_is_within_reach_and_maps_say_where_the_robot_is(robot, window, scale):
    one = window(robot.url, scale=scale)
    one.page.frame_locator("iframe").locator("canvas").first.wait_for()
    time.sleep(1.0)
    keep(one, "zoomed" if scale > 1 else "whole")
    wide, high = one.page.viewport_size["width"], one.page.viewport_size["height"]
    for part in ("answer", "preview", "undo", "skip", "another"):
        box = one.page.locator(f"[data-do={part}]").bounding_box()
        assert box["x"] >= 0
        assert box["x"] + box["width"] <= wide
        assert box["y"] + box["height"] <= high
    maps = one.page.locator(".board .map")
    assert maps.count() == 2
    for k in range(2):
        first = maps.nth(k).locator(".edge").first
        assert first.is_visible()
        assert first.inner_text() == "robot"
        above, cell = first.bounding_box(), maps.nth(k).locator(".option").first.bounding_box()
        assert above["y"] + above["height"] <= cell["y"]  # who stands at the back
    one.press("c")
    for each in one.page.locator(".pane.keys > div").all():
        box = each.bounding_box()
        assert box["x"] + box["width"] <= wide


@pytest.mark.soak
def test_a_playing_policy_is_paused_corrected_and_handed_back(teaching, window, task):
    lesson = teaching("--initial", "3", "--learner", "planning").start()
    one = window(lesson.url)
    one.page.set_default_timeout(300_000)
    wait_for_a_policy(one)
    one.page.wait_for_selector("[data-do=play]")
    one.press("p")
    phase = "document.querySelector('[data-phase]').dataset.phase"
    one.wait_for(f"() => {phase} === 'playing'")
    one.press("p")
    one.wait_for(f"() => {phase} === 'paused'")
    keep(one, "paused")
    state = int(one.asked("state"))
    action = int(np.flatnonzero(task.model.mask[state])[-1])
    one.choose(action)
    one.press("Enter")
    one.wait_for(f"() => {phase} === 'paused' && document.querySelector('[data-teach=question]')"
                 f".dataset.state !== '{state}'")  # fmt: skip
    corrected = json.loads(lesson.events("answered")[0])
    assert (corrected["state"], corrected["action"]) == (state, action)
    one.press("p")
    one.wait_for(f"() => {phase} === 'playing'")
    one.press("Escape")
    one.wait_until_asked()
    assert not one.errors
