import numpy as np
import pytest

from irl.demonstrations import Demonstrations
from irl.demonstrators import OracleDemonstrator, PolicyDemonstrator, RecordedDemonstrator
from irl.errors import InputError
from irl.experts import ClusterAdvice, MistakenExpert, OracleExpert
from irl.mdp import TransitionModel

# A square 0–1–3, 0–2–3 with the goal at 3 and a trap at 4: two ways of equal length.
# (state, action) → next state, certain; action 2 falls into the trap.
SQUARE = {(0, 0): 1, (0, 1): 2, (1, 0): 3, (2, 0): 3, (1, 1): 0, (2, 1): 0, (0, 2): 4, (3, 0): 0}


@pytest.fixture
def square() -> TransitionModel:
    state, action = np.array(list(SQUARE)).T
    return TransitionModel.from_entries(
        5, 3, state, action, np.array(list(SQUARE.values())), np.ones(len(SQUARE))
    )


@pytest.fixture
def oracle(square) -> OracleDemonstrator:
    return OracleDemonstrator(square, np.array([3]), lost_states=np.array([4]))


def test_both_of_two_equal_ways_are_optimal(oracle):
    expected = np.zeros((5, 3), dtype=bool)
    expected[0, [0, 1]] = expected[[1, 2], 0] = True
    np.testing.assert_array_equal(oracle.optimal_actions, expected)
    assert oracle.terminal.tolist() == [False, False, False, True, True]


def test_discomfort_breaks_the_tie(square):
    oracle = OracleDemonstrator(square, np.array([3]), uncomfortable=np.array([1]))
    assert oracle.optimal_actions[0].tolist() == [False, True, False]


def test_a_demonstrator_who_dislikes_surprise_takes_the_sure_way():
    # 0 to the goal 3 at once with probability 0.6, else back; or surely, through 1.
    entries = [(0, 0, 3, 0.6), (0, 0, 0, 0.4), (0, 1, 1, 1.0), (1, 0, 3, 1.0)]
    state, action, after, p = (np.array(column) for column in zip(*entries, strict=True))
    model = TransitionModel.from_entries(4, 2, state, action, after, p)
    choice = {
        surprise: OracleDemonstrator(model, np.array([3]), surprise=surprise).optimal_actions[0]
        for surprise in (0.0, 0.5)
    }
    assert choice[0.0].tolist() == [True, False]
    assert choice[0.5].tolist() == [False, True]


def test_ties_are_drawn_evenly_and_repeat_with_the_seed(oracle):
    drawn = [oracle.label(0, rng) for rng in [np.random.default_rng(0)] for _ in range(1000)]
    assert abs(np.mean(drawn) - 0.5) < 0.07
    again = [oracle.label(0, rng) for rng in [np.random.default_rng(0)] for _ in range(1000)]
    assert drawn == again


def test_label_noise_gives_wrong_feasible_actions_at_its_rate(square):
    oracle = OracleDemonstrator(square, np.array([3]), label_noise=0.3)
    rng = np.random.default_rng(0)
    labels = [oracle.label(0, rng) for _ in range(2000)]
    assert abs(np.mean(np.array(labels) == 2) - 0.3) < 0.045
    # Where every feasible action is co-optimal there is no wrong one.
    only = TransitionModel.from_entries(2, 1, *(np.array([k]) for k in (0, 0, 1)), np.ones(1))
    assert OracleDemonstrator(only, np.array([1]), label_noise=1.0).label(0, rng) == 0


def test_a_trajectory_ends_at_the_goal_or_at_its_length(oracle):
    rng = np.random.default_rng(1)
    way = oracle.trajectory(0, rng)
    assert way in ([(0, 0), (1, 0)], [(0, 1), (2, 0)])
    assert len(oracle.trajectory(0, rng, max_steps=1)) == 1
    assert oracle.trajectory(3, rng) == []
    assert oracle.trajectory(4, rng) == []


def test_there_is_nothing_to_label_where_a_run_ends(oracle):
    with pytest.raises(InputError, match="state 3"):
        oracle.label(3, np.random.default_rng(0))


@pytest.mark.parametrize("wrong", [{"label_noise": 1.5}, {"tolerance": 0.0}])
def test_bad_numbers_are_named(square, wrong):
    with pytest.raises(InputError, match=next(iter(wrong))):
        OracleDemonstrator(square, np.array([3]), **wrong)


def test_trajectories_of_the_chain_reach_the_goal(chain):
    oracle = OracleDemonstrator(chain, np.array([3]))
    for seed in range(20):
        way = oracle.trajectory(0, np.random.default_rng(seed))
        assert way[-1] == (2, 1)
        assert all(action == 1 for _, action in way)


