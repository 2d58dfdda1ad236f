"""Killed between an answer and the next question: nothing is lost, nothing counts twice."""

import os
import signal
import sqlite3
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("nicegui")

ROOT = Path(__file__).resolve().parents[4]
KEYS = ("ArrowRight", "ArrowUp", "ArrowLeft", "ArrowDown", "d")


def under(lesson, token):
    """How many answers, or actions of the robot's own, came under a question's token."""
    with closing(sqlite3.connect(f"file:{lesson.lesson}?mode=ro", uri=True)) as database:
        return database.execute(
            "select count(*) from event where token = ? and kind in ('answered', 'acted')",
            (token,),
        ).fetchone()[0]


def enter(one, rng):
    """Choose something that can be done, and press Enter; the question's token."""
    one.wait_until_asked()
    while True:
        token = one.asked("token")
        one.press(KEYS[int(rng.integers(len(KEYS)))])
        if one.asked("chosen") is not None and one.asked("token") == token:
            one.press("Enter")
            return token


def kill_the_server(lesson, one, times):
    rng = np.random.default_rng(times)
    tokens = []
    for _ in range(times):
        tokens.append(enter(one, rng))
        time.sleep(float(rng.uniform(0.0, 0.08)))
        lesson.kill()
        lesson.start()
        one.wait_for_another(tokens[-1])
        one.page.wait_for_function("window.did_handshake")
    assert [under(lesson, token) for token in tokens] == [1] * times


def kill_the_learner(lesson, one, times):
    rng = np.random.default_rng(times)
    tokens, killed = [], set()
    for _ in range(times):
        tokens.append(enter(one, rng))
        pid = another(lesson.learner, killed)
        subprocess.run(["kill", "-KILL", str(pid)], check=True)
        killed.add(pid)
        one.wait_for_another(tokens[-1])
    assert [under(lesson, token) for token in tokens] == [1] * times
    wait_for_a_round(lesson, len(lesson.events("result")))


def another(learner, killed):
    """The process that learns, once it is none of those that were killed."""
    for _ in range(600):
        pid = learner()
        if pid not in killed:
            return pid
        time.sleep(0.05)
    raise AssertionError("nobody learns any more")


def wait_for_a_round(lesson, before):
    for _ in range(1200):
        if len(lesson.events("result")) > before:
            return
        time.sleep(0.1)
    raise AssertionError("nothing is learnt any more")


def answer_while_the_learner_is_stuck(lesson, one, times):
    rng, learner = np.random.default_rng(times), lesson.learner()
    os.kill(learner, signal.SIGSTOP)
    try:
        tokens = []
        for _ in range(times):
            tokens.append(enter(one, rng))
            one.wait_for_another(tokens[-1])
        before = len(lesson.events("result"))
    finally:
        os.kill(learner, signal.SIGCONT)
    assert [under(lesson, token) for token in tokens] == [1] * times
    wait_for_a_round(lesson, before)


def test_kills_lose_no_answer_and_double_none_and_a_stuck_learner_holds_up_nothing(
    teaching, window
):
    lesson = teaching("--grid", "7").start()
    one = window(lesson.url)
    kill_the_server(lesson, one, 2)
    kill_the_learner(lesson, one, 1)
    answer_while_the_learner_is_stuck(lesson, one, 3)


@pytest.mark.soak
def test_fifty_kills_of_the_server(teaching, window):
    lesson = teaching("--grid", "7").start()
    one = window(lesson.url)
    one.page.set_default_timeout(120_000)
    kill_the_server(lesson, one, 50)


@pytest.mark.soak
def test_twenty_kills_of_the_learner(teaching, window):
    lesson = teaching("--grid", "7").start()
    one = window(lesson.url)
    one.page.set_default_timeout(120_000)
    kill_the_learner(lesson, one, 20)


def test_a_lesson_that_cannot_be_read_is_refused_by_name_and_left_as_it_is(tmp_path):
    path = tmp_path / "lesson.db"
    path.write_bytes(b"no lesson at all" * 100)
    command = [sys.executable, "-m", "experiments.teach", "--grid", "7", "--no-browser"]
    done = subprocess.run(
        [*command, "--port", "0", "--out", str(tmp_path)],
        cwd=ROOT, capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip
    assert done.returncode == 2
    assert str(path) in done.stderr
    assert path.read_bytes() == b"no lesson at all" * 100
