from dataclasses import replace

import numpy as np
import pytest

from irl.baselines.birl import QUERIES, Posterior, SamplingConfig, active_birl, birl
from irl.baselines.mcmc import split_r_hat
from irl.demonstrations import Demonstrations
from irl.demonstrators import OracleDemonstrator
from irl.errors import InputError
from irl.mdp import TransitionModel
from irl.outcomes import SoftPolicy
from irl.planning import value_iteration
from irl.problem import LearningProblem

GAMMA = 0.9
QUICK = SamplingConfig(burn_in=60, samples=10, thin=2)


def test_agrees_with_integration_on_a_grid(chain):
    # Two weights: what leaving the chain at its end earns, and what every step earns.
    features = np.array([[0.0, 1.0], [0.0, 1.0], [0.0, 1.0], [1.0, 0.0]])
    shown = Demonstrations.from_pairs([(0, 1), (1, 1), (2, 1), (2, 0)])
    beta, scale = 2.0, 1.5
    gamma, axis = 0.6, np.linspace(-6, 6, 26)  # without 0, where actions tie at an edge of bins
    log_p = np.empty((26, 26))
    policies = np.empty((26, 26, chain.n_pairs))
    for i, a in enumerate(axis):
        for j, b in enumerate(axis):
            Q = value_iteration(chain, features @ [a, b], gamma, tolerance=1e-4)[1][:3]
            e = np.exp(beta * (Q - Q.max(axis=1, keepdims=True)))
            pi = e / e.sum(axis=1, keepdims=True)
            log_p[i, j] = np.log(pi[shown.state, shown.action]).sum()
            log_p[i, j] -= (a**2 + b**2) / (2 * scale**2)
            policies[i, j] = pi.ravel()
    p = np.exp(log_p - log_p.max())
    p /= p.sum()
    mean = [(p.sum(axis=1) * axis).sum(), (p.sum(axis=0) * axis).sum()]

    config = SamplingConfig(beta, scale, chains=4, burn_in=100, samples=200, thin=2)
    posterior = birl(
        chain, shown, features, gamma=gamma, rng=np.random.default_rng(0), config=config
    )
    assert posterior.r_hat < 1.05
    assert posterior.effective_samples > 100
    assert (posterior.acceptance > 0.15).all()
    np.testing.assert_allclose(posterior.weights.mean(axis=(0, 1)), mean, atol=0.2)
    expected = np.einsum("ij,ijk->k", p, policies)
    np.testing.assert_allclose(posterior.policy, expected, atol=0.04)
    np.testing.assert_allclose(posterior.reward, features @ posterior.weights.mean(axis=(0, 1)))
    # The histograms, and so the doubt, are those of the same density.
    bins = np.minimum((policies * 10).astype(int), 9)
    share = np.array([[p[bins[..., k] == b].sum() for b in range(10)] for k in range(6)])
    entropy = -(share * np.log(np.maximum(share, 1e-300))).sum(axis=1).reshape(3, 2).mean(axis=1)
    np.testing.assert_allclose(posterior.query_entropy, [*entropy, 0.0], atol=0.15)


def block_features(grid):
    """Indicators of 5 × 5 blocks."""
    block = grid.cells * 5 // grid.n
    return np.eye(25)[block[:, 1] * 5 + block[:, 0]]


@pytest.mark.parametrize("grid", [5, 15], indirect=True)
def test_recovers_the_grid(grid, share_of_optimum_of):
    features = block_features(grid)
    reward = features[:, features[grid.goal_state].argmax()]
    _, Q = value_iteration(grid.model, reward, GAMMA)
    shown = Demonstrations.from_pairs(list(enumerate(Q.argmax(axis=1).tolist())))
    posterior = birl(
        grid.model,
        shown,
        features,
        gamma=GAMMA,
        rng=np.random.default_rng(0),
        config=SamplingConfig(chains=2, burn_in=300, samples=25, thin=3),
    )
    _, Q = value_iteration(grid.model, posterior.reward, GAMMA)
    assert share_of_optimum_of(reward, Q.argmax(axis=1)).min() >= 0.99


def fork(n: int) -> TransitionModel:
    """From each of n states the actions 0 and 1 enter the ends n and n + 1, or two of its own."""
    state = np.repeat(np.arange(n), 2)
    after = np.array([[n, n + 1]] * (n - 1) + [[n + 2, n + 3]]).ravel()
    return TransitionModel.from_entries(n + 4, 2, state, np.tile([0, 1], n), after, np.ones(2 * n))


def test_doubt_is_where_nothing_is_known():
    model = fork(4)  # 0, 1, 2 share their ends, 3 has its own
    shown = Demonstrations.from_pairs([(0, 0)] * 5)
    config = SamplingConfig(beta=5.0, burn_in=100, samples=50, thin=3)
    posterior = birl(model, shown, gamma=GAMMA, rng=np.random.default_rng(0), config=config)
    doubt = posterior.query_entropy
    np.testing.assert_allclose(doubt[1:3], doubt[0])
    assert doubt[3] > 1.3 * doubt[0]
    assert not doubt[4:].any()


