"""How long a teacher waits: bounds for an idle machine, scaled by how loaded this one is."""

import time

import numpy as np
import pytest

pytest.importorskip("nicegui")

from tests.experiments.teach.page.waiting import CLOCK, enter, load

ENTER_P95, SPACE_P95, CTRL_C = 0.300, 0.250, 2.0


def test_the_next_question_is_there_at_once(teaching, window):
    lesson = teaching("--grid", "25").start()
    one = window(lesson.url)
    one.page.evaluate("window.teach.say({kind: 'alone', on: false})")
    waits, factors = [], [load()]
    for k in range(21):
        one.press("ArrowRight" if k % 2 else "ArrowUp")
        if one.asked("chosen") is None:
            one.press("ArrowLeft" if k % 2 else "ArrowDown")
        waits.append(enter(one))
        factors.append(load())
        time.sleep(0.1)
    told = f"{np.median(waits):.3f} s in the median, p95 {np.quantile(waits, 0.95):.3f} s"
    print(
        f"Enter → next question: {told}; load {np.median(factors):.1f}, at most {max(factors):.1f}"
    )
    assert np.quantile(waits[1:], 0.95) <= ENTER_P95 * max(factors)


def test_a_motion_begins_at_once_and_ctrl_c_ends_all_at_once(teaching, window):
    lesson = teaching().start()
    one = window(lesson.url)
    one.page.frame_locator("iframe").locator("canvas").first.wait_for()
    one.press("ArrowRight")
    moving = "document.querySelector('[data-phase]').dataset.phase === 'moving'"
    one.page.evaluate(CLOCK, [" ", moving])  # the planner compiles at first
    waits, factors = [], [load()]
    for k in range(20):
        one.wait_until_asked()
        one.press("ArrowRight" if k % 12 < 6 else "ArrowLeft")  # along the hands from above
        waits.append(one.page.evaluate(CLOCK, [" ", moving]) / 1e3)
        one.page.evaluate("window.teach.say({kind: 'stop'})")
        factors.append(load())
    told = f"{np.median(waits):.3f} s in the median, p95 {np.quantile(waits, 0.95):.3f} s"
    print(f"Space → motion: {told}; load at most {max(factors):.1f}")
    assert np.quantile(waits, 0.95) <= SPACE_P95 * max(factors)
    one.wait_until_asked()
    token = one.asked("token")
    one.press("Enter")  # a lesson with an answer has a report
    one.wait_for_another(token)
    began = time.monotonic()
    lesson.stop()
    ended = time.monotonic() - began
    print(f"Ctrl-C → the end: {ended:.1f} s")
    assert ended <= CTRL_C * max(factors)
    assert "1 answers in 1 trajectories" in lesson.log
