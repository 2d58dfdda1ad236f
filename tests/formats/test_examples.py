"""Old files stay readable: what was written once is read, or refused by name."""

import json
import shutil
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from diagrams.trials.database import TrialDatabase
from experiments.grasping import learning
from experiments.kit.command import Output
from experiments.kit.kept_rows import KeptRows
from experiments.kit.shipped_data import load_feasibility
from experiments.reachability import workspace_run
from irl.demonstrations import Demonstrations
from irl.errors import InputError
from irl.lesson import Lesson
from irl.lesson_events import Undo, hash_of_states
from irl.lesson_exchange import read_advice
from irl.outcomes import load_reward, load_soft_policy
from irl.policy import load_policy
from irl.task_data import load_task
from models.errors import ModelError
from models.maps import lite_csv, reachability_csv
from models.scenes.parsing import description_hash
from models.scenes.robots import GEN3_LITE
from tests.formats import inputs
from tests.formats.contents import content, differences
from tests.formats.examples import DIGESTS, FORMATS, KEPT, digest

RULE = """
If what the file means or holds has changed: raise the version where the format is written, keep
the examples that are there, add today's by `python -m tests.formats.examples {name}`.
Today's code then reads the older ones, or refuses them by version."""


def flat(folder: Path) -> Path:
    """Where an example's files lie: task data are a folder of their own."""
    return folder / "task" if (folder / "task").is_dir() else folder


def kept() -> list[str]:
    return sorted(f"{path.parent.name}/{path.name}" for path in KEPT.glob("*/*/"))


@pytest.fixture
def example(tmp_path):
    """``example("policy/1")`` gives a copy of that example's folder."""

    def copied(name: str) -> Path:
        return Path(shutil.copytree(KEPT / name, tmp_path / name, dirs_exist_ok=True))

    return copied


def test_no_example_was_changed_or_lost():
    assert {name: digest(KEPT / name) for name in kept()} == json.loads(DIGESTS.read_text())


@pytest.mark.parametrize("name", FORMATS)
def test_what_is_written_today_is_what_todays_version_says(name, tmp_path):
    version = FORMATS[name].version
    FORMATS[name].write(tmp_path)
    today = content(flat(tmp_path))
    of_the_version = [k for k in kept() if k.split("/")[0] == name and _version(k) == version]
    apart = {k: differences(today, content(flat(KEPT / k))) for k in of_the_version}
    assert any(not found for found in apart.values()), (
        f"{name}, version {version}: written otherwise than its examples {apart}"
        + RULE.format(name=name)
    )


def _version(kept_name: str) -> str:
    return kept_name.split("/")[1].split(".", 1)[0]


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("policy", lambda c: c | {"policy.safetensors: q": c["policy.safetensors: q"] + 1}),
        ("trial_database", lambda c: {k: v for k, v in c.items() if ".draws" not in k}),
        ("task_data", lambda c: c | {"task.json: horizon": 3}),
        ("training", lambda c: c | {"training.checkpoint: checkpoint.content.state.done": 3}),
        ("kept_rows", lambda c: c | {"measured.json: rows": []}),
    ],
)
def test_another_meaning_is_noticed(name, change):
    was = content(flat(KEPT / name / FORMATS[name].version))
    assert not differences(was, was)
    assert len(differences(change(was), was)) == 1 or name == "trial_database"
    assert differences(change(was), was)


@pytest.mark.parametrize("name", [k for k in kept() if k.startswith("task_data/")])
def test_task_data_are_read(name, example):
    task, wanted = load_task(example(name) / "task"), inputs.task()
    for part in ("transitions", "generalisation", "demonstrations"):
        for field in fields(getattr(wanted, part)):
            one, other = (getattr(getattr(t, part), field.name) for t in (task, wanted))
            np.testing.assert_array_equal(one, other)
    for field in ("name", "gamma", "states", "actions", "fixed_vr", "provenance"):
        assert getattr(task, field) == getattr(wanted, field)
    for field in ("goal_states", "start_states", "preferred", "avoided"):
        np.testing.assert_array_equal(getattr(task, field), getattr(wanted, field))
    for field in ("features", "clusters"):
        for key, array in getattr(wanted, field).items():
            np.testing.assert_array_equal(getattr(task, field)[key], array)


@pytest.mark.parametrize("name", [k for k in kept() if k.startswith("demonstrations/")])
def test_demonstrations_are_read(name, example):
    shown = Demonstrations.load(example(name) / "demonstrations.csv")
    assert (shown.state.tolist(), shown.action.tolist()) == ([0, 1], [1, 1])
    assert (shown.trajectory.tolist(), shown.step.tolist()) == ([0, 0], [0, 1])
    assert shown.ends.tolist() == ([[0, 2, 2]] if name.endswith("with_end") else [])