def test_the_doubtful_state_is_asked_about_first():
    model = fork(4)
    oracle = OracleDemonstrator(model, np.array([6]))
    *_, (posterior, shown) = active_birl(
        LearningProblem(model, gamma=GAMMA),
        Demonstrations.from_pairs([(0, 0)] * 5),
        oracle,
        budget=1,
        rng=np.random.default_rng(0),
        config=SamplingConfig(beta=5.0, burn_in=100, samples=50, thin=3),
    )
    assert shown.pairs[-1] == (3, 0)
    assert posterior.policy.reshape(4, 2)[3, 0] > 0.6


def test_no_state_is_asked_twice_and_the_budget_holds():
    model, oracle = fork(4), OracleDemonstrator(fork(4), np.array([4, 6]))
    start = Demonstrations.from_pairs([(0, 0)])

    def asked(candidates=None, **options):
        problem = LearningProblem(model, gamma=GAMMA, candidates=candidates)
        given = {"rng": np.random.default_rng(1), "config": QUICK} | options
        states = [
            shown.state[1:].tolist() for _, shown in active_birl(problem, start, oracle, **given)
        ]
        # Each answer joins those before.
        assert states == [states[-1][:n] for n in range(len(states))]
        return states[-1]

    for query in QUERIES:
        assert sorted(asked(budget=10, query=query)) == [1, 2, 3]
    assert len(asked(budget=2)) == 2
    assert asked(budget=3, candidates=np.array([0, 2])) == [2]
    assert asked(budget=0) == []


def test_the_same_seed_draws_the_same(chain):
    shown = Demonstrations.from_pairs([(0, 1)])
    first, second, other = (
        birl(chain, shown, gamma=GAMMA, rng=np.random.default_rng(s), config=QUICK)
        for s in (0, 0, 1)
    )
    np.testing.assert_array_equal(first.weights, second.weights)
    assert not np.array_equal(first.weights, other.weights)


def test_chains_start_where_they_are_told(chain):
    start = np.arange(16.0).reshape(4, 4) / 10
    config = replace(QUICK, burn_in=0, samples=4, thin=1, beta=1e-9)
    posterior: Posterior = birl(
        chain,
        Demonstrations.from_pairs([(0, 1)]),
        gamma=GAMMA,
        rng=np.random.default_rng(0),
        config=config,
        start=start,
    )
    # With nothing learnt every proposal is taken: half a prior draw, and √¾ of the start.
    rest = posterior.weights[:, 0] - np.sqrt(0.75) * start
    assert (np.abs(rest) < 0.5 * 4).all()
    assert (posterior.acceptance == 1).all()


def test_bad_arguments_are_named(chain):
    rng = np.random.default_rng(0)
    with pytest.raises(InputError, match="at least one"):
        birl(chain, Demonstrations.empty(), gamma=GAMMA, rng=rng)
    with pytest.raises(InputError, match="infeasible"):
        birl(chain, Demonstrations.from_pairs([(3, 1)]), gamma=GAMMA, rng=rng)
    with pytest.raises(InputError, match="gamma"):
        birl(chain, Demonstrations.from_pairs([(0, 1)]), gamma=1.0, rng=rng)
    with pytest.raises(
        InputError, match="query: unknown name 'any'; valid: policy_entropy, random"
    ):
        next(
            active_birl(
                LearningProblem(chain, gamma=GAMMA),
                Demonstrations.from_pairs([(0, 1)]),
                OracleDemonstrator(chain, np.array([3])),
                budget=1,
                rng=rng,
                query="any",
            )
        )


def test_chains_agree_where_many_labels_leave_little_room(random_model):
    # Of a demonstrator that does what the method takes it to do: π ∝ exp(β Q) of a known reward.
    rng = np.random.default_rng(0)
    model, beta = random_model(rng, 12), 5.0
    _, Q = value_iteration(model, rng.standard_normal(12), GAMMA)
    pi = SoftPolicy.from_q(Q, model.mask, beta=beta).probability
    labels = [
        (s, int(rng.choice(model.n_actions, p=pi[s]))) for s in model.acting for _ in range(400)
    ]
    shown = Demonstrations.from_labels(labels)
    config = SamplingConfig(beta, burn_in=100, samples=60, thin=3)
    posterior = birl(model, shown, gamma=GAMMA, rng=np.random.default_rng(0), config=config)
    assert posterior.r_hat <= 1.05
    assert split_r_hat(posterior.weights).max() <= 1.05
    # 400 draws tell a probability to 0.025 at most; six of them are beyond chance.
    np.testing.assert_allclose(posterior.policy, pi[model.pair_state, model.pair_action], atol=0.08)
