"""The policy that the demo once learnt, as a file for today's task."""

from pathlib import Path

import numpy as np
import pytest

from experiments.kit.robot_task import load_robot_task
from experiments.kit.shipped_data import SHIPPED_TASK
from irl.policy import Policy, save_policy
from models.task.spaces import Action, Kind, State

ACTIONS = Path(__file__).parents[2] / "data" / "demo_actions.npz"


@pytest.fixture(scope="session")
def policy_file(tmp_path_factory):
    task = load_robot_task(SHIPPED_TASK)
    action = np.load(ACTIONS)["action"].astype(np.int64)
    q = np.where(task.model.mask, 0.0, -np.inf).astype(np.float32)
    some = np.flatnonzero(action >= 0)
    q[some, action[some]] = 1.0
    q[State(2, 0, 10).index, Action(Kind.DROP).index] = 2.0  # at the goal
    path = tmp_path_factory.mktemp("policy") / "policy.safetensors"
    save_policy(Policy(action, q, task_hash=task.task_hash), path)
    return path
