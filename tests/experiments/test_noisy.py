"""What is learnt from runs that contradict each other, as a person runs it."""

import json

import numpy as np
import pytest

from experiments import noisy
from experiments.noisy import ACTIONS, GAMMA, LEARNERS, STATES, World, counted
from irl.methods import METHODS

LEAST = dict.fromkeys(LEARNERS, 0.85) | {"lp_basis": 0.75}


def learnt(command, folder, *arguments):
    done = command("noisy", *arguments, "--out", folder)
    assert done.returncode == 0, done.stderr
    assert (folder / "shares.png").read_bytes().startswith(b"\x89PNG")
    assert (folder / "config.yaml").is_file()
    result = json.loads((folder / "result.json").read_text())
    return {row["method"]: row for row in result["rows"]}, result, done.stdout


def test_every_quick_method_learns_from_a_demonstrator_who_mostly_errs(command, tmp_path):
    quick = [name for name in METHODS if name not in {"fa_mlirl", "birl"}]
    rows, result, told = learnt(command, tmp_path / "a", "--seeds", 0, "--methods", *quick)
    assert rows.keys() == set(quick)
    for name, row in rows.items():
        assert row["share"][0] >= LEAST[name], name
        assert name in told
    assert 0.2 < result["references"]["demonstrator"][0] < 0.7
    assert result["references"]["chance"][0] < 0.3
    assert result["references"]["true_reward"][0] > 0.95
    assert 15_000 < result["moves"][0] < 27_000  # 819 runs of 26 moves, in the mean


@pytest.mark.soak
def test_every_method_learns_with_every_seed(command, tmp_path):
    rows, _, _ = learnt(command, tmp_path / "a")
    assert rows.keys() == set(LEARNERS)
    for name, row in rows.items():
        assert len(row["share"]) == 5
        assert min(row["share"]) >= LEAST[name], name
    assert max(rows["birl"]["r_hat"]) <= 1.05


def test_the_model_is_what_the_moves_amount_to():
    model = counted(np.array([[0, 1, 2], [2, 0, 0], [0, 1, 2], [0, 1, 3]]))
    assert (model.n_states, model.n_actions, model.n_pairs) == (STATES, ACTIONS, 2)
    row = model.P[int(model.pair_index(0, 1))].toarray().ravel()
    assert (row[2], row[3]) == (pytest.approx(2 / 3), pytest.approx(1 / 3))
    assert model.pair_index(2, 1) == -1  # never tried


def test_where_nothing_was_learnt_any_action_is_taken():
    world = World.drawn(3, np.random.default_rng(0))
    nothing = np.full(STATES, -1)
    assert world.share(nothing) == pytest.approx(world.references()["chance"])
    # By a linear system of its own: 2 actions known, in all other states each action alike.
    policy = nothing.copy()
    policy[:2] = 3, 5
    pi = np.full((STATES, ACTIONS), 1 / ACTIONS)
    pi[:2] = np.eye(ACTIONS)[[3, 5]]
    P = world.true.P.toarray().reshape(STATES, ACTIONS, STATES)
    P_pi = np.einsum("sa,sat->st", pi, P)
    V = np.linalg.solve(np.eye(STATES) - GAMMA * P_pi, P_pi @ world.reward)
    assert world.share(policy) == pytest.approx(V.mean() / world.optimum)


def test_mistakes_cost_one_line(refused):
    assert "--methods: unknown name 'magic'" in refused(noisy, "--methods", "magic")
    assert "--runs: must be ≥ 1" in refused(noisy, "--runs", 0)
    assert "--seeds" in refused(noisy, "--seeds", -1)
