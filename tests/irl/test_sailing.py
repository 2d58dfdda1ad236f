import numpy as np
import pytest

from irl.domains.sailing import (
    DIRECTIONS,
    HEADINGS,
    LEG_TIMES,
    NEUTRAL,
    PORT,
    STARBOARD,
    Sailing,
    ideal_clusters,
    point_of_sail,
    purity,
    shuffled_clusters,
    tack_of,
    wind_chain,
)
from irl.errors import InputError
from irl.planning import uniform_policy, value_iteration

GAMMA = 0.95
N, NE, E, SE, S, SW, W, NW = range(8)
MIRROR = -np.arange(8) % 8  # east and west exchanged


@pytest.fixture(scope="module")
def lake():
    return Sailing(5)


@pytest.fixture(scope="module")
def plan(lake):
    """Optimal discounted minutes ``[n_states]`` and costs-to-go ``[n_states, 8]``."""
    V, Q = value_iteration(
        lake.model, np.zeros(lake.n_states), GAMMA, -lake.leg_times, lake.goal_states
    )
    return -V, -Q


def test_wind_chain_turns_by_at_most_45_degrees_and_mirrors_east_and_west():
    chain = wind_chain()
    np.testing.assert_allclose(chain.sum(axis=1), 1)
    turn = (np.arange(8) - np.arange(8)[:, None]) % 8
    assert ((chain > 0) == np.isin(turn, [0, 1, 7])).all()
    np.testing.assert_array_equal(chain, chain[np.ix_(MIRROR, MIRROR)])


def test_stationary_winds_mirror_and_balance_in_detail():
    chain = wind_chain()
    share = np.linalg.matrix_power(chain, 2000)[0]
    np.testing.assert_allclose(share @ chain, share)
    np.testing.assert_allclose(share, share[MIRROR])
    flow = share[:, None] * chain
    np.testing.assert_allclose(flow, flow.T)
    assert share[N] > share[S]


def test_points_of_sail_and_tacks():
    # The wind blows towards N, so it comes from S.
    assert point_of_sail(np.arange(8), N).tolist() == [4, 3, 2, 1, 0, 1, 2, 3]
    assert tack_of(E, N) == STARBOARD  # heading east, the south lies to the right
    assert tack_of(W, N) == PORT
    assert tack_of(N, N) == NEUTRAL
    # Neither depends on where north is.
    heading, wind = np.meshgrid(np.arange(8), np.arange(8))
    for turned in range(8):
        for function in (point_of_sail, tack_of):
            np.testing.assert_array_equal(
                function(heading, wind), function((heading + turned) % 8, (wind + turned) % 8)
            )


def test_index_numbers_every_state_once(lake):
    np.testing.assert_array_equal(lake.index(*lake.states.T), np.arange(lake.n_states))


def test_legs_stay_on_the_lake_and_out_of_the_wind(lake):
    model = lake.model
    start, heading = lake.states[model.pair_state], model.pair_action
    assert (point_of_sail(heading, start[:, 2]) > 0).all()
    there = start[:, :2] + HEADINGS[heading]
    assert (there >= 0).all()
    assert (there < lake.n).all()
    # Everything else that can be sailed is there: 8 winds × 3 tacks × (sum over headings of the
    # waypoints with a neighbour that way), less the one heading of each wind.
    n = lake.n
    neighbours = 4 * n * (n - 1) + 4 * (n - 1) ** 2
    assert model.n_pairs == 3 * neighbours * 7


def test_every_outcome_is_the_next_waypoint_with_the_new_tack(lake):
    model, chain = lake.model, wind_chain()
    entries = model.P.tocoo()
    before, heading = lake.states[model.pair_state[entries.row]], model.pair_action[entries.row]
    after = lake.states[entries.col]
    np.testing.assert_array_equal(after[:, :2], before[:, :2] + HEADINGS[heading])
    np.testing.assert_array_equal(after[:, 3], tack_of(heading, before[:, 2]))
    np.testing.assert_allclose(entries.data, chain[before[:, 2], after[:, 2]])


def test_leg_times_by_point_of_sail_and_change_of_tack(lake):
    def minutes(heading, wind, tack):
        return lake.leg_times[lake.model.pair_index(lake.index(2, 2, wind, tack), heading)]

    assert [minutes(h, N, NEUTRAL) for h in (N, NE, E, SE)] == [1, 2, 3, 4]
    assert list(LEG_TIMES[1:]) == [4, 3, 2, 1]
    assert minutes(E, N, PORT) == 3 + lake.delay
    assert minutes(E, N, STARBOARD) == 3
    assert minutes(N, N, PORT) == minutes(N, N, STARBOARD) == 1


def test_optimal_minutes_satisfy_the_bellman_equation(lake, plan):
    V, _ = plan
    model = lake.model
    one_step = lake.leg_times + GAMMA * (model.P @ V)
    least = model.table(one_step, fill=np.inf).min(axis=1)
    sailing = ~lake.at_goal
    np.testing.assert_allclose(V[sailing], least[sailing], atol=1e-7)
    assert (V[lake.at_goal] == 0).all()


def test_optimal_policy_takes_the_optimal_minutes_and_any_other_more(lake, plan):
    V, cost = plan
    np.testing.assert_allclose(lake.minutes_to_goal(cost.argmin(axis=1), GAMMA), V, atol=1e-6)
    at_random = lake.minutes_to_goal(uniform_policy(lake.model.mask), GAMMA)
    assert (at_random >= V - 1e-6).all()
    assert at_random[lake.starts].mean() > 2 * V[lake.starts].mean()


