"""What one run teaches, and when it is told that nobody knows where a run ended."""

from pathlib import Path

import numpy as np
import pytest

from experiments.grasping.one_run import learn_from_one
from experiments.grasping.teacher import GraspTeacher, TeacherConfig
from experiments.kit.robot_task import load_robot_task
from experiments.kit.shipped_data import SHIPPED_TASK
from irl.demonstrations import Demonstrations


@pytest.fixture(scope="module")
def task():
    return load_robot_task(SHIPPED_TASK)


def recorded(task, path, end):
    run = next(GraspTeacher(task, TeacherConfig()).runs(np.random.default_rng(3)))
    Demonstrations.from_pairs(run.pairs, end=int(run.ends[0, 2]) if end else None).save(path)
    return GraspTeacher(task, TeacherConfig("recorded", path)), run


def test_a_recorded_run_that_tells_its_end_teaches_the_goal(task, tmp_path: Path):
    teacher, run = recorded(task, tmp_path / "run.csv", end=True)
    one, policy = learn_from_one(teacher, np.random.default_rng(0), seed=3)
    assert (policy.algorithm, policy.seed) == ("goal_posterior", 3)
    assert policy.task_hash == task.task_hash
    assert one.labels == len(run) >= 2
    assert one.success_mdp > 0.99
    assert one.accuracy_optimal_all > 0.9


def test_without_ends_nothing_is_learnt_from_one_run(task, tmp_path: Path):
    teacher, _ = recorded(task, tmp_path / "run.csv", end=False)
    assert learn_from_one(teacher, np.random.default_rng(0), seed=0) is None
