"""Long lessons of the robot through the page: until it is enough; a thousand answers."""

import json
import time
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("nicegui")

from experiments.kit.shipped_data import SHIPPED_TASK
from experiments.teach.shell.scripted import SECONDS
from experiments.teach.worlds import robot_world
from irl.policy import load_policy
from tests.experiments.teach.page.film import Film
from tests.experiments.teach.page.waiting import enter, load, right

pytestmark = pytest.mark.soak

TEN_MINUTES = 600.0
ENTER, ENTER_P99 = 0.150, 0.300
MOST_MEMORY, LARGEST = 600e6, 5e6
FILMED = 10
"""Of so many answers at first a moving picture is made, and of so many moments on its own."""


@pytest.fixture(scope="module")
def world():
    return robot_world(SHIPPED_TASK)


def memory(pid):
    """Resident memory of a process, at most so far [bytes]."""
    (line,) = [x for x in Path(f"/proc/{pid}/status").read_text().splitlines() if "VmHWM" in x]
    return 1024 * int(line.split()[1])


def test_ten_minutes_through_the_page_are_enough_and_it_says_so(teaching, window, world):
    """The teacher takes 2 s an answer, and no longer than that; the learner what it takes.

    So a loaded machine learns in fewer rounds than an idle one; the time counted is the teacher's,
    2 s an answer, and that in which the robot goes on by itself.
    """
    lesson = teaching().start()
    one = window(lesson.url)
    one.page.frame_locator("iframe").locator("canvas").first.wait_for()
    film = Film(one)
    film.take(2.5)
    rng, counted, answers, alone = np.random.default_rng(5), 0.0, 0, 0
    while counted < TEN_MINUTES and "I have learnt enough, because" not in told(one):
        began = time.monotonic()
        if one.phase in ("asking", "moving"):
            one.choose(right(world, one, rng))
            if answers < FILMED:
                film.take(0.8)
            enter(one)
            for _ in range(4 if answers < FILMED else 0):
                film.take(0.3)
            answers += 1
            if answers == FILMED + 3:
                film.advice()
            time.sleep(max(0.0, SECONDS - (time.monotonic() - began)))
            counted += SECONDS
        else:
            if alone < FILMED:
                alone += 1
                film.take(0.4)
            time.sleep(0.1)
            counted += 0.1
    film.take(4.0)
    assert "I have learnt enough, because" in told(one)
    lesson.stop()
    success = world.success(load_policy(lesson.lesson.with_name("policy.safetensors")).action)
    print(f"enough after {answers} answers, {counted:.0f} s; success {success:.4f}")
    assert success >= 0.99
    assert json.loads(lesson.events("result")[-1])["told"]["enough"]
    assert not one.errors


def told(one):
    """What stands under Progress, which stays open."""
    if not one.page.locator("[data-teach=enough]").count():
        one.press("g", "Escape")
        one.page.wait_for_selector("[data-teach=enough]")
    return one.read("enough")


def test_after_a_thousand_answers_it_is_as_quick_and_small(teaching, window, world):
    lesson = teaching("--learner", "goal_posterior").start()
    one = window(lesson.url)
    one.page.frame_locator("iframe").locator("canvas").first.wait_for()
    one.page.evaluate(  # nobody looks at a thousand motions, and to draw them takes an hour
        "document.querySelector('iframe').contentWindow.viewer.render = () => {}"
    )
    one.page.evaluate("window.teach.say({kind: 'alone', on: false})")
    rng, waits, factors = np.random.default_rng(0), [], [load()]
    for number in range(1000):
        one.choose(right(world, one, rng))
        waits.append(enter(one))
        if number % 50 == 49:
            factors.append(load())
            print(number + 1, f"answers, {memory(lesson.process.pid) / 1e6:.0f} MB", flush=True)
    print(
        f"Enter → next question: {np.median(waits):.3f} s in the median, p99 "
        f"{np.quantile(waits, 0.99):.3f} s; load {np.median(factors):.1f}, at most "
        f"{max(factors):.1f}; memory {memory(lesson.process.pid) / 1e6:.0f} MB; "
        f"file {lesson.lesson.stat().st_size / 1e6:.2f} MB; {len(lesson.events('round'))} rounds"
    )
    assert len(lesson.events("answered")) == 1000
    assert np.median(waits) <= ENTER * np.median(factors)
    assert np.quantile(waits, 0.99) <= ENTER_P99 * max(factors)
    assert memory(lesson.process.pid) < MOST_MEMORY
    lesson.stop()
    assert lesson.lesson.stat().st_size < LARGEST
    assert not one.errors
    assert not one.reloads
