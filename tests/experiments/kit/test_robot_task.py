"""What the robot is not asked to do: tasks of another kind, and starts that it cannot be put in."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from experiments import demo, own_task
from experiments.kit.robot_task import load_robot_task
from experiments.kit.shipped_data import SHIPPED_TASK
from experiments.simulate import story as simulate
from experiments.transitions import story as transitions
from irl.files import sha256
from irl.policy import Policy, save_policy
from irl.task_data import load_task, save_task
from models.task.tables import state_rows


@pytest.fixture
def task(tmp_path):
    return Path(shutil.copytree(SHIPPED_TASK, tmp_path / "task"))


def sign(folder, **changes):
    """Change fields of task.json, its hashes brought up to date, and leave it consistent."""
    sheet = json.loads((folder / "task.json").read_text()) | changes
    for name in sheet["files"]:
        sheet["files"][name] = sha256(folder / name)
    (folder / "task.json").write_text(json.dumps(sheet))


def test_the_shipped_tables_are_the_robots():
    """What is compared with by its hash says row by row what `models.task.tables` says."""
    told = [tuple(row.values()) for row in load_robot_task(SHIPPED_TASK).states]
    assert told == [row[1:] for row in state_rows()]


@pytest.mark.parametrize(
    ("story", "arguments"),
    [(demo, []), (simulate, []), (transitions, ["validate"])],
    ids=["demo", "simulate", "validate"],
)
def test_another_task_is_refused_before_any_work(refused, tmp_path, story, arguments):
    save_task(own_task.workshop(), tmp_path / "workshop")
    message = refused(story, *arguments, "--task", tmp_path / "workshop")
    assert "states.csv" in message
    assert "65 rows" in message and "15985" in message


def test_a_task_of_the_same_size_that_means_something_else_is_refused(refused, task):
    """Two actions that change places: a policy for it would send the arm elsewhere."""
    lines = (task / "actions.csv").read_text().splitlines()
    first, second = lines[1].split(",", 1), lines[2].split(",", 1)
    lines[1], lines[2] = f"{first[0]},{second[1]}", f"{second[0]},{first[1]}"
    (task / "actions.csv").write_text("\n".join(lines) + "\n")
    sign(task)
    message = refused(demo, "--task", task)
    assert "actions.csv: row 0, field 'target' is '1'" in message


def test_tables_that_say_the_same_in_other_bytes_are_the_robots(task):
    path = task / "actions.csv"
    path.write_bytes(path.read_bytes().replace(b"\n", b"\r\n"))
    sign(task)
    assert load_robot_task(task).n_actions == 55


def test_starts_in_the_hand_are_refused_before_learning(refused, task):
    sign(task, start_states=[0, 500])
    message = refused(demo, "--task", task)
    assert "start_states" in message and "500" in message and "0…431" in message


@pytest.fixture(scope="module")
def shipped():
    return load_task(SHIPPED_TASK)


def test_a_policy_of_other_rows_or_actions_is_refused(refused, tmp_path, shipped):
    model, path = shipped.model, tmp_path / "p.safetensors"
    q = np.zeros((shipped.n_states, shipped.n_actions))

    def message(policy):
        save_policy(policy, path)
        return refused(simulate, "--policy", path)

    for rows in (slice(1, None), slice(0, 100)):
        few = Policy.from_q(q[rows], model.mask[rows], task_hash=shipped.task_hash)
        assert f"{few.q.shape[0]} states" in message(few)
    policy = Policy.from_q(q, model.mask, task_hash=shipped.task_hash)
    policy.action[7] = -1
    assert "'action' is -1 in state 7, though something is feasible" in message(policy)
    policy.action[7] = 54
    assert "'action' is 54 in state 7, which is not feasible" in message(policy)
