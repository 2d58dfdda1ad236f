"""The demo and what follows from it, run as a person runs them, with tiny settings."""

import json
import shutil
import subprocess
import sys
import time
import zipfile
from pathlib import Path

import numpy as np
import pytest

from experiments import demo
from experiments.grasping.learning import CHECKPOINT, CURVE
from experiments.kit.shipped_data import SHIPPED_TASK
from experiments.simulate import story as simulate
from irl.files import sha256
from irl.metrics import success_mdp
from irl.npz import read_npz, write_npz
from irl.policy import Policy, load_policy, save_policy
from irl.task_data import FILES, load_task

TINY = [
    *("--learning.demonstrations", "60"),
    *("--learning.active.initial.iterations", "30"),
    *("--learning.active.refine.iterations", "5"),
    *("--learning.active.budget", "2"),
    *("--learning.active.max-demonstrated", "100"),
    *("--starts", "1", "--max-actions", "1"),
]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("demo")


@pytest.fixture(scope="module")
def done(folder, command):
    return command("demo", *TINY, "--out", str(folder / "out"))


def test_the_demo_leaves_figures_pictures_and_a_policy(done, folder):
    assert done.returncode == 0, done.stderr
    result = json.loads((folder / "out/result.json").read_text())
    assert {
        "accuracy_optimal",
        "accuracy_optimal_all",
        "learning_s",
        "accuracy_strict",
        "accuracy_strict_ceiling",
        "success_mdp",
        "success_mdp_oracle",
        "success_drake",
        "demonstrated_fraction",
        "wall_s",
        "recording",
    } <= result.keys()
    assert 0.0 < result["demonstrated_fraction"] <= 100 / 15984
    assert len(result["advised_clusters"]) == result["queries"] == 2
    one = result["one_trajectory"]
    assert 2 <= one["labels"] <= 10
    assert one["success_mdp"] > 0.99
    assert one["accuracy_optimal_all"] > 0.9
    assert one["seconds"] > 0
    assert "from one trajectory" in done.stdout
    assert result["success_mdp_oracle"] > 0.9
    assert result["success_drake"]["trials"] == 1
    (episode,) = result["episodes"]
    assert len(episode["actions"]) == 1
    assert episode["actions"][0].startswith("grasp with")
    limits = result["limits"]
    assert limits["limited_samples"] == 0
    for name in ("speed", "torque", "tracking_error"):
        assert len(limits[name]) == 7
        assert all(0.0 < share < 0.95 for share in limits[name])
    assert limits["torque"][1] == max(limits["torque"]) > 0.3  # joint 2 carries the arm
    recording = (folder / "out/recording.html").read_text()
    assert "<html" in recording
    assert len(recording) > 1_000_000
    for name in ("learning.png", "policy.png", "episode_1.png", "robot.png"):
        assert (folder / "out" / name).read_bytes().startswith(b"\x89PNG")
    assert "success in the model" in done.stdout
    policy = load_policy(folder / "out/policy.safetensors", load_task(SHIPPED_TASK).task_hash)
    assert policy.algorithm == "fa_mlirl"
    task = load_task(SHIPPED_TASK)
    of_one = load_policy(folder / "out/one_trajectory.safetensors", task.task_hash, task.model.mask)
    assert of_one.algorithm == "goal_posterior"
    reached = success_mdp(task.model, of_one.action, task.goal_states, task.start_states)
    assert reached == one["success_mdp"]


