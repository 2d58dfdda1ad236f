"""What labels say, beside the formula written out, label by label."""

from itertools import product

import numpy as np
import pytest

from irl.demonstrations import Demonstrations
from irl.demonstrators import OracleDemonstrator
from irl.domains.gridworld import GridWorld
from irl.posterior.evidence import ALIKE, BETAS, EPSILONS, HABIT, Evidence
from irl.posterior.learner import GoalConfig, GoalLearner
from irl.problem import LearningProblem

N = 5
MODEL = GridWorld(N, (0, 0)).model
NO_GOAL = np.zeros((MODEL.n_states, 1), dtype=bool)
STATES = np.arange(MODEL.n_states)


def labelled(pairs):
    return Demonstrations.from_pairs(pairs, 0)


def written_out(q, costs, pairs):
    """``[betas, epsilons]``: the sum over habits of the product over labels, nothing shared."""
    table, effort = MODEL.table(q), [MODEL.table(cost) for cost in costs.T]
    total = np.zeros((BETAS.size, EPSILONS.size))
    for (b, beta), (e, epsilon) in product(enumerate(BETAS), enumerate(EPSILONS)):
        for habit in [None, *range(len(effort))]:
            p = 1 - HABIT if habit is None else HABIT / len(effort)
            for state, action in pairs:
                can = MODEL.actions_of(state)
                share = np.exp(beta * (table[state, can] - table[state, can].max()))
                share /= share.sum()
                if habit is not None:
                    good = table[state, can] >= table[state, can].max() - ALIKE
                    own = effort[habit][state, can]
                    others = sum(each[state, can] for each in effort) - own
                    least = min((own[k], others[k]) for k in np.flatnonzero(good))
                    first = good & [pair == least for pair in zip(own, others, strict=True)]
                    share = np.where(good, share[good].sum() * first / first.sum(), share)
                p *= (1 - epsilon) * share[list(can).index(action)] + epsilon / len(can)
            total[b, e] += p
    return np.log(total)


def drawn(seed, n_costs):
    """Values with many ties, costs of whole numbers, and labels."""
    rng = np.random.default_rng(seed)
    q = rng.integers(0, 2, MODEL.n_pairs) * 0.02
    costs = rng.integers(0, 2, (MODEL.n_pairs, n_costs)).astype(float)
    states = rng.choice(STATES, 6, replace=False)
    return q, costs, [(int(s), int(rng.choice(MODEL.actions_of(s)))) for s in states]


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("n_costs", [2, 3])
def test_labels_are_as_likely_as_the_formula_says(seed, n_costs):
    q, costs, pairs = drawn(seed, n_costs)
    evidence = Evidence.of(MODEL, labelled(pairs), costs)
    said = evidence.log_likelihood(q[evidence.pairs, None], NO_GOAL)
    np.testing.assert_allclose(said[0], written_out(q, costs, pairs), rtol=1e-9)


@pytest.mark.parametrize("n_costs", [0, 1, 3])
def test_what_may_be_said_in_a_state_is_a_distribution(n_costs):
    q, costs, _ = drawn(5, n_costs)
    for state in STATES[:8]:
        total = 0.0
        for action in MODEL.actions_of(state):
            evidence = Evidence.of(MODEL, labelled([(int(state), int(action))]), costs)
            total += np.exp(evidence.log_likelihood(q[evidence.pairs, None], NO_GOAL))
        np.testing.assert_allclose(total, 1.0, rtol=1e-12)


def test_a_habit_is_not_taken_for_a_cost():
    """Who goes down first of two ways that are equally long does not mind going right."""
    row, column = np.divmod(STATES, N)
    sideways = MODEL.P @ column.astype(float) != column[MODEL.pair_state]
    problem = LearningProblem(MODEL, gamma=0.95, costs={"sideways": sideways.astype(float)})
    goal = N * N - 1
    oracle = OracleDemonstrator(MODEL, np.array([goal]), gamma=0.95, action_cost=0.01)
    effort = MODEL.table(sideways.astype(float))
    effort[~oracle.optimal_actions] = np.inf
    between = [int(s) for s in STATES if row[s] < N - 1 and column[s] < N - 1]
    answers = [
        Demonstrations.from_pairs([(s, int(effort[s].argmin()))], run)
        for run, s in enumerate(between)
    ]
    ended = Demonstrations.from_pairs([], len(answers), end=goal)
    shown = Demonstrations.concatenate([*answers, ended])
    learner = GoalLearner(problem, rng=np.random.default_rng(0), config=GoalConfig(rounds=2))
    learner.learn(shown)
    belief = learner.belief
    assert belief.weight[belief.level[:, 0] > 0].sum() < 0.5

    belief.evidence = Evidence.of(MODEL, shown)  # as if nobody had habits
    belief.log_likelihood = belief._weigh(belief.goal, belief.level, belief.f)
    assert belief.weight[belief.level[:, 0] > 0].sum() > 0.9
