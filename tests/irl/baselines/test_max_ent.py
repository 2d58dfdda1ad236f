import numpy as np
import pytest
from scipy.optimize import approx_fprime

from irl.baselines.ascent import RidgeConfig
from irl.baselines.max_ent import FeatureMatching, max_ent
from irl.demonstrations import Demonstrations
from irl.demonstrators import PolicyDemonstrator
from irl.domains.gridworld import GridWorld, goal_cell
from irl.errors import InputError
from irl.mdp import TransitionModel
from irl.planning import value_iteration

GAMMA = 0.9


def with_ends(model, ends) -> TransitionModel:
    """The model with one action in each of the states ``ends``, which stays there."""
    entries = model.P.tocoo()
    state, action = model.pair_state[entries.row], model.pair_action[entries.row]
    kept = ~np.isin(state, ends)
    columns = np.stack([state, action, entries.col])[:, kept]
    state, action, after = np.hstack([columns, np.stack([ends, np.zeros_like(ends), ends])])
    p = np.r_[entries.data[kept], np.ones(len(ends))]
    return TransitionModel.from_entries(model.n_states, model.n_actions, state, action, after, p)


def random_walks(model, rng, lengths) -> Demonstrations:
    """One walk of each length, cut short in states without actions."""
    anything = PolicyDemonstrator(model, model.mask)
    return Demonstrations.from_trajectories(
        anything.trajectory(int(rng.integers(model.n_states - 1)), rng, length)
        for length in lengths
    )


@pytest.mark.parametrize("seed", range(3))
def test_gradient_agrees_with_finite_differences(stochastic, seed):
    rng = np.random.default_rng(seed)
    features = rng.normal(size=(stochastic.n_states, 5))
    walks = random_walks(stochastic, rng, [6, 3, 1, 6])
    problem = FeatureMatching.build(stochastic, walks, features, gamma=GAMMA)
    weights = rng.normal(size=5)
    _, gradient = problem.value_and_gradient(weights)
    # Central differences: wide steps, in which what planning leaves open does not show.
    numeric = [
        (problem.value_and_gradient(weights + e)[0] - problem.value_and_gradient(weights - e)[0])
        / 2e-4
        for e in 1e-4 * np.eye(5)
    ]
    np.testing.assert_allclose(gradient, numeric, atol=1e-5)


@pytest.mark.parametrize("gamma", [0.3, 0.9])
@pytest.mark.parametrize("seed", range(4))
def test_agrees_with_causal_entropy_by_brute_force(random_model, seed, gamma):
    """Soft values backwards, visits forwards, from dense tables, move by move."""
    rng = np.random.default_rng(seed)
    model = with_ends(random_model(rng, n_states=9, n_actions=3), [6, 7])
    walks = random_walks(model, rng, [20, 8, 1, 20])
    reward, n = rng.normal(size=9), 9
    P = np.zeros((n, model.n_actions, n))
    P[model.pair_state, model.pair_action] = model.P.toarray()
    V = np.zeros(n)
    for _ in range(400):
        Q = np.where(model.mask, P @ (reward + gamma * V), -np.inf)
        V = np.where(model.mask.any(axis=1), np.logaddexp.reduce(Q, axis=1), 0.0)
    pi = np.where(model.mask, np.exp(Q - V[:, None]), 0.0)

    def entered_from(start):
        here, total = start, np.zeros(n)
        for k in range(400):
            here = np.einsum("s,sa,sat->t", here, pi, P)
            total += gamma**k * here
        return total

    value, surplus = 0.0, np.zeros(n)
    for s, a in walks.pairs:
        value += (Q[s, a] - V[s]) / 4
        demonstrated = P[s, a] + gamma * entered_from(P[s, a])
        surplus += (demonstrated - entered_from(np.eye(n)[s])) / 4
    problem = FeatureMatching.build(model, walks, gamma=gamma)
    found, gradient = problem.value_and_surplus(reward)
    assert found == pytest.approx(value, abs=1e-8)
    np.testing.assert_allclose(gradient, surplus, atol=1e-8)


@pytest.mark.parametrize("seed", range(4))
def test_a_run_cut_at_its_end_teaches_what_it_teaches_padded(random_model, seed):
    rng = np.random.default_rng(seed)
    model = with_ends(random_model(rng, n_states=9, n_actions=3), [5, 6, 7])
    cut, padded = [], []
    while len(cut) < 12:
        state, run = int(rng.integers(5)), []
        while model.widths[state] > 1 and len(run) < 50:
            run.append((state, int(rng.choice(model.actions_of(state)))))
            state = model.sample(*run[-1], rng)
        if run and state in (5, 6, 7):
            cut.append(run)
            padded.append(run + [(state, 0)] * (60 - len(run)))
    R, padded_R = (
        max_ent(model, Demonstrations.from_trajectories(runs), gamma=GAMMA)[0]
        for runs in (cut, padded)
    )
    np.testing.assert_allclose(R, padded_R, atol=1e-4)
    assert np.abs(R).max() > 0.01


def test_the_length_of_a_run_is_an_outcome_of_chance():
    """Action 0 ends the run half of the time, action 1 always, elsewhere; 0 is chosen 3 in 4."""
    model = TransitionModel.from_entries(
        3,
        2,
        np.array([0, 0, 0, 1, 2]),
        np.array([0, 0, 1, 0, 0]),
        np.array([0, 1, 2, 1, 2]),
        np.array([0.5, 0.5, 1.0, 1.0, 1.0]),
    )
    for runs in (
        [[(0, 0)], [(0, 0)], [(0, 0)], [(0, 1)]],
        [[(0, 0), (0, 0)], [(0, 0), (0, 1)]],
        [[(0, 0), (0, 0), (0, 0), (0, 1)]],
    ):
        walks = Demonstrations.from_trajectories(runs)
        R, _ = max_ent(model, walks, gamma=0.5, config=RidgeConfig(l2=1e-9))
        # With π(0 | 0) = 3/4, V(0) = Q(0, 0) + log 4/3; what is gained at the ends, for ever.
        end = R[1:] / (1 - 0.5)
        q = (0.5 * (R[0] + end[0]) + 0.25 * np.log(4 / 3)) / (1 - 0.25)
        assert q - end[1] == pytest.approx(np.log(3), abs=1e-4)


