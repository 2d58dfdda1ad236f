import json
from dataclasses import replace

import numpy as np
import pytest
import yaml
from matplotlib.figure import Figure

from experiments.sailing import others, story
from experiments.sailing.learning import STRATEGIES, Learner, ask, measure
from experiments.sailing.others import other_curves
from experiments.sailing.plots import plot_others
from experiments.sailing.story import (
    Config,
    curve,
    first_reached,
    others_result,
    plan_of,
    queries_to_target,
    run_seeds,
)
from irl.baselines.birl import SamplingConfig
from irl.errors import InputError

TINY = ("--size", 3, "--seeds", 2, "--objective-queries", 2, "--qualities", 1, 0,
        "--noise", 0, 0.5, "--noise-queries", 3)  # fmt: skip


@pytest.fixture(scope="module")
def plan():
    return plan_of(Config(size=3, seeds=2, objective_queries=2, qualities=(1.0, 0.0), noise=(0.5,)))


@pytest.fixture(scope="module")
def problem(plan):
    return plan.problem


@pytest.fixture
def learner(plan, problem):
    shown = problem.demonstrate(2, np.random.default_rng(0))
    return Learner(problem.lake, shown, plan.l2, objective=False)


def test_command_leaves_configuration_result_and_figures(tmp_path, command):
    done = command("sailing", *TINY, "--workers", 1, "--out", tmp_path / "run")
    assert done.returncode == 0, done.stderr
    assert {path.name for path in (tmp_path / "run").iterdir()} == {
        "config.yaml", "result.json", "figure_6_1.png", "figure_6_2.png", "noise.png", "policy.png",
    }  # fmt: skip
    assert yaml.safe_load((tmp_path / "run/config.yaml").read_text())["size"] == 3
    result = json.loads((tmp_path / "run/result.json").read_text())
    assert set(result["curves"]) == set(STRATEGIES)
    for name, rows in result["curves"].items():
        assert rows[0][0] == 0
        assert rows[-1][0] == 24 * 8  # every state but those at the goal
        for _, mean, low, high in rows:
            assert low - 1e-9 <= mean <= high + 1e-9
            assert mean <= 1 + 1e-9
        if not name.endswith("cluster"):
            # Whoever has asked about every state sails optimally.
            assert rows[-1][1] == pytest.approx(1)
    starts = {tuple(rows[0]) for rows in result["curves"].values()}
    assert len(starts) == 1  # all strategies begin with the same learners
    ideal, mixed = result["clustering_curves"]["levels"]
    assert ideal["purity"] == 1 > mixed["purity"]
    assert ideal["curve"][-1][1] == pytest.approx(1)
    assert [row[0] for row in result["noise"]["advice"]] == [0, 0.5]
    for entry in result["queries_to_target"].values():
        assert entry["queries"] is None or 0 <= entry["queries"] <= 24 * 8


def test_other_learners_ask_too_if_they_are_asked_for(plan, problem, monkeypatch):
    monkeypatch.setattr(others, "SAMPLING", SamplingConfig(2.0, 1.0, 2, burn_in=10, samples=4))
    shown = problem.demonstrate(2, np.random.default_rng(0))
    asking = replace(plan, advise_queries=3, birl_queries=2)
    runs = [other_curves(asking, problem, shown, seed) for seed in (0, 1)]
    result = others_result(runs)
    queries = {name: [row[0] for row in rows] for name, rows in result["other_curves"].items()}
    assert queries == {
        "advise": [0, 1, 2, 3],
        "advise_random": [0, 1, 2, 3],
        "birl": [0, 1, 2],
        "birl_random": [0, 1, 2],
    }
    for kind in ("advise", "birl"):  # both of a kind begin with the same learner
        first, second = (result["other_curves"][name][0] for name in (kind, f"{kind}_random"))
        assert first == second
    assert all(row[1] <= 1 + 1e-9 for rows in result["other_curves"].values() for row in rows)
    assert result["other_chains"].keys() == {"birl", "birl_random"}
    assert all(len(each["r_hat"]) == 2 for each in result["other_chains"].values())
    plot_others(Figure(), result["other_curves"], result["other_curves"]["advise"], 0.9)


def test_other_learners_are_left_out_by_default(plan, problem):
    shown = problem.demonstrate(2, np.random.default_rng(0))
    assert others_result([other_curves(plan, problem, shown, seed=0)]) == {}