def test_a_policy_is_followed_until_it_has_no_action(square):
    actions = np.zeros((5, 3), dtype=bool)
    actions[0, :2] = actions[1, 0] = True
    guide = PolicyDemonstrator(square, actions)
    rng = np.random.default_rng(0)
    drawn = [guide.label(0, rng) for _ in range(1000)]
    assert abs(np.mean(drawn) - 0.5) < 0.07
    ways = [guide.trajectory(0, rng) for _ in range(20)]
    # By 1 or by 2; in 2 nothing is marked.
    assert {tuple(way) for way in ways} == {((0, 0), (1, 0)), ((0, 1),)}
    assert guide.trajectory(0, rng, max_steps=0) == []
    with pytest.raises(InputError, match="no action in state 2"):
        guide.label(2, rng)


def test_expert_prefers_what_is_mostly_good_and_avoids_what_never_is(oracle):
    expert = OracleExpert(oracle, np.array([0]), prefer_share=0.9)
    # In 1 and 2, action 0 is optimal and action 1 never; action 2 isn't feasible there.
    assert expert.advise("sides", np.array([1, 2])) == ClusterAdvice(frozenset({0}), frozenset({1}))
    # Over 0, 1, 2: action 0 always, 1 in one of three, 2 never where feasible. States where a
    # run ends don't count.
    assert expert.advise("all", np.arange(5)) == ClusterAdvice(frozenset({0}), frozenset({2}))
    looser = OracleExpert(oracle, np.array([0]), prefer_share=0.9, avoid_share=0.4)
    assert looser.advise("all", np.arange(5)).avoided == {1, 2}


def test_expert_keeps_silent_about_states_that_don_t_count(oracle):
    assert OracleExpert(oracle, np.array([0])).advise("end", np.array([3, 4])) == ClusterAdvice()
    # From 4 nothing else can be reached.
    assert OracleExpert(oracle, np.array([4])).advise("all", np.arange(5)) == ClusterAdvice()
    assert OracleExpert(oracle, np.array([0])).advise("no", np.zeros(0, int)) == ClusterAdvice()


def test_no_action_is_both_preferred_and_avoided(oracle):
    with pytest.raises(InputError, match=r"actions \[2\] are both"):
        ClusterAdvice(frozenset({1, 2}), frozenset({2}))
    with pytest.raises(InputError, match="avoid_share < prefer_share"):
        OracleExpert(oracle, np.array([0]), prefer_share=0.3, avoid_share=0.3)


def test_a_mistaken_expert_is_wrong_as_often_as_told_and_wants_avoided_what_is_right(oracle):
    right = OracleExpert(oracle, np.array([0]), prefer_share=0.9)
    every, rng = np.arange(5), np.random.default_rng(0)
    assert MistakenExpert(right, 0.0, rng).advise("all", every) == right.advise("all", every)
    expert = MistakenExpert(right, 0.3, rng)
    said = [expert.advise("all", every) for _ in range(400)]
    wrong = [answer for answer in said if answer != right.advise("all", every)]
    assert 0.22 < len(wrong) / len(said) < 0.38
    # 0 and 1 are right somewhere, 2 nowhere: half of the ones avoided, the other preferred.
    assert all(answer.preferred == {2} for answer in wrong)
    assert {tuple(sorted(answer.avoided)) for answer in wrong} == {(), (0,), (0, 1), (1,)}
    assert MistakenExpert(right, 1.0, rng).advise("end", np.array([3, 4])) == ClusterAdvice()
    with pytest.raises(InputError, match="wrong"):
        MistakenExpert(right, 1.5, rng)


def test_recorded_demonstrator_repeats_and_knows_its_limits():
    recording = Demonstrations.concatenate(
        [
            Demonstrations.from_pairs([(0, 1), (1, 1), (2, 1)], trajectory=0),
            Demonstrations.from_pairs([(5, 0), (1, 0)], trajectory=1),
            Demonstrations.from_pairs([(7, 0)], trajectory=0, source="generalised"),
        ]
    )
    recorded = RecordedDemonstrator(recording)
    rng = np.random.default_rng(0)
    assert recorded.states.tolist() == [0, 1, 2, 5, 7]
    assert recorded.label(1, rng) == 1
    assert recorded.trajectory(1, rng) == [(1, 1), (2, 1)]
    assert recorded.trajectory(5, rng, max_steps=1) == [(5, 0)]
    assert recorded.trajectory(9, rng) == []
    with pytest.raises(InputError, match="no label for state 9; 5 states are recorded"):
        recorded.label(9, rng)
