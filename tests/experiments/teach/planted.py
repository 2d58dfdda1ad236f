"""Lessons with errors planted in them, and how soon a report's list has them."""

from pathlib import Path

import numpy as np

from experiments.teach.desk import Desk
from experiments.teach.review import at_odds
from experiments.teach.shell.scripted import would_say
from experiments.teach.worlds import World
from irl.lesson import Lesson
from irl.lesson_events import DONE
from irl.lesson_replay import began
from irl.student import StudentConfig


class Nobody:
    """Learns nothing: the desk then asks for one trajectory after the other."""

    lost = False

    def start(self, order):
        pass

    def poll(self):
        return None


def lesson(
    world: World, path: Path, answers: int, share: float, seed: int
) -> tuple[Desk, set[int]]:
    """So many answers of the oracle, a share of the actions wrong; the numbers of those."""
    config = StudentConfig(seed=seed)
    desk = Desk(world, Lesson.begin(path, began(world.subject, config)), Nobody())
    rng, wrong = np.random.default_rng([seed, round(100 * share)]), set()
    # Every run to its end, as a person shows it: the last may lift the number a little.
    while len(desk.taught.answers) < answers or desk.question.step:
        asked = desk.question
        action = would_say(world, asked.state, asked.proposed, rng)
        poor = np.setdiff1d(
            asked.feasible, np.flatnonzero(world.oracle.optimal_actions[asked.state])
        )
        slips = action != DONE and poor.size and rng.random() < share
        given = desk.answer(asked.token, int(rng.choice(poor)) if slips else action)
        if slips:
            wrong.add(given.number)
    return desk, wrong


def found(desk: Desk, wrong: set[int], among: float = 0.4) -> tuple[int, int]:
    """How many of the wrong answers are in the first part of the list, and how many there are."""
    rows = at_odds(desk)
    first = {row["answer"] for row in rows[: round(among * len(rows))]}
    return len(first & wrong), len(wrong)
