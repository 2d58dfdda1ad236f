"""Killed between an answer and the next question: no answer is lost, and none counts twice."""

import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from irl.lesson import Lesson
from irl.lesson_events import DONE, Answered, Asked
from irl.lesson_replay import replay
from tests.experiments.teach.served import WORLD

GOAL = int(WORLD.goal_states[0])


def served(path) -> subprocess.Popen:
    return subprocess.Popen(
        [sys.executable, "-m", "tests.experiments.teach.served", str(path)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env=os.environ | {"OMP_NUM_THREADS": "1"},
    )


def started(child: subprocess.Popen) -> int:
    """The number of the process that serves now."""
    return int(child.stdout.readline())


def asked(child: subprocess.Popen) -> tuple[str, int]:
    token, state = child.stdout.readline().split()
    return token, int(state)


def say(child: subprocess.Popen, token: str, state: int) -> None:
    best = WORLD.oracle.optimal_actions[state]
    action = DONE if state == GOAL else int(np.flatnonzero(best)[0])
    child.stdin.write(f"{token} {action}\n")
    child.stdin.flush()


@pytest.mark.parametrize("kills", [4, pytest.param(50, marks=pytest.mark.soak)])
def test_no_answer_is_lost_and_none_counts_twice(tmp_path, kills):
    path, rng = tmp_path / "lesson.db", np.random.default_rng(kills)
    sent: dict[str, int] = {}  # the state of every question that was answered, by its token
    counted: set[str] = set()  # those of which the desk said so
    child = served(path)
    serving = started(child)
    for _ in range(kills):
        token, state = asked(child)
        for _ in range(int(rng.integers(3))):
            say(child, token, state)
            sent[token] = state
            assert child.stdout.readline() == "counted\n"
            counted.add(token)
            token, state = asked(child)
        say(child, token, state)  # Enter, and before the next question:
        sent[token] = state
        time.sleep(float(rng.choice([0.0, 0.001, 0.005, 0.02, 0.1])))
        os.kill(serving, signal.SIGKILL)
        while (line := child.stdout.readline()) != "killed\n":
            if line == "counted\n":
                counted.add(token)
        serving = started(child)
        # Whoever was not told that it counted sends it again, to whoever answers now.
        open_ = asked(child)
        say(child, token, state)
        told = child.stdout.readline()
        assert told == ("counted\n" if open_[0] == token else "nothing\n")
        counted.add(token)
    child.stdin.close()
    child.stdout.read()
    assert child.wait(60) == 0
    with Lesson(path) as lesson:
        answers = [event for event in lesson.events if isinstance(event, Answered)]
        tokens = [e.token for e in lesson.events if isinstance(e, Asked) and lesson.used(e.token)]
        assert counted == set(sent) == set(tokens) and len(answers) == len(tokens)
        assert [sent[token] for token in tokens] == [answer.state for answer in answers]
        assert replay(lesson, WORLD.subject).same