@pytest.mark.parametrize("name", [k for k in kept() if k.startswith("policy/")])
def test_policies_are_read(name, example):
    policy = load_policy(example(name) / "policy.safetensors", "7a", inputs.MASK)
    assert policy.action.tolist() == [1, 1, 1, -1]
    np.testing.assert_array_equal(policy.q, np.where(inputs.MASK, inputs.Q, -np.inf))
    assert policy.weights["0.0.bias"].tolist() == [0.5, -0.25]
    assert (policy.algorithm, policy.seed, policy.task_hash) == ("lp", 3, "7a")


@pytest.mark.parametrize("name", [k for k in kept() if k.startswith("reward/")])
def test_rewards_are_read(name, example):
    reward = load_reward(example(name) / "reward.safetensors", "7a")
    assert reward.reward.tolist() == [0.0, -0.5, 0.25, 1.0]
    assert (reward.gamma, reward.algorithm, reward.seed) == (0.9, "lp", 3)
    assert reward.caution == (0.0 if name == "reward/1" else 0.125)


@pytest.mark.parametrize("name", [k for k in kept() if k.startswith("soft_policy/")])
def test_policies_by_chance_are_read(name, example):
    policy = load_soft_policy(example(name) / "soft_policy.safetensors", "7a")
    assert policy.probability.tolist() == [[0.25, 0.75], [0.0, 1.0], [0.5, 0.5], [0.0, 0.0]]
    assert (policy.algorithm, policy.seed) == ("birl", 3)


def refused_by_version(name, read):
    """Whether a checkpoint is an older one; those are refused: other training would go on."""
    if name.endswith("/1"):
        with pytest.raises(InputError, match=r"'schema_version' is 1; supported: 2"):
            read()
    return name.endswith("/1")


@pytest.mark.parametrize("name", [k for k in kept() if k.startswith("training/")])
def test_training_goes_on_from_a_checkpoint(name, example, tmp_path):
    path = example(name) / "training.checkpoint"
    if refused_by_version(name, lambda: inputs.train_to(4, path)):
        return
    network, done = inputs.train_to(4, path)
    alone, wanted = inputs.train_to(4, tmp_path / "new.checkpoint")
    np.testing.assert_allclose(done.log_likelihood, wanted.log_likelihood, rtol=1e-5)
    np.testing.assert_allclose(network.parameters, alone.parameters, rtol=1e-5)


@pytest.mark.parametrize("name", [k for k in kept() if k.startswith("active_learning/")])
def test_active_learning_goes_on_from_a_checkpoint(name, example):
    state, wanted = inputs.active_state(learnt=False), inputs.active_state(learnt=True)
    path = example(name) / "learning.checkpoint"
    if refused_by_version(name, lambda: state.restore(path, {"seed": 1})):
        return
    state.restore(path, {"seed": 1})
    assert state.rng.random() == wanted.rng.random()
    assert state.labels.state.tolist() == [0, 1, 2]
    assert (state.asked, state.asked_clusters, state.history) == ([2], ["low"], wanted.history)
    assert [tuple(pair) for pair in state.advice.avoided] == [(2, 0)]
    assert (state.learner.beta, state.committee.members[0].beta) == (8.0, 16.0)


@pytest.mark.parametrize("name", [k for k in kept() if k.startswith("lesson/")])
def test_lessons_are_read_and_added_to(name, example):
    with Lesson(example(name) / "lesson.db") as lesson:
        assert lesson.events == inputs.LESSON
        assert lesson.times == [100.0 + k for k in range(len(inputs.LESSON))]
        assert lesson.append(Undo(9)) == 15
    path, clusters = example(name) / "advice.json", {"low": np.array([0, 1]), "all": np.arange(4)}
    (first, second) = read_advice(path, "7a" * 32, clusters, 2).advice
    # A hash that is not told is that of the states which have the name.
    assert (first[0], second) == ("low ∩ all", ["low", hash_of_states(clusters["low"]), [], [1]])


READ_DATABASES = {"trial_database/2", "trial_database/3", "trial_database/4"}


@pytest.mark.parametrize("name", [k for k in kept() if k.startswith("trial_database/")])
def test_trial_databases_are_read_or_refused_by_version(name, example):
    path = example(name) / "trials.db"
    if name not in READ_DATABASES:
        with pytest.raises(ModelError, match=r"trials\.db: .*(version|column|draws)") as told:
            list(TrialDatabase(path).trials())
        assert "\n" not in str(told.value)
        return
    ((pair, repetition, record),) = TrialDatabase(path).trials()
    assert (pair.state, pair.action, repetition) == (9000, 54, 4)
    assert (record.outcome, record.next_state, record.draws) == ("free", 48, 2)
    assert (record.turn, record.displacement) == ((0.1, 0.2, 0.5), (1e-3, 0.0, -0.03))
    assert (record.noise.yaw, record.noise.friction) == (0.25, 0.8)