def test_the_objective_is_the_log_likelihood_of_a_trajectory(
    grid, optimal_walks, dense_soft_policies
):
    rng = np.random.default_rng(0)
    reward = rng.normal(size=grid.n_states)
    walks = Demonstrations.concatenate(
        [optimal_walks, Demonstrations.from_pairs([(7, 0), (8, 1), (13, 0)], trajectory=9)]
    )
    walks = walks.select(np.arange(len(walks)) != len(walks) - 2)  # a gap is a cut
    problem = FeatureMatching.build(grid.model, walks, gamma=GAMMA)
    value, gradient = problem.value_and_gradient(reward)

    def log_likelihood(reward):
        policy = dense_soft_policies(grid.model, reward, 300, GAMMA)[-1]
        total = sum(np.log(policy[pair]) for pair in walks.pairs)
        return total / np.unique(walks.trajectory).size

    assert value == pytest.approx(log_likelihood(reward))
    numeric = approx_fprime(reward, log_likelihood, 1e-7)
    np.testing.assert_allclose(gradient, numeric, atol=1e-5)


def test_one_choice_has_its_closed_form():
    fork = TransitionModel.from_entries(
        3, 2, np.array([0, 0]), np.array([0, 1]), np.array([1, 2]), np.ones(2)
    )
    # Chosen 3 times in 4, the learnt rewards differ by log 3; l2 then splits it evenly.
    walks = Demonstrations.concatenate(
        [Demonstrations.from_pairs([(0, a)], trajectory=k) for k, a in enumerate((0, 0, 1, 0))]
    )
    R, weights = max_ent(fork, walks, gamma=GAMMA, config=RidgeConfig(l2=1e-9))
    assert R[1] - R[2] == pytest.approx(np.log(3), abs=1e-5)
    assert R[1] + R[2] == pytest.approx(0.0, abs=1e-5)
    np.testing.assert_array_equal(R, weights)


@pytest.mark.parametrize("grid", [5, 15], indirect=True)
def test_recovers_the_grid(grid, border_walks, share_of_optimum):
    R, _ = max_ent(grid.model, border_walks, gamma=GAMMA)
    # Nobody showed what comes after the goal; going to and fro beside it pays as well.
    apart = np.abs(grid.cells[R.argmax()] - grid.goal).sum()
    assert apart <= 1
    _, Q = value_iteration(grid.model, R, GAMMA)
    assert share_of_optimum(Q.argmax(axis=1)).min() >= 0.99


@pytest.mark.parametrize("grid", [5, 15], indirect=True)
def test_recovers_the_goal_that_ends_a_run(grid, border_walks):
    model = with_ends(grid.model, [grid.goal_state])
    R, _ = max_ent(model, border_walks, gamma=GAMMA)
    assert R.argmax() == grid.goal_state
    _, Q = value_iteration(model, R, GAMMA)
    moves = np.abs(grid.cells - grid.goal).sum(axis=1)
    after = model.P[model.pair_index(np.arange(grid.n_states), Q.argmax(axis=1))].argmax(axis=1)
    assert (moves[np.asarray(after).ravel()] == np.maximum(moves - 1, 0)).mean() >= 0.95


def test_the_solution_matches_the_demonstrated_features(stochastic):
    rng = np.random.default_rng(5)
    features = rng.normal(size=(stochastic.n_states, 3))
    walks = random_walks(stochastic, rng, [4] * 6)
    _, weights = max_ent(stochastic, walks, features, gamma=GAMMA, config=RidgeConfig(l2=0.01))
    problem = FeatureMatching.build(stochastic, walks, features, gamma=GAMMA)
    _, gradient = problem.value_and_gradient(weights)
    np.testing.assert_allclose(gradient, 0.01 * weights, atol=1e-5)


@pytest.mark.parametrize("gamma", [0.5, 0.9])
@pytest.mark.parametrize("n", [5, 9])
def test_plans_by_the_discount_it_learnt_with(n, gamma):
    grid = GridWorld(n, goal_cell(n, "centre"))
    walks = Demonstrations.from_trajectories(grid.trajectories("diagonal"))
    R, _ = max_ent(grid.model, walks, gamma=gamma)
    _, Q = value_iteration(grid.model, R, gamma)
    _, true_Q = value_iteration(grid.model, np.eye(n**2)[grid.goal_state], gamma)
    chosen = true_Q[np.arange(n**2), Q.argmax(axis=1)]
    np.testing.assert_allclose(chosen, true_Q.max(axis=1), atol=1e-9)


def test_bad_arguments_are_named(chain):
    walk = Demonstrations.from_pairs([(0, 1), (1, 1), (2, 1)])
    with pytest.raises(InputError, match="at least one"):
        max_ent(chain, Demonstrations.empty(), gamma=GAMMA)
    with pytest.raises(InputError, match="not feasible"):
        max_ent(chain, Demonstrations.from_pairs([(3, 1)]), gamma=GAMMA)
    with pytest.raises(InputError, match="features"):
        max_ent(chain, walk, np.zeros((3, 2)), gamma=GAMMA)
    for gamma in (1.0, -0.1, np.nan):
        with pytest.raises(InputError, match="gamma"):
            max_ent(chain, walk, gamma=gamma)
