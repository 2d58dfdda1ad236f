"""Algorithm 4.1's questions: strategies, batches, committees, clusters and intersections."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from irl.advice import Advice
from irl.cluster_queries import select_cluster
from irl.committee import Committee
from irl.demonstrations import Demonstrations
from irl.domains.gridworld import UP
from irl.experts import ClusterAdvice
from irl.function_approx import Learner
from irl.queries import COMMITTEE_STRATEGIES, STATE_STRATEGIES, QueryContext, select_states
from irl.vr_function import VRFunction, torch_generator
from tests.irl.active_runs import CLUSTERS, NETWORKS_SEE, ONE_CORNER, SHORT, WORLD, Guide, run


@pytest.mark.parametrize("strategy", sorted(STATE_STRATEGIES.keys() - COMMITTEE_STRATEGIES))
def test_one_query_a_round_is_algorithm_4_1_step_by_step(strategy):
    config = replace(SHORT, state_query=strategy, budget=4)
    result, _ = run(config, seed=3)

    guide, rng = Guide([], []), np.random.default_rng(3)
    problem = NETWORKS_SEE
    network = VRFunction(2, config.hidden, generator=torch_generator(rng))
    learner = Learner(problem, network)
    labels, advice, asked, advised = ONE_CORNER, Advice.none(49, 4), [], []
    learner.fit(labels, config.initial, rng)
    for _ in range(config.budget):
        context = QueryContext(
            model=WORLD.model,
            q=advice.apply(WORLD.model.q_values(learner.values()), WORLD.model.mask),
            features=problem.features,
            demonstrated=labels.state,
            candidates=np.setdiff1d(np.arange(49), [*labels.state, *asked]),
            beta=config.query_beta,
            start_states=np.arange(49),
            rng=rng,
            ends=np.array([WORLD.goal_state]),  # where the guide always ends
            asked=len(asked),
        )
        asked += select_states(strategy, context).tolist()
        shown = guide.trajectory(asked[-1], rng)
        answer = Demonstrations.from_pairs(shown, trajectory=len(asked))
        labels = Demonstrations.concatenate([labels, answer])
        cluster = select_cluster("masked_entropy", context, CLUSTERS, advised)
        if cluster is not None:
            advised.append(cluster)
            answer = guide.advise(cluster, CLUSTERS[cluster])
            advice = advice.add(CLUSTERS[cluster], answer.preferred, answer.avoided)
        learner.fit(labels, config.refine, rng)
    assert [record.state for record in result.history] == asked
    assert [record.cluster for record in result.history] == [*advised, None, None]
    assert torch.equal(result.network.parameters, network.parameters)
    q = advice.apply(WORLD.model.q_values(learner.values()), WORLD.model.mask)
    assert result.q.tobytes() == q.tobytes()


@pytest.mark.parametrize("strategy", STATE_STRATEGIES)
def test_batches_count_questions_and_never_repeat_one(strategy):
    told = []
    config = replace(SHORT, state_query=strategy, budget=7, batch=3, committee=2)
    result, guide = run(config, callback=told.append)
    assert len(result.history) == len(guide.asked) == len(set(guide.asked)) == 7
    assert [p.query for p in told if p.q is not None] == [0, 3, 6, 7]
    assert sorted(guide.advised) == ["left", "top"]  # one with each of the first two questions
    assert [record.cluster is None for record in result.history] == [False, False] + [True] * 5
    again, _ = run(config)
    assert again.q.tobytes() == result.q.tobytes()
    assert again.history == result.history


def test_a_batch_ends_when_enough_is_demonstrated_or_nothing_is_left():
    result, guide = run(replace(SHORT, budget=40, batch=5, max_demonstrated=9))
    assert result.demonstrations.n_states_demonstrated == 9
    assert len(guide.asked) == len(result.history) < 5
    result, guide = run(replace(SHORT, budget=40, batch=5), candidates=np.array([6, 48, 7]))
    assert sorted(guide.asked) == [6, 7, 48]


@pytest.mark.parametrize("strategy", sorted(COMMITTEE_STRATEGIES))
def test_committees_leave_the_main_network_alone(strategy):
    """With another's questions out of the way, all networks learn the same."""
    options = {"candidates": np.array([48])}
    config = replace(SHORT, budget=1, initial=replace(SHORT.initial, bellman_weight=1.0))
    plain, _ = run(config, **options)
    result, guide = run(replace(config, state_query=strategy, committee=2), **options)
    assert guide.asked == [48]
    assert result.q.tobytes() == plain.q.tobytes()


def test_committee_members_differ_and_weigh_labels_for_good():
    problem = replace(NETWORKS_SEE, fixed_vr={0: 0.5})
    committee = Committee(problem, 3, (8,), np.random.default_rng(0))
    weights = [member.weight.copy() for member in committee.members]
    committee.fit(ONE_CORNER, SHORT.initial)
    f = np.stack([member.values() for member in committee.members])
    assert f.shape == (3, 49)
    assert (f[:, 0] == 0.5).all()
    assert all(np.ptp(f[:, s]) > 0 for s in range(1, 49))
    assert all(np.array_equal(m.weight, w) for m, w in zip(committee.members, weights, strict=True))
    assert min(w.min() for w in weights) > 0


@pytest.mark.parametrize(("weight", "alike"), [(np.full(49, 7.0), True), (np.arange(1, 50), False)])
def test_only_the_proportions_of_label_weights_count(weight, alike):
    problem = NETWORKS_SEE
    f = []
    for weights in (None, weight):
        network = VRFunction(2, (8,), generator=torch.Generator().manual_seed(0))
        learner = Learner(problem, network, weight=weights)
        learner.fit(ONE_CORNER, SHORT.initial, np.random.default_rng(0))
        f.append(learner.values())
    assert np.allclose(*f, atol=1e-5) == alike


def test_intersections_may_be_asked_about():
    class Listener(Guide):
        def advise(self, cluster, states):
            self.advised.append((cluster, states.tolist()))
            return ClusterAdvice(frozenset({UP}), frozenset())

    guide = Listener([], [])
    both = np.intersect1d(CLUSTERS["left"], CLUSTERS["top"])
    result, _ = run(replace(SHORT, cluster_intersections=1), expert=guide)
    assert ("left ∩ top", both.tolist()) in guide.advised
    assert len(guide.advised) == 3
    assert len([record for record in result.history if record.cluster]) == 3
    guide.advised.clear()
    run(replace(SHORT, cluster_intersections=1, smallest_intersection=4), expert=guide)
    assert sorted(name for name, _ in guide.advised) == ["left", "top"]


def test_an_expert_may_speak_of_an_intersection_instead():
    class Chooser(Guide):
        def advise(self, cluster, states):
            self.advised.append(cluster)
            return ClusterAdvice(frozenset({UP}), cluster="top ∩ left")

    guide = Chooser([], [])
    result, _ = run(replace(SHORT, cluster_intersections=0), expert=guide)
    assert sorted(guide.advised) == ["left", "top"]  # and the new one is not asked about
    assert [record.cluster for record in result.history[:3]] == ["top ∩ left"] * 2 + [None]
    both = np.intersect1d(CLUSTERS["left"], CLUSTERS["top"])
    assert np.flatnonzero(result.advice.preferred.any(axis=1)).tolist() == both.tolist()