@pytest.mark.parametrize("name", [k for k in kept() if k.startswith("kept_rows/")])
def test_rows_are_taken_up(name, example):
    folder = example(name)
    rows = KeptRows(Output(folder, None), {"seed": 1, "states": [25]}).rows
    assert rows == [{"states": 25, "seconds": 0.5}]


@pytest.mark.parametrize("name", [k for k in kept() if k.startswith("learning_curve/")])
def test_learning_curves_are_taken_up(name, example):
    curve = learning._read_curve(example(name) / learning.CURVE)
    assert [(p.query, p.demonstrated, p.success) for p in curve] == [(0, 981, 0.5), (1, 981, 1.0)]


def of_todays_models(path: Path, *files) -> Path:
    """The map as if it had been made from today's model files."""
    title, rest = path.read_text(encoding="utf-8").split("\n", 1)
    there = title.rsplit(" ", 1)[0]
    path.write_text(f"{there} {description_hash(*files)}\n{rest}", encoding="utf-8")
    return path


@pytest.mark.parametrize("name", [k for k in kept() if k.startswith("reachability_map/")])
def test_reachability_maps_are_read(name, example):
    known = reachability_csv.read_map(of_todays_models(example(name) / "map.csv"))
    assert known.seed == 5
    for entry, wanted in zip(known.entries, inputs.map_entries(), strict=True):
        np.testing.assert_array_equal(entry.p_WG, wanted.p_WG)
        np.testing.assert_array_equal(entry.q, wanted.q)
        for field in ("layer", "gripper", "clearance", "failure", "attempts"):
            assert getattr(entry, field) == getattr(wanted, field)


@pytest.mark.parametrize("name", [k for k in kept() if k.startswith("lite_map/")])
def test_maps_of_the_gen3_lite_are_read(name, example):
    entries = lite_csv.read_map(of_todays_models(example(name) / "map.csv", GEN3_LITE.files))
    for entry, wanted in zip(entries, inputs.lite_entries(), strict=True):
        np.testing.assert_array_equal(entry.q, wanted.q)
        assert (entry.value, entry.failure) == (wanted.value, wanted.failure)


@pytest.mark.parametrize(
    ("name", "read"),
    [("reachability_map/1", reachability_csv.read_map), ("lite_map/1", lite_csv.read_map)],
)
def test_maps_of_other_model_files_are_refused_by_name(name, read, example):
    path = example(name) / "map.csv"
    path.write_text(path.read_text().replace("model files ", "model files 0"))
    with pytest.raises(ModelError, match="model files"):
        read(path)


@pytest.mark.parametrize("name", [k for k in kept() if k.startswith("feasibility/")])
def test_feasible_actions_are_read(name, example):
    feasibility = load_feasibility(example(name))
    assert feasibility.grasp.tolist() == [[True, False]]
    assert feasibility.drop.tolist() == [[True], [False]]
    assert feasibility.held.all()


@pytest.mark.parametrize("name", [k for k in kept() if k.startswith("workspace_map/")])
def test_workspace_maps_are_read(name, example, monkeypatch):
    path = example(name) / workspace_run.FILE
    made_from = str(workspace_run.read_npz(path)["model_files"])
    monkeypatch.setattr(workspace_run, "description_hash", lambda: made_from)
    known, wanted = workspace_run.read_map(path), inputs.workspace_map()
    assert known.grid == wanted.grid
    for field in ("reason", "q", "clearance"):
        one, other = (getattr(m.decisions, field) for m in (known, wanted))
        np.testing.assert_array_equal(one, other)
    monkeypatch.setattr(workspace_run, "description_hash", lambda: "0" * 64)
    with pytest.raises(ModelError, match="model_files"):
        workspace_run.read_map(path)


@pytest.mark.parametrize("name", [k for k in kept() if k.startswith("workspace_plan/")])
def test_chunks_of_a_workspace_map_are_taken_up_with_their_own_plan_only(name, example):
    with pytest.raises(InputError, match="differing in model_files"):
        workspace_run._open(workspace_run.Plan(inputs.workspace_map().grid), example(name))


def test_every_format_has_an_example_of_today():
    assert {name.split("/")[0] for name in kept()} == FORMATS.keys()
