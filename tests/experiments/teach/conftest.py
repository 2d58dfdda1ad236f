"""A desk that is opened as often as a test likes, on one lesson."""

import pytest

from experiments.teach.desk import Desk, DeskConfig
from irl.lesson import Lesson
from irl.lesson_replay import began
from irl.student import Student
from tests.experiments.teach.desks import CLONING, WORLD, Lost


@pytest.fixture
def desk(tmp_path):
    opened = []

    def open_desk(config=CLONING, initial=None, **how) -> Desk:
        path = tmp_path / "lesson.db"
        for lesson in opened:
            lesson.close()
        if path.exists():
            lesson = Lesson(path)
        else:
            lesson = Lesson.begin(path, began(WORLD.subject, config, initial))
        opened.append(lesson)
        learner = Lost(Student(WORLD.subject, config, lesson.initial))
        return Desk(WORLD, lesson, learner, DeskConfig(**how))

    yield open_desk
    for lesson in opened:
        lesson.close()
