"""A grid that is taught in a room, without a browser; needs nicegui."""

import numpy as np

from experiments.teach.desk import Desk, DeskConfig
from experiments.teach.page.board import Board, grid_reasons
from experiments.teach.page.motions import GridMotions
from experiments.teach.page.room import Room
from experiments.teach.rounds import LocalLearner
from experiments.teach.students import student_config
from irl.lesson import Lesson
from irl.lesson_replay import began
from irl.student import Student

SIDE, GOAL = 5, 12


def begin(world, path, learner="goal_posterior", *, synchronous=False):
    config = student_config(learner, 0, grid=True)
    lesson = Lesson.begin(path, began(world.subject, config))
    student = Student(world.subject, config, lesson.initial)
    return Desk(world, lesson, LocalLearner(student), DeskConfig(synchronous))


def enter(desk):
    motions = GridMotions(desk.world, lambda: None)
    return Room(desk, Board(desk.world, grid_reasons), motions)


def right(world, question):
    """What the oracle would do, the favourite if that is as good."""
    if question.state == GOAL:
        return -1
    good = np.flatnonzero(world.oracle.optimal_actions[question.state]).tolist()
    return question.proposed if question.proposed in good else good[0]


def events(desk, kind):
    return [event for event in desk.lesson.events if isinstance(event, kind)]


async def say(room, token, **message):
    reply = room.hear({"id": f"m{token}", **message})
    for _ in range(2):  # until it begins, and until it is over
        await room.motions.wait()
    return reply
