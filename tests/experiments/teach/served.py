"""A desk behind a pipe, to be killed: ``python -m tests.experiments.teach.served LESSON``.

It says its question as a line, ``TOKEN STATE``, and takes an answer as one, ``TOKEN ACTION``; what
it says then is whether the answer counted, and the next question. The process that does so, whose
number is the first line, is another one each time that one was killed; what is imported by then
takes no time again.
"""

import contextlib
import os
import sys
from pathlib import Path

import torch

from experiments.teach.desk import Desk
from experiments.teach.rounds import LocalLearner
from experiments.teach.worlds import grid_world
from irl.lesson import Lesson
from irl.lesson_replay import began
from irl.student import Student, StudentConfig

WORLD, CONFIG = grid_world(7), StudentConfig("behaviour_cloning")


def serve(path: Path) -> None:
    """Lead the lesson until the input ends, or forever dead."""
    torch.set_num_threads(1)
    if not path.exists():
        Lesson.begin(path, began(WORLD.subject, CONFIG)).close()
    with Lesson(path) as lesson:
        desk = Desk(WORLD, lesson, LocalLearner(Student(WORLD.subject, CONFIG, lesson.initial)))
        print(os.getpid(), flush=True)
        print(desk.question.token, desk.question.state, flush=True)
        for line in sys.stdin:
            token, action = line.split()
            counted = desk.answer(token, int(action)).accepted
            print("counted" if counted else "nothing", flush=True)
            print(desk.question.token, desk.question.state, flush=True)


def main(path: Path) -> None:
    """Start a process that serves, and another one if it was killed."""
    while True:
        child = os.fork()
        if not child:
            serve(path)
            os._exit(0)
        if os.WIFEXITED(os.waitpid(child, 0)[1]):
            return
        # What it had not read yet is lost, as with a connection.
        os.set_blocking(0, False)
        with contextlib.suppress(BlockingIOError):
            os.read(0, 1 << 16)
        os.set_blocking(0, True)
        print("killed", flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
