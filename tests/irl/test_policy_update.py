"""A policy that settles only where demonstrations ended."""

import numpy as np
import pytest

from irl.active_config import ActiveConfig
from irl.advice import Advice
from irl.mdp import TransitionModel
from irl.metrics import success_mdp
from irl.planning import policy_success, value_iteration
from irl.policy import Policy
from irl.policy_update import PolicyUpdate, planned_values

N, GAMMA = 12, 0.9


@pytest.fixture
def corridor() -> TransitionModel:
    """Twelve rooms; action 0 goes left, 1 right."""
    room = np.arange(N)
    state, after = np.r_[room[1:], room[:-1]], np.r_[room[:-1], room[1:]]
    action = np.repeat([0, 1], N - 1)
    return TransitionModel.from_entries(N, 2, state, action, after, np.ones(2 * (N - 1)))


def acted(model: TransitionModel, f: np.ndarray) -> np.ndarray:
    return Policy.from_q(model.q_values(f), model.mask).action


def hilly() -> np.ndarray:
    """The values of a goal in room 11 at a cost of 0.02 a step, and a hilltop in rooms 2 and 3."""
    f = 0.9 * GAMMA ** np.arange(N)[::-1] - 0.02 * np.arange(N)[::-1]
    f[[2, 3]] += 0.25
    return f


def test_a_hilltop_where_nobody_stayed_no_longer_holds_the_policy(corridor):
    f, goal, starts = hilly(), np.array([N - 1]), np.arange(N - 1)
    assert success_mdp(corridor, acted(corridor, f), goal, starts) < 0.7
    planned = planned_values(corridor, f, GAMMA, goal)
    assert success_mdp(corridor, acted(corridor, planned), goal, starts) == 1
    assert (planned <= f + 1e-12).all()
    assert planned[goal] == f[goal]


def test_without_an_end_every_hilltop_may_be_meant(corridor):
    f = hilly()
    assert (planned_values(corridor, f, GAMMA, np.array([], dtype=int)) == f).all()


def test_where_somebody_stayed_a_hilltop_remains(corridor):
    planned = planned_values(corridor, hilly(), GAMMA, np.array([3, N - 1]))
    assert acted(corridor, planned)[[0, 2, 4, 10]].tolist() == [1, 1, 0, 1]


def test_what_f_says_a_state_costs_remains():
    """Two ways from 0 to the end 4, by 1 or by 2 and 3: 1 costs too much to be short."""
    entries = np.array([(0, 0, 1), (0, 1, 2), (1, 0, 4), (2, 0, 3), (3, 0, 4)])
    model = TransitionModel.from_entries(5, 2, *entries.T, np.ones(5))
    reward = np.array([-0.1, -0.5, -0.1, -0.1, 0.0])
    V, _ = value_iteration(
        model, np.eye(5)[4], GAMMA, reward[model.pair_state], terminal=np.array([4])
    )
    V[4] = 1 / GAMMA  # entering is worth 1
    planned = planned_values(model, V, GAMMA, np.array([4]))
    np.testing.assert_allclose(planned, V, atol=1e-9)
    assert acted(model, planned)[0] == 1


def test_the_plan_does_without_what_is_excluded():
    """From 0 by 1 or by 2 to the end 3; f likes 1 better, from where the way on is excluded."""
    entries = np.array([(0, 0, 1), (0, 1, 2), (1, 0, 3), (1, 1, 0), (2, 0, 3)])
    model = TransitionModel.from_entries(4, 2, *entries.T, np.ones(5))
    f, end = np.array([0.4, 0.6, 0.5, 1.0]), np.array([3])
    excluded = np.zeros((4, 2), dtype=bool)
    excluded[1, 0] = True
    for planned, reached in ((f, 0.0), (planned_values(model, f, GAMMA, end), 0.0)):
        q = np.where(excluded, -np.inf, model.q_values(planned))
        assert policy_success(model, Policy.from_q(q, model.mask).action, end, 9)[0] == reached
    planned = planned_values(model, f, GAMMA, end, excluded=excluded)
    q = np.where(excluded, -np.inf, model.q_values(planned))
    assert policy_success(model, Policy.from_q(q, model.mask).action, end, 9)[0] == 1