def test_results_do_not_depend_on_the_number_of_workers(plan):
    one, two = (run_seeds(plan, [3, 4], workers) for workers in (1, 2))
    for a, b in zip(one, two, strict=True):
        assert a.keys() == b.keys()
        for name in a:
            np.testing.assert_array_equal(a[name], b[name])


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"size": 2}, "size"),
        ({"seeds": 1}, "seeds"),
        ({"noise": (1.5,)}, "noise"),
        ({"noise": ()}, "noise"),
        ({"qualities": (0.5, 1.0)}, "the first must be 1"),
        ({"prefer_share": 0.0}, "prefer_share"),
        ({"gamma": 1.0}, "gamma"),
        ({"workers": 0}, "workers"),
        ({"l2": 0.0}, "l2"),
        ({"delay": -1.0}, "delay"),
    ],
)
def test_impossible_settings_are_refused_before_any_work(options, words):
    with pytest.raises(InputError, match=words):
        plan_of(Config(**options))


@pytest.mark.parametrize(
    ("arguments", "words"), [(("--gamma", 1), "--gamma: "), (("--wind", "N"), "--wind")]
)
def test_mistakes_are_told_in_one_line_and_leave_nothing(refused, arguments, words):
    assert words in refused(story, *arguments)


def test_help_explains_the_options(command):
    done = command("sailing", "--help")
    assert done.returncode == 0
    assert "--objective-queries" in done.stdout


def test_performance_is_one_for_the_sailor_and_zero_at_random(problem):
    mask, optimal = problem.lake.model.mask, problem.sailor.optimal_actions
    assert problem.performance(optimal.argmax(axis=1)) == pytest.approx(1)
    assert problem.performance(mask / mask.sum(axis=1, keepdims=True)) == pytest.approx(0)
    assert problem.goal_reached(optimal.argmax(axis=1)) > 0.9


@pytest.mark.parametrize("uncertain", [True, False])
def test_every_cluster_is_asked_about_once(problem, learner, uncertain):
    sectors = problem.lake.sectors()
    queries = list(ask(problem, learner, sectors, uncertain, np.random.default_rng(0)))
    assert queries == list(range(1, np.unique(sectors).size))


def test_advice_about_a_state_makes_its_action_optimal_and_leaves_others_alone(problem, learner):
    state = int(problem.lake.starts[0])
    before = learner.policy
    learner.take(np.array([state]), problem.expert.advise("state", np.array([state])))
    assert problem.sailor.optimal_actions[state, learner.policy[state]]
    others = np.delete(np.arange(problem.lake.n_states), state)
    np.testing.assert_array_equal(learner.policy[others], before[others])
    assert learner.uncertainty[state] == pytest.approx(0)


def test_advice_in_the_objective_teaches_about_other_states(plan, problem):
    shown = problem.demonstrate(1, np.random.default_rng(0))
    learner = Learner(problem.lake, shown, plan.l2, objective=True)
    before = learner.q
    state = int(problem.lake.starts[0])
    learner.take(np.array([state]), problem.expert.advise("state", np.array([state])))
    others = np.delete(problem.lake.model.mask, state, axis=0)
    changed = (
        np.delete(learner.q, state, axis=0)[others] != np.delete(before, state, axis=0)[others]
    )
    assert changed.mean() > 0.9


def test_measuring_repeats_the_last_values_when_the_queries_run_out(problem, learner):
    sectors = problem.lake.sectors()
    n = np.unique(sectors).size - 1
    queries = ask(problem, learner, sectors, True, np.random.default_rng(0))
    performance, _ = measure(problem, learner, queries, np.array([0, 1, n, n + 7, n + 9]))
    assert performance.shape == (5,)
    assert performance[2] == performance[3] == performance[4]
    assert performance[2] == problem.performance(learner.policy)


def test_queries_to_target_by_hand():
    points = np.array([0, 1, 2, 4, 8])
    rising = np.array([[0.0, 0.5, 0.9, 1.0, 1.0]] * 3)
    late = np.array([[0.0, 0.0, 0.0, 0.0, 0.95]] * 3)
    never = np.zeros((3, 5))
    assert first_reached(points, rising, 0.9).tolist() == [2, 2, 2]
    assert np.isinf(first_reached(points, never, 0.9)).all()
    found = queries_to_target(
        points, {"random_advice": late, "uncertain_cluster": rising, "random_cluster": never}, 0.9
    )
    assert found["uncertain_cluster"]["queries"] == found["uncertain_cluster"]["high"] == 2
    assert found["random_advice"]["ratio"] == found["random_advice"]["ratio_high"] == 0.25
    assert found["random_cluster"]["queries"] is None
    assert found["random_cluster"]["ratio"] == 0.25  # the budget of 8 stands in


def test_curves_hold_mean_and_interval():
    values = np.array([[0.0, 1.0], [1.0, 1.0]])
    (x, mean, low, high), constant = curve([0, 5], values)
    assert (x, mean, low, high) == (0, 0.5, 0, 1)
    assert constant == [5, 1, 1, 1]
