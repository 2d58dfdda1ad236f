"""A recording stands in for the simulated demonstrator, and answers for what it holds."""

import json

import numpy as np
import pytest

from experiments import demo
from experiments.grasping.teacher import GraspTeacher, TeacherConfig
from experiments.kit.command import execute
from experiments.kit.shipped_data import SHIPPED_TASK
from irl.collection import demonstrate
from irl.demonstrations import Demonstrations
from irl.errors import InputError
from irl.problem import LearningProblem
from irl.task_data import load_task


@pytest.fixture(scope="module")
def task():
    return load_task(SHIPPED_TASK)


@pytest.fixture(scope="module")
def recording(task, tmp_path_factory):
    """A CSV file of twelve runs, and what is in it."""
    oracle = GraspTeacher(task, TeacherConfig()).oracle
    rng = np.random.default_rng(5)
    shown = demonstrate(oracle, rng.choice(task.start_states, 12, replace=False), rng)
    path = tmp_path_factory.mktemp("recording") / "runs.csv"
    shown.save(path)
    return path, shown


def test_it_repeats_what_was_recorded_and_is_asked_about_nothing_else(task, recording):
    path, shown = recording
    recorded = GraspTeacher(task, TeacherConfig("recorded", path))
    first, teacher, _ = recorded.initial_demonstrations(10, 1.0, np.random.default_rng(0))
    assert first.n_states_demonstrated == 10
    assert set(first.pairs) <= set(shown.pairs)
    asked = recorded.candidates(LearningProblem.of(task, "rotation"))
    assert set(asked.tolist()) == set(shown.state.tolist())
    pairs = teacher.demonstrator.trajectory(int(shown.state[0]), np.random.default_rng(0))
    assert pairs == shown.select(shown.trajectory == 0).pairs


def test_of_a_short_recording_all_is_used(task, recording):
    path, shown = recording
    recorded = GraspTeacher(task, TeacherConfig("recorded", path))
    first, *_ = recorded.initial_demonstrations(981, 1.0, np.random.default_rng(0))
    assert sorted(first.pairs) == sorted(shown.pairs)


def test_the_demo_learns_from_a_recording(recording, tmp_path):
    path, shown = recording
    execute(
        demo.Config,
        demo.main,
        [
            *("--teacher.demonstrator", "recorded", "--teacher.recording", str(path)),
            *("--learning.demonstrations", "30", "--learning.least-purity", "1.0"),
            *("--learning.active.initial.iterations", "5"),
            *("--learning.active.refine.iterations", "2", "--learning.active.budget", "3"),
            *("--starts", "0", "--out", str(tmp_path)),
        ],
    )
    result = json.loads((tmp_path / "result.json").read_text())
    assert result["queries"] == 3
    labelled = round(result["demonstrated_fraction"] * 15984)
    assert 30 < labelled <= shown.n_states_demonstrated


@pytest.mark.parametrize(
    ("config", "words"),
    [
        ({"demonstrator": "recorded"}, r"--teacher\.recording: give a CSV file"),
        ({"recording": "x.csv"}, r"only then"),
        ({"demonstrator": "recorded", "recording": "missing.csv"}, r"missing\.csv: no such file"),
    ],
)
def test_a_recording_is_named_where_it_is_wanted(task, config, words):
    with pytest.raises(InputError, match=words):
        GraspTeacher(task, TeacherConfig(**config))


def test_a_recording_that_cannot_be_is_refused_by_file_and_row(task, tmp_path):
    path = tmp_path / "bad.csv"
    Demonstrations.from_pairs([(0, 54)]).save(path)  # nothing is held that could be dropped
    with pytest.raises(InputError, match=r"bad\.csv: row 0, field 'action' is 54, not feasible"):
        GraspTeacher(task, TeacherConfig("recorded", path))
    Demonstrations.empty().save(path)
    with pytest.raises(InputError, match=r"bad\.csv: holds no demonstration"):
        GraspTeacher(task, TeacherConfig("recorded", path))
