"""Runs of Algorithm 4.1 on a small grid, for the tests of `irl.active`."""

from dataclasses import dataclass, replace

import numpy as np
import torch

from irl.active import ActiveConfig, active_fa_mlirl
from irl.demonstrations import Demonstrations
from irl.domains.gridworld import DOWN, LEFT, RIGHT, UP, GridWorld
from irl.experts import ClusterAdvice
from irl.problem import LearningProblem
from irl.teacher import Teacher
from irl.training_config import TrainingConfig

torch.set_num_threads(1)  # networks this small gain nothing from more

WORLD = GridWorld(7, (3, 3))
CONFIG = ActiveConfig(
    initial=TrainingConfig(iterations=200, step=0.01, beta=70.0, schedule="none"),
    refine=TrainingConfig(iterations=100, step=0.01, beta=70.0, schedule="none"),
    budget=6,
    query_beta=70.0,
    hidden=(16, 16),
    prefer="thesis",
)
CLUSTERS = {"left": np.flatnonzero(WORLD.cells[:, 0] < 3), "top": np.arange(42, 49)}
ONE_CORNER = Demonstrations.from_pairs(WORLD.trajectories("diagonal")[0])


@dataclass
class Guide:
    """Walks to the goal, and knows what to do left of it and at the top."""

    asked: list[int]
    advised: list[str]

    def label(self, state, rng):
        dx, dy = np.array(WORLD.goal) - WORLD.cells[state]
        return (RIGHT if dx > 0 else LEFT) if dx else (UP if dy > 0 else DOWN)

    def trajectory(self, state, rng, max_steps=50):
        self.asked.append(state)
        pairs = []
        while state != WORLD.goal_state:
            pairs.append((int(state), self.label(state, rng)))
            state = WORLD.model.P.indices[WORLD.model.pair_index(*pairs[-1])]
        return pairs

    def advise(self, cluster, states):
        self.advised.append(cluster)
        assert states is CLUSTERS[cluster]
        avoided, preferred = {"left": (LEFT, RIGHT), "top": (UP, DOWN)}[cluster]
        return ClusterAdvice(frozenset({preferred}), frozenset({avoided}))


PROBLEM = LearningProblem(WORLD.model, WORLD.features, gamma=0.9, clusters=CLUSTERS)
NETWORKS_SEE = replace(PROBLEM, features=WORLD.features.astype(np.float32))
ABOUT_THE_TEACHER = {"demonstrator", "expert", "generalisation", "rules"}
HOW = {"rng", "callback", "checkpoint", "demonstrations"}


def run(config=CONFIG, seed=0, **changes):
    """Learn, with a field of the problem, of the teacher, or an argument of the call changed."""
    guide = Guide([], [])
    of_teacher = {k: v for k, v in changes.items() if k in ABOUT_THE_TEACHER}
    how = {"rng": np.random.default_rng(seed)} | {k: v for k, v in changes.items() if k in HOW}
    of_problem = {k: v for k, v in changes.items() if k not in {*of_teacher, *how}}
    problem = replace(PROBLEM, start_states=None, **of_problem)
    teacher = Teacher(**({"demonstrator": guide, "expert": guide} | of_teacher))
    demonstrations = how.pop("demonstrations", ONE_CORNER)
    return active_fa_mlirl(problem, demonstrations, teacher, config, **how), guide


def accuracy(result):
    return WORLD.accuracy(result.q.argmax(axis=1))


SHORT = replace(
    CONFIG,
    initial=replace(CONFIG.initial, iterations=40),
    refine=replace(CONFIG.refine, iterations=10),
)