def test_caution_goes_into_the_plan(corridor):
    """Without a toss-up there is nothing to be cautious of; with one, it costs what it costs."""
    f = hilly()
    same = planned_values(corridor, f, GAMMA, np.array([N - 1]), caution=3.0)
    np.testing.assert_allclose(same, planned_values(corridor, f, GAMMA, np.array([N - 1])))
    P = np.zeros((3, 1, 3))
    P[0, 0, [1, 2]] = 0.5
    P[1, 0, 2] = 1
    toss = TransitionModel.from_dense(P, P.sum(axis=2) > 0)
    f = np.array([0.2, 0.4, 1.0])
    # R(0) = 0.2 - 0.9 (0.7 - 0.5 u), R(1) = 0.4 - 0.9; the median caps the larger.
    u = 0.4
    R = np.array([0.2 - 0.9 * (0.7 - 0.5 * u), -0.5])
    R = np.minimum(R, np.median(R))
    V1 = R[1] + 0.9
    V0 = R[0] + 0.9 * (0.5 * V1 + 0.5 - 0.5 * u)
    planned = planned_values(toss, f, GAMMA, np.array([2]), caution=u)
    np.testing.assert_allclose(planned, [V0, V1, 1.0], atol=1e-9)


def told(
    model: TransitionModel, f: np.ndarray, avoided, avoid: str = ActiveConfig().avoid
) -> np.ndarray:
    """The policy with actions avoided in states, as (states, actions)."""
    advice = Advice.none(model.n_states, model.n_actions)
    for states, actions in avoided:
        advice = advice.add(states, [], actions)
    update = PolicyUpdate(model, GAMMA, "planned", avoid)
    q = update.q(f, 0.0, advice, np.array([model.n_states - 1]))
    return Policy.from_q(q, model.mask).action


def test_advice_that_costs_the_way_to_the_end_is_not_heeded(corridor):
    """To go right avoided in rooms 5 and 6: neither they nor the rooms before get to the end."""
    f, end = 0.9 * GAMMA ** np.arange(N)[::-1], np.array([N - 1])
    wrong = [([5, 6], [1])]
    heeded = np.where(np.isin(np.arange(N), [5, 6]), 0, 1)
    assert policy_success(corridor, heeded, end, 20)[:7].max() == 0
    assert told(corridor, f, wrong)[:-1].tolist() == [1] * (N - 1)
    # The thesis' way obeys; and so does everybody where no way is lost.
    assert told(corridor, f, wrong, "thesis")[[5, 6]].tolist() == [0, 0]
    assert told(corridor, f, [([8], [0])])[:-1].tolist() == [1] * (N - 1)


@pytest.mark.parametrize("avoid", ["mask", "doubt"])
@pytest.mark.parametrize(("dearer", "first"), [(0.03, (1, 1)), (0.09, (1, 0))])
def test_what_costs_nearly_an_action_more_is_obeyed_or_doubted(avoid, dearer, first):
    """From 0 to the end 3 by 1 or by 2, which is dearer; an action more costs 0.1."""
    entries = np.array([(0, 0, 1), (0, 1, 2), (1, 0, 3), (2, 0, 3)])
    model = TransitionModel.from_entries(4, 2, *entries.T, np.ones(4))
    f = np.array([GAMMA**2, GAMMA, GAMMA - dearer, 1.0])
    assert told(model, f, [])[0] == 0
    assert told(model, f, [([0], [0])], avoid)[0] == first[avoid == "doubt"]
    assert told(model, f, [([0], [0])])[0] == first[1]  # by default
