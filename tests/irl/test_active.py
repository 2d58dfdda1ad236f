"""Algorithm 4.1: what a run learns, asks and takes in."""

from dataclasses import replace

import numpy as np
import pytest
import torch

import irl.active
import irl.training
from irl.active_state import identity
from irl.demonstrations import Demonstrations
from irl.domains.gridworld import LEFT, RIGHT, UP
from irl.errors import InputError
from irl.function_approx import Learner
from irl.generalisation import Generalisation
from irl.likelihood import LikelihoodProblem
from irl.planning import policy_success
from irl.policy import Policy
from irl.preferences import StatePreferences
from tests.irl.active_runs import CLUSTERS, CONFIG, ONE_CORNER, SHORT, WORLD, Guide, accuracy, run


def test_a_planned_policy_settles_only_where_demonstrations_ended():
    """From one corner's run a network has hilltops of its own; the plan leaves them all."""
    config = replace(CONFIG, budget=0, action_advice=False)
    goal = np.array([WORLD.goal_state])
    reached = {"greedy": [], "planned": []}
    for update, shares in reached.items():
        for seed in range(3):
            result, _ = run(replace(config, policy_update=update), seed)
            act = Policy.from_q(result.q, WORLD.model.mask).action
            shares.append(policy_success(WORLD.model, act, goal, 49).mean())
    assert min(reached["greedy"]) < 1
    assert reached["planned"] == [1, 1, 1]


def test_queries_improve_the_policy_within_budget():
    before, _ = run(replace(CONFIG, budget=0, action_advice=False))
    after, guide = run(replace(CONFIG, action_advice=False))
    assert accuracy(before) < 1
    assert accuracy(after) > accuracy(before)
    assert len(after.history) == len(guide.asked) == 6
    assert not np.isin(guide.asked[0], ONE_CORNER.state)
    assert len(set(guide.asked)) == 6
    # At the goal there is nothing to show.
    labelled = set(after.demonstrations.state.tolist())
    assert set(guide.asked) - {WORLD.goal_state} <= labelled
    assert guide.advised == []
    assert not after.advice.preferred.any()


def test_an_earlier_result_is_gone_on_from_without_training_again():
    first, _ = run(replace(CONFIG, budget=0))
    told = []
    later, guide = run(demonstrations=first, callback=told.append, seed=1)
    assert [each.iteration for each in told if each.query == 0] == [0]
    whole = first.network.values(WORLD.features)
    (begun,) = [each for each in told if each.query == 0]
    assert np.array_equal(begun.q.argmax(axis=1), WORLD.model.q_values(whole).argmax(axis=1))
    assert len(guide.asked) == 6
    assert accuracy(later) > accuracy(first)
    # It stays as it was.
    assert np.array_equal(first.network.values(WORLD.features), whole)


def test_each_cluster_is_asked_once_and_its_advice_applied():
    result, guide = run()
    assert sorted(guide.advised) == ["left", "top"]
    assert [r.cluster for r in result.history] == [*guide.advised, None, None, None, None]
    left = np.setdiff1d(CLUSTERS["left"], np.flatnonzero(WORLD.cells[:, 0] == 0))
    assert (result.q[left, LEFT] == -np.inf).all()
    assert np.isfinite(result.q).any(axis=1).all()
    unadvised = WORLD.model.q_values(result.f)
    np.testing.assert_allclose(
        result.q[left, RIGHT], unadvised[left, RIGHT] + 0.2 * np.abs(unadvised[left, RIGHT])
    )


def test_thesis_constant_for_avoided_actions():
    result, _ = run(replace(CONFIG, budget=2, avoid="thesis"))
    assert result.q[result.advice.avoided & WORLD.model.mask].tolist() == [-2.0] * int(
        (result.advice.avoided & WORLD.model.mask).sum()
    )


def test_most_demonstrated_states_are_never_exceeded():
    counts = []
    result, _ = run(
        replace(CONFIG, budget=50, max_demonstrated=11),
        callback=lambda p: counts.append(p.labels.n_states_demonstrated),
    )
    assert max(counts) == result.demonstrations.n_states_demonstrated == 11
    with pytest.raises(InputError, match="max_demonstrated"):
        run(replace(CONFIG, max_demonstrated=3))


def test_every_answer_counts_and_checkpoints_keep_them_all(tmp_path, monkeypatch):
    config = replace(CONFIG, budget=2, action_advice=False)
    result, guide = run(config)
    walks = [ONE_CORNER.pairs, *(Guide([], []).trajectory(s, None) for s in guide.asked)]
    assert result.demonstrations.pairs == [pair for walk in walks for pair in walk]
    assert len(result.demonstrations) > result.demonstrations.n_states_demonstrated

    fits = []
    fit = Learner.fit

    def dies(self, *args, **kwargs):
        fits.append(args[0])
        if len(fits) == 3:
            raise KeyboardInterrupt
        return fit(self, *args, **kwargs)

    with monkeypatch.context() as patch:
        patch.setattr(Learner, "fit", dies)
        with pytest.raises(KeyboardInterrupt):
            run(config, checkpoint=tmp_path / "run")
    resumed, _ = run(config, checkpoint=tmp_path / "run")
    assert resumed.q.tobytes() == result.q.tobytes()
    assert resumed.demonstrations.pairs == result.demonstrations.pairs


