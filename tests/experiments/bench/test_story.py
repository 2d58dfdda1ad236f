import numpy as np
import pytest
import torch

from experiments.bench import learning
from experiments.bench.comparison import Peers, Row, best_of
from irl.training import train
from irl.training_config import TrainingConfig

torch.set_num_threads(1)


def test_ratio_says_how_many_times_faster_ours_is():
    assert Row("work", 2.0, "other", 6.0).ratio == 3.0


def test_the_fastest_call_counts_after_one_to_warm_up(monkeypatch):
    readings = iter([0.0, 5.0, 10.0, 12.0, 20.0, 23.0])
    monkeypatch.setattr("time.perf_counter", lambda: next(readings))
    calls = []
    assert best_of(lambda: calls.append(1), repeats=3) == 2.0
    assert len(calls) == 4


@pytest.mark.parametrize("trajectories", ["diagonal", "border"])
def test_autograd_on_all_states_learns_the_same(trajectories):
    case = learning.Case.on(7, trajectories, (32, 32), seed=0)
    network = case.network()
    config = TrainingConfig(iterations=30, step=learning.STEP, schedule="none", beta=case.beta)
    rng = np.random.default_rng(0)
    run = train(network, case.problem(), case.world.features, config, rng)
    autograd = learning.AutogradLearner(case)
    likelihood = [autograd.step() for _ in range(30)]
    np.testing.assert_allclose(likelihood, run.log_likelihood, rtol=1e-3)
    with torch.no_grad():
        f = autograd.network(torch.as_tensor(case.world.features, dtype=torch.float32))
    np.testing.assert_allclose(f[:, 0], network.values(case.world.features), atol=1e-4)


def test_matrix_products_are_those_of_the_network(monkeypatch):
    counted = []
    monkeypatch.setattr(torch, "mm", lambda a, b, out: counted.append((*a.shape, b.shape[1])))
    learning.matrix_products((2, 150, 50, 1), 41)()
    forward = [(150, 3, 41), (50, 151, 41), (1, 51, 41)]
    gradients = [(150, 41, 3), (50, 41, 151), (1, 41, 51)]
    slopes = [(150, 50, 41), (50, 1, 41)]
    assert sorted(counted) == sorted(forward + gradients + slopes)


def test_learning_rows_compare_what_they_say(monkeypatch):
    monkeypatch.setattr(learning, "LARGE", 9)
    monkeypatch.setattr(learning, "ROUNDS", 1)
    monkeypatch.setattr(learning, "CALLS", 3)
    monkeypatch.setattr(learning, "NETWORKS", ((4, 3),))
    before = torch.get_num_threads()
    rows = learning.rows(Peers(), seed=0)
    assert torch.get_num_threads() == before
    assert [row.other for row in rows[:4]] == [
        "itself on 49 states",
        "itself on 49 states",
        "its matrix products alone",
        "autograd on all states",
    ]
    assert len(rows) == 8
    assert all(row.ours_s > 0 and row.other_s > 0 and "81 states" in row.work for row in rows)
    assert rows[0].details["demonstrated_pairs"] == 32
    assert rows[1].details["demonstrated_pairs"] == 24
