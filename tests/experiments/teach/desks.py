"""A small world that is taught at a desk, and who teaches there."""

import numpy as np

from experiments.teach.desk import Desk
from experiments.teach.rounds import LocalLearner
from experiments.teach.worlds import grid_world
from irl.lesson_events import DONE
from irl.student import StudentConfig

WORLD = grid_world(7)
GOAL = int(WORLD.goal_states[0])
SHORT = {
    "initial": {"iterations": 60, "step": 0.01, "beta": 70.0},
    "refine": {"iterations": 20, "step": 0.01, "beta": 70.0},
    "hidden": [16],
    "state_query": "visitation_entropy",
}
CLONING, GOALS = StudentConfig("behaviour_cloning"), StudentConfig()
NETWORK = StudentConfig("fa_mlirl", seed=3, options=SHORT)


def best(state: int) -> int:
    return DONE if state == GOAL else int(np.flatnonzero(WORLD.oracle.optimal_actions[state])[0])


class Lost(LocalLearner):
    """A learner that is started anew when told so."""

    def start(self, order):
        self.lost = False
        super().start(order)


def teach(desk: Desk, answers: int) -> None:
    for _ in range(answers):
        asked = desk.question
        good = WORLD.oracle.optimal_actions[asked.state]
        proposed = asked.proposed
        lets_pass = proposed not in (None, DONE) and good[proposed]
        assert desk.answer(asked.token, proposed if lets_pass else best(asked.state)).accepted