def test_what_a_run_kept_of_one_label_a_state_is_refused_by_name(tmp_path, monkeypatch):
    config = replace(SHORT, budget=1)

    def of_old(*args):
        return {k: v for k, v in identity(*args).items() if k != "labels"}

    with monkeypatch.context() as patch:
        patch.setattr(irl.active, "identity", of_old)
        run(config, checkpoint=tmp_path / "run")
    with pytest.raises(InputError, match=r"run: kept by other work, differing in labels \(nothing"):
        run(config, checkpoint=tmp_path / "run")


def test_one_slip_among_ten_answers_and_the_order_of_rows_do_not_decide():
    """Nine times to the right from a cell of the left border, once up, where a way goes right."""
    cell, n = 21, 10
    runs = [[(cell, RIGHT)]] * 9 + [[(cell, UP)]] + [ONE_CORNER.pairs]
    shown = Demonstrations.from_trajectories(runs)
    config = replace(CONFIG, budget=0)
    q = run(config, demonstrations=shown)[0].q
    rng = np.random.default_rng(1)
    for _ in range(3):
        again = run(config, demonstrations=shown.select(rng.permutation(len(shown))))[0].q
        assert again.tobytes() == q.tobytes()
    assert q[cell].argmax() == RIGHT
    problem = LikelihoodProblem.of(WORLD.model, shown)
    pair = WORLD.model.pair_index(np.array([cell] * 2), np.array([RIGHT, UP]))
    share = problem.label_share[np.searchsorted(problem.seen.rows, pair)]
    assert share.tolist() == [9 / (n + len(ONE_CORNER)), 1 / (n + len(ONE_CORNER))]


def test_generalisation_enters_the_demonstrations():
    shown = [state for state in range(49) if state not in ONE_CORNER.state and state != 48]
    pairs = np.array([(s, Guide([], []).label(s, None)) for s in shown if s != WORLD.goal_state])
    twins = Generalisation(
        state=np.r_[pairs[:, 0], 48].astype(np.int32),
        action=np.r_[pairs[:, 1], LEFT].astype(np.int32),
        group=np.zeros(len(pairs) + 1, dtype=np.int32),
        rule=np.zeros(len(pairs) + 1, dtype=np.uint8),
        rule_names=["alike"],
    )
    plain, _ = run(replace(CONFIG, budget=1), candidates=pairs[:, 0])
    result, _ = run(replace(CONFIG, budget=1), generalisation=twins, candidates=pairs[:, 0])
    assert 48 not in plain.demonstrations.state
    assert (48, LEFT) in result.demonstrations.pairs


def test_runs_that_cannot_be_are_refused_before_and_while_learning():
    glued = Demonstrations.from_pairs([(0, RIGHT), (40, LEFT)])
    with pytest.raises(InputError, match="demonstrations: trajectory 0, step 0: action"):
        run(demonstrations=glued)

    class Leaper(Guide):
        def trajectory(self, state, rng, max_steps=50):
            return [*super().trajectory(state, rng)[:1], (0, RIGHT)]

    guide = Leaper([], [])
    with pytest.raises(InputError, match=r"answer about state \d+: trajectory \d+, step 0"):
        run(demonstrator=guide)
    assert len(guide.asked) == 1


def test_same_seed_same_bits():
    (one, _), (two, _) = run(), run()
    (other, _) = run(seed=1)[0], None
    assert torch.equal(one.network.parameters, two.network.parameters)
    assert np.array_equal(one.q, two.q)
    assert one.history == two.history
    assert not torch.equal(one.network.parameters, other.network.parameters)


def test_preferences_and_pinned_values_shape_f_and_can_be_switched_off():
    preferences = StatePreferences([WORLD.goal_state], [0])
    options = {"preferences": preferences, "fixed_vr": {5: 0.25}}
    config = replace(CONFIG, budget=0)
    result, _ = run(config, **options)
    plain, _ = run(replace(config, state_preferences=False), **options)
    np.testing.assert_allclose(result.f, preferences.apply(plain.f))
    assert plain.f[5] == 0.25


def test_progress_is_told_and_the_loop_ends_when_nothing_is_left():
    told = []
    config = replace(CONFIG, refine=replace(CONFIG.refine, iterations=3), budget=9)
    allowed = np.array([6, 48])
    result, guide = run(config, callback=told.append, candidates=allowed)
    assert sorted(guide.asked) == [6, 48]
    assert len(result.history) == 2
    learnt = [p for p in told if p.q is not None]
    assert [p.query for p in learnt] == [0, 1, 2]
    assert np.array_equal(learnt[-1].q, result.q)
    assert [p.iteration for p in told if p.query == 1] == [1, 2, 3, 3]


def test_learnt_beta_is_carried_on():
    refine = replace(CONFIG.refine, iterations=0)
    config = replace(
        CONFIG, initial=replace(CONFIG.initial, learn_beta=True), refine=refine, budget=1
    )
    result, _ = run(config)
    assert result.beta == result.history[0].beta != 70.0


def test_bellman_term_joins_in():
    config = replace(CONFIG, budget=0, initial=replace(CONFIG.initial, bellman_weight=1.0))
    assert not np.array_equal(run(config)[0].f, run(replace(CONFIG, budget=0))[0].f)