def test_a_demo_that_was_killed_goes_on_to_the_same_bytes_and_episodes(done, folder, command):
    out = folder / "killed"
    program = [sys.executable, "-m", "experiments.demo", *TINY, "--out", str(out)]
    process = subprocess.Popen(program, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    deadline = time.monotonic() + 120
    while not (out / CHECKPOINT).exists():
        assert time.monotonic() < deadline and process.poll() is None
        time.sleep(0.01)
    process.kill()
    process.wait()
    assert not (out / "result.json").exists()
    other = command("demo", *TINY, "--seed", "1", "--out", str(out))
    assert other.returncode == 2
    assert CHECKPOINT in other.stderr.splitlines()[-1]

    again = command("demo", *TINY, "--out", str(out))
    assert again.returncode == 0, again.stderr
    assert sha256(out / "policy.safetensors") == sha256(folder / "out/policy.safetensors")
    assert sha256(out / "learning.png") == sha256(folder / "out/learning.png")
    assert not (out / CHECKPOINT).exists() and not (out / CURVE).exists()
    first, second = (
        json.loads((folder / name / "result.json").read_text())["episodes"]
        for name in ("out", "killed")
    )
    assert first == second


def test_simulate_plays_the_policy_that_the_demo_left(done, folder, command):
    played = command(
        *("simulate", "--policy", str(folder / "out/policy.safetensors")),
        *("--starts", "1", "--max-actions", "1", "--disturbance", "0.002"),
        *("--out", str(folder / "simulate")),
    )
    assert played.returncode == 0, played.stderr
    result = json.loads((folder / "simulate/result.json").read_text())
    assert (result["trials"], result["faults"]) == (1, 0)
    assert {"successes", "actions_mean"} <= result.keys()
    assert (folder / "simulate" / result["recording"]).is_file()


@pytest.fixture
def task(tmp_path):
    return Path(shutil.copytree(SHIPPED_TASK, tmp_path / "task"))


def sign(folder):
    """Bring the hashes in task.json up to date, so that what is inside is looked at."""
    sheet = json.loads((folder / "task.json").read_text())
    for name in sheet["files"]:
        sheet["files"][name] = sha256(folder / name)
    (folder / "task.json").write_text(json.dumps(sheet))


@pytest.mark.parametrize("name", FILES)
@pytest.mark.parametrize("damage", ["missing", "truncated", "flipped"])
def test_damaged_task_data_are_refused_by_file(refused, task, name, damage):
    path = task / name
    content = path.read_bytes()
    if damage == "missing":
        path.unlink()
    elif damage == "truncated":
        path.write_bytes(content[: len(content) // 2])
    else:
        middle = len(content) // 2
        path.write_bytes(content[:middle] + bytes([content[middle] ^ 0x80]) + content[middle + 1 :])
    assert name in refused(demo, "--task", task)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda a: a | {"probability": a["probability"][:-1]}, ["probability", "must be float64"]),
        (lambda a: a | {"probability": np.where(a["state"] == 5, np.nan, a["probability"])},
         ["probability", "finite"]),
        (lambda a: a | {"probability": a["probability"] * 0.9}, ["probability", "sum to 1"]),
    ],
    ids=["shape", "nan", "sum"],
)  # fmt: skip
def test_impossible_probabilities_are_refused_by_field(refused, task, change, words):
    write_npz(task / "transitions.npz", change(read_npz(task / "transitions.npz")))
    sign(task)
    message = refused(demo, "--task", task)
    assert "transitions.npz" in message
    assert all(word in message for word in words)


def test_an_unknown_schema_names_the_known_ones(refused, task):
    sheet = json.loads((task / "task.json").read_text())
    (task / "task.json").write_text(json.dumps(sheet | {"schema_version": 99}))
    message = refused(demo, "--task", task)
    assert "schema_version" in message
    assert "99" in message


def test_a_policy_of_another_task_is_refused(refused, tmp_path):
    n, m = 15985, 55
    policy = Policy.from_q(
        np.zeros((n, m)), np.ones((n, m), bool), task_hash="0" * 64, algorithm="x", seed=0
    )
    save_policy(policy, tmp_path / "p.safetensors")
    message = refused(simulate, "--policy", tmp_path / "p.safetensors")
    assert "p.safetensors" in message
    assert "task" in message


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (["--learning.features", "smell"], "rotation"),
        (["--learning.active.state-query", "whim"], "margin"),
        (["--starts", "999"], "431"),
        (["--seed", "-1"], "--seed"),
        (["--learning.least-purity", "3"], "--learning.least-purity: "),
        (["--out", "/dev/null/out"], "--out"),
    ],
)
def test_bad_settings_name_the_valid_ones(refused, arguments, word):
    assert word in refused(demo, *arguments)


def test_shipped_archives_are_plain(task):
    for path in task.glob("*.npz"):
        assert zipfile.is_zipfile(path)
        assert all(array.dtype != object for array in read_npz(path).values())