def test_no_state_costs_more_than_sailing_for_ever(lake, plan):
    V, _ = plan
    assert V.max() < (LEG_TIMES[1] + lake.delay) / (1 - GAMMA)
    circling = np.where(lake.model.mask, 1.0, 0.0).argmax(axis=1)
    assert lake.minutes_to_goal(circling, GAMMA).max() <= 7 / (1 - GAMMA) + 1e-6


def test_with_the_wind_is_cheaper_than_against_it(lake, plan):
    V, _ = plan
    far = lake.index(0, 0, np.arange(8), NEUTRAL)  # the goal lies to the north-east
    assert V[far].argmin() == NE
    assert V[far].argmax() == SW
    # The lake, the goal and the chain alike leave nothing to choose between tacks off the wind.
    one_leg = lake.index(3, 3, NE, NEUTRAL)
    assert V[one_leg] == pytest.approx(1.0)


def test_opposite_tack_costs_at_most_the_delay(lake, plan):
    V, _ = plan
    by_tack = V.reshape(-1, 3)
    assert (by_tack >= by_tack[:, [NEUTRAL]] - 1e-9).all()
    assert (by_tack <= by_tack[:, [NEUTRAL]] + lake.delay + 1e-9).all()


def test_without_delay_the_tack_does_not_matter():
    lake = Sailing(4, delay=0)
    V, _ = value_iteration(
        lake.model, np.zeros(lake.n_states), GAMMA, -lake.leg_times, lake.goal_states
    )
    by_tack = V.reshape(-1, 3)
    np.testing.assert_allclose(by_tack, by_tack[:, [0]] * np.ones(3), atol=1e-7)


def test_demonstrator_sails_optimally_to_the_goal(lake, plan):
    _, cost = plan
    sailor = lake.demonstrator(GAMMA)
    rng = np.random.default_rng(0)
    for start in rng.choice(lake.starts, 10):
        shown = sailor.trajectory(int(start), rng)
        assert shown
        for state, action in shown:
            assert cost[state, action] == pytest.approx(cost[state].min(), abs=1e-5)
        state, action = shown[-1]
        np.testing.assert_array_equal(lake.states[state, :2] + HEADINGS[action], lake.goal)


def test_features_are_finite_distinct_and_blind_to_the_goal(lake):
    assert lake.features.shape == (lake.n_states, 89)
    assert np.isfinite(lake.features).all()
    assert np.abs(lake.features).max() <= 1
    assert np.unique(lake.features.round(9), axis=0).shape[0] == lake.n_states
    np.testing.assert_array_equal(lake.features, Sailing(5, goal=(1, 2)).features)


def test_sectors_part_the_lake_by_wind_and_by_where_the_goal_lies():
    lake = Sailing(5, goal=(2, 2))
    sectors = lake.sectors()
    np.testing.assert_array_equal(sectors == -1, lake.at_goal)
    assert np.unique(sectors[sectors >= 0]).size == 16 * 8
    assert np.unique(Sailing(5).sectors()).size == 5 * 8 + 1
    inside = ~lake.at_goal
    np.testing.assert_array_equal(sectors[inside] % 8, lake.states[inside, 2])
    # A leg straight at the goal stays in its sector until it arrives.
    for direction in range(8):
        far, near = (lake.index(*(2 - k * HEADINGS[direction]), N, NEUTRAL) for k in (2, 1))
        assert sectors[far] == sectors[near] == 2 * direction * 8 + N
    assert len({int(sectors[lake.index(2 + dx, 2 + dy, N, 0)]) for dx, dy in ((1, 2), (2, 1))}) == 2


def test_purity_is_one_for_the_ideal_and_falls_as_states_change_places(lake):
    optimal = lake.demonstrator(GAMMA).optimal_actions
    ideal = ideal_clusters(optimal, lake.states[:, 2])
    np.testing.assert_array_equal(ideal == -1, lake.at_goal)
    assert purity(ideal, optimal) == 1
    assert purity(lake.sectors(), optimal) < 1
    found = [
        purity(shuffled_clusters(ideal, quality, np.random.default_rng(seed)), optimal)
        for quality in (1.0, 0.75, 0.5, 0.25, 0.0)
        for seed in range(3)
    ]
    levels = np.reshape(found, (5, 3)).mean(axis=1)
    assert (np.diff(levels) < 0).all()
    # No clustering is worse than calling the commonest optimal action everywhere.
    inside = ~lake.at_goal
    assert levels[-1] >= optimal[inside].mean(axis=0).max()


def test_shuffling_keeps_sizes_and_what_is_outside(lake):
    clusters = lake.sectors()
    mixed = shuffled_clusters(clusters, 0.25, np.random.default_rng(1))
    np.testing.assert_array_equal(np.sort(mixed), np.sort(clusters))
    np.testing.assert_array_equal(mixed == -1, clusters == -1)
    assert (mixed != clusters).mean() <= 0.75
    assert (shuffled_clusters(clusters, 1, np.random.default_rng(1)) == clusters).all()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"n": 2}, "size"),
        ({"n": 4, "goal": (4, 0)}, "off the 4 × 4 lake"),
        ({"delay": -1}, "delay"),
    ],
)
def test_impossible_lakes_are_refused(arguments, words):
    with pytest.raises(InputError, match=words):
        Sailing(**arguments)


def test_directions_are_named_clockwise():
    assert DIRECTIONS == ("N", "NE", "E", "SE", "S", "SW", "W", "NW")
    angle = np.arctan2(HEADINGS[:, 0], HEADINGS[:, 1]) % (2 * np.pi)
    np.testing.assert_allclose(angle, np.arange(8) * np.pi / 4)
