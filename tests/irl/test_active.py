from dataclasses import dataclass, replace

import numpy as np
import pytest
import torch

from irl.active import ActiveConfig, active_fa_mlirl
from irl.demonstrations import Demonstrations
from irl.demonstrators import ClusterAdvice
from irl.domains.gridworld import DOWN, LEFT, RIGHT, UP, GridWorld
from irl.errors import InputError
from irl.preferences import StatePreferences
from irl.training import TrainingConfig

torch.set_num_threads(1)  # networks this small gain nothing from more

WORLD = GridWorld(7, (3, 3))
CONFIG = ActiveConfig(
    initial=TrainingConfig(iterations=200, step=0.01, beta=70.0, schedule="none"),
    refine=TrainingConfig(iterations=100, step=0.01, beta=70.0, schedule="none"),
    budget=6,
    query_beta=70.0,
    hidden=(16, 16),
)
CLUSTERS = {"left": np.flatnonzero(WORLD.cells[:, 0] < 3), "top": np.arange(42, 49)}
ONE_CORNER = Demonstrations.from_pairs(WORLD.trajectories("diagonal")[0])


@dataclass
class Guide:
    """Walks to the goal, and knows what to do left of it and at the top."""

    asked: list[int]
    advised: list[str]

    def label(self, state, rng):
        dx, dy = np.array(WORLD.goal) - WORLD.cells[state]
        return (RIGHT if dx > 0 else LEFT) if dx else (UP if dy > 0 else DOWN)

    def trajectory(self, state, rng, max_steps=50):
        self.asked.append(state)
        pairs = []
        while state != WORLD.goal_state:
            pairs.append((int(state), self.label(state, rng)))
            state = WORLD.model.P.indices[WORLD.model.pair_index(*pairs[-1])]
        return pairs

    def advise(self, cluster, states):
        self.advised.append(cluster)
        assert states is CLUSTERS[cluster]
        avoided, preferred = {"left": (LEFT, RIGHT), "top": (UP, DOWN)}[cluster]
        return ClusterAdvice(frozenset({preferred}), frozenset({avoided}))


def run(config=CONFIG, seed=0, **changes):
    guide = Guide([], [])
    options = {
        "model": WORLD.model,
        "features": WORLD.features,
        "gamma": 0.9,
        "fixed_vr": {},
        "demonstrations": ONE_CORNER,
        "demonstrator": guide,
        "expert": guide,
        "clusters": CLUSTERS,
        "preferences": StatePreferences(),
        "generalise": lambda demonstrations: demonstrations,
        "config": config,
        "rng": np.random.default_rng(seed),
    }
    return active_fa_mlirl(**(options | changes)), guide


def accuracy(result):
    return WORLD.accuracy(result.q.argmax(axis=1))


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


def test_generalisation_enters_the_demonstrations():
    def twin(demonstrations):
        extra = Demonstrations.from_pairs([(48, LEFT)], source="generalised")
        return demonstrations.merge(extra)

    result, _ = run(replace(CONFIG, budget=1), generalise=twin)
    assert 48 in result.demonstrations.state


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


@pytest.mark.parametrize(
    ("options", "message"),
    [
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
