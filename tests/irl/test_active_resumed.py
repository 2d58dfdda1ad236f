"""Algorithm 4.1 goes on after a kill, to the same bits, and refuses what is not its own."""

from dataclasses import replace

import numpy as np
import pytest
import torch

import irl.active
import irl.training
from irl.active import ActiveConfig
from irl.active_state import training_files
from irl.demonstrations import Demonstrations
from irl.demonstrators import OracleDemonstrator
from irl.domains.gridworld import RIGHT, UP, GridWorld
from irl.errors import InputError
from irl.experts import OracleExpert
from irl.preferences import StatePreferences
from tests.irl.active_runs import CLUSTERS, SHORT, WORLD, run


class KilledError(Exception):
    pass


@pytest.mark.parametrize(
    ("strategy", "killed_after"),
    [("bald", 0), ("bald", 1), ("random", 1), ("visitation_entropy", 2), ("random", 3)],
)
def test_a_run_that_was_killed_goes_on_to_the_same_bits(tmp_path, strategy, killed_after):
    config = replace(
        SHORT,
        state_query=strategy,
        cluster_query="random",
        budget=5,
        batch=2,
        committee=2,
        cluster_intersections=1,
        initial=replace(SHORT.initial, bellman_weight=1.0, learn_beta=True),
    )
    path = tmp_path / "run.safetensors"
    expert = OracleExpert(OracleDemonstrator(WORLD.model, np.array([24])), np.arange(49))
    whole, _ = run(config, expert=expert)
    trainings = iter(range(99))

    def kill(progress):
        if progress.iteration == 5 and progress.q is None and next(trainings) == killed_after + 1:
            raise KilledError

    if killed_after < 3:
        with pytest.raises(KilledError):
            run(config, expert=expert, checkpoint=path, callback=kill)
    else:
        run(config, expert=expert, checkpoint=path)
    told = []
    resumed, guide = run(config, expert=expert, checkpoint=path, callback=told.append)
    assert len(guide.asked) == max(0, 5 - 2 * killed_after)
    assert {p.query for p in told} == {k for k in (2, 4, 5) if k > 2 * killed_after}
    assert resumed.q.tobytes() == whole.q.tobytes()
    assert resumed.f.tobytes() == whole.f.tobytes()
    assert torch.equal(resumed.network.parameters, whole.network.parameters)
    assert resumed.history == whole.history
    assert resumed.beta == whole.beta
    assert resumed.demonstrations.pairs == whole.demonstrations.pairs
    assert np.array_equal(resumed.advice.avoided, whole.advice.avoided)


def test_a_first_training_that_was_killed_does_not_start_again(tmp_path, monkeypatch):
    monkeypatch.setattr("irl.active_state.EVERY", 10)
    config = replace(SHORT, budget=2, initial=replace(SHORT.initial, bellman_weight=1.0))
    path = tmp_path / "run.safetensors"
    whole, _ = run(config)

    def kill(progress):
        if progress.iteration == 25:
            raise KilledError

    with pytest.raises(KilledError):
        run(config, checkpoint=path, callback=kill)
    assert not path.exists()
    assert [p.name for p in training_files(path)] == ["run.safetensors.training-main"]
    told = []
    resumed, _ = run(config, checkpoint=path, callback=told.append)
    assert [p.iteration for p in told if p.query == 0] == [*range(21, 41), 40]
    assert resumed.q.tobytes() == whole.q.tobytes()
    assert torch.equal(resumed.network.parameters, whole.network.parameters)
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


def test_a_committee_that_was_killed_in_its_first_training_goes_on(tmp_path, monkeypatch):
    monkeypatch.setattr("irl.active_state.EVERY", 10)
    config = replace(SHORT, budget=2, state_query="bald", committee=3)
    path = tmp_path / "run.safetensors"
    whole, _ = run(config)
    steps, save = [], irl.training.save

    def save_or_die(file, arrays, state, identity):
        if file.name.endswith("member1") and state["done"] == 30:
            raise KilledError
        steps.append((file.name.rpartition("-")[2], state["done"]))
        save(file, arrays, state, identity)

    monkeypatch.setattr("irl.training.save", save_or_die)
    with pytest.raises(KilledError):
        run(config, checkpoint=path)
    monkeypatch.setattr(
        "irl.training.save", lambda *all_: (steps.append(("again", all_[0].name)), save(*all_))
    )
    resumed, _ = run(config, checkpoint=path)
    assert ("member1", 20) in steps
    again = [name.rpartition("-")[2] for mark, name in steps if mark == "again"]
    assert again == ["member1"] * 3 + ["member2"] * 6  # at 30, 40 and the end; all of the last
    assert resumed.q.tobytes() == whole.q.tobytes()
    assert resumed.history == whole.history
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


@pytest.mark.parametrize(
    ("name", "config", "options"),
    [
        ("batch", {"batch": 2}, {}),
        ("initial", {"initial": replace(SHORT.initial, step=0.02)}, {}),
        ("gamma", {}, {"gamma": 0.8}),
        ("rng", {}, {"rng": np.random.default_rng(9)}),
        ("features", {}, {"features": WORLD.features + 1}),
        ("model", {}, {"model": GridWorld(7, (0, 0)).model.__class__.from_entries(
            49, 4, np.arange(48), np.full(48, RIGHT), np.arange(1, 49), np.ones(48)),
            "demonstrations": Demonstrations.from_pairs([(0, RIGHT)])}),
        ("demonstrations", {}, {"demonstrations": Demonstrations.from_pairs([(0, UP)])}),
        ("clusters", {}, {"clusters": {"top": CLUSTERS["top"]}}),
        ("candidates", {}, {"candidates": np.array([6, 48])}),
        ("preferred", {}, {"preferences": StatePreferences([3])}),
        ("fixed_vr", {}, {"fixed_vr": {3: 0.1}}),
    ],
)  # fmt: skip
def test_a_foreign_checkpoint_is_refused(tmp_path, name, config, options):
    path = tmp_path / "run.safetensors"
    short = replace(SHORT, budget=1)
    run(short, checkpoint=path)
    with pytest.raises(InputError, match=rf"run\.safetensors.*differing in .*{name} \("):
        run(replace(short, **config), checkpoint=path, **options)
    path.write_bytes(path.read_bytes()[:-9])
    with pytest.raises(InputError, match=r"run\.safetensors"):
        run(short, checkpoint=path)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"batch": 0}, "batch"),
        ({"committee": 1}, "committee"),
        ({"cluster_intersections": -1}, "cluster_intersections"),
        ({"smallest_intersection": 0}, "smallest_intersection"),
        ({"state_query": "entropy"}, "state_query.*margin"),
        ({"cluster_query": "margin"}, "cluster_query.*none"),
        ({"avoid": "no"}, "avoid"),
        ({"budget": -1}, "budget"),
        ({"query_beta": 0.0}, "query_beta"),
    ],
)
def test_bad_options_are_named(options, message):
    with pytest.raises(InputError, match=message):
        ActiveConfig(**options)
