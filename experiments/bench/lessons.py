"""Learning to grasp: all of the demo's learning, one run, and the thesis' network at full size.

All times are the processor's, on one thread. What they are compared with is a time that learning
should not exceed, so that whoever teaches need not wait.
"""

from dataclasses import replace
from itertools import islice, pairwise
from time import process_time

import numpy as np

from experiments.bench.comparison import Peers, Row
from experiments.bench.learning import fastest, matrix_products, one_thread
from experiments.grasping.learning import LearningConfig, learn
from experiments.grasping.one_run import whole_runs
from experiments.grasping.tables.learners import THESIS
from experiments.grasping.teacher import GraspTeacher, TeacherConfig
from experiments.kit.robot_task import load_robot_task
from experiments.kit.shipped_data import SHIPPED_TASK
from irl import methods
from irl.likelihood import LikelihoodProblem
from irl.problem import LearningProblem
from irl.training import train
from irl.vr_function import VRFunction, torch_generator

DEMO_S, PLANNING_S, THESIS_S = 15.0, 15.0, 60.0
ITERATIONS, TIMED = 10_000, 200
RUNS = 3


def demo_seconds(teacher: GraspTeacher, config: LearningConfig, seed: int) -> float:
    """Processor time of the demo's first training and of its rounds of questions [s]."""
    rng = np.random.default_rng(seed)
    began = process_time()
    learn(teacher.task, teacher, config, rng)
    return process_time() - began


def planning_seconds(teacher: GraspTeacher, seed: int) -> list[float]:
    """Processor time of learning by ``planning`` from single runs, of each [s]."""
    rng, problem = np.random.default_rng(seed), LearningProblem.of(teacher.task)
    times = []
    for run in islice(whole_runs(teacher, rng), RUNS):
        began = process_time()
        methods.learn("planning", problem, run, rng=rng)
        times.append(process_time() - began)
    return times


def iteration_seconds(teacher: GraspTeacher, seed: int, timed: int) -> tuple[float, float, int]:
    """An iteration of the thesis' network on its 981 states, of ``timed`` the median [s].

    Returns:
        Its time, that of its matrix products alone, and the states that f is evaluated at.
    """
    rng, learning = np.random.default_rng(seed), THESIS.learning
    shown, _, _ = teacher.initial_demonstrations(
        learning.demonstrations, learning.least_purity, rng
    )
    problem = LikelihoodProblem.of(teacher.task.model, shown)
    features = teacher.task.feature(learning.features)
    widths = (features.shape[1], *learning.active.hidden, 1)
    network = VRFunction(widths[0], widths[1:-1], generator=torch_generator(rng))
    times: list[float] = []
    config = replace(learning.active.initial, iterations=timed)
    train(network, problem, features, config, rng, lambda *_: times.append(process_time()))
    own = float(np.median([b - a for a, b in pairwise(times)]))
    products = fastest(matrix_products(widths, problem.states.size), 20)
    return own, products, int(problem.states.size)


def rows(_: Peers, seed: int) -> list[Row]:
    """Time all three."""
    teacher = GraspTeacher(load_robot_task(SHIPPED_TASK), TeacherConfig())
    with one_thread():
        demo = demo_seconds(teacher, LearningConfig(), seed)
        planning = planning_seconds(teacher, seed)
        own, products, states = iteration_seconds(teacher, seed, TIMED)
    work = "10,000 iterations of the thesis' network, 981 states"
    details = {"evaluated_states": states, "an_iteration_s": own}
    return [
        Row("the demo's learning", demo, "the most it should take", DEMO_S, 1.0),
        Row(
            "planning from one run, the slowest of three",
            max(planning),
            "the most it should take",
            PLANNING_S,
            1.0,
            {"each_s": planning},
        ),
        Row(work, ITERATIONS * own, "the most they should take", THESIS_S, 1.0, details),
        Row(
            *(work, ITERATIONS * own, "its matrix products alone", ITERATIONS * products),
            details=details,
        ),
    ]
