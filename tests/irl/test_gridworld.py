import numpy as np
import pytest
import torch
from scipy.sparse import csgraph

from irl.domains.gridworld import (
    DOWN,
    LEFT,
    MOVES,
    RIGHT,
    UP,
    GridWorld,
    bar,
    four_rooms,
    goal_cell,
)
from irl.errors import InputError
from irl.likelihood import LikelihoodProblem
from irl.training import train
from irl.training_config import TrainingConfig
from irl.vr_function import VRFunction

torch.set_num_threads(1)  # networks this small gain nothing from more


def towards(world):
    """An optimal policy: along x first, then along y."""
    dx, dy = (np.array(world.goal) - world.cells).T
    return np.select([dx > 0, dx < 0, dy > 0], [RIGHT, LEFT, UP], DOWN)


def test_moves():
    world = GridWorld(3, (1, 1))
    assert world.model.n_pairs == 24  # 4 · 9 less 3 off each side
    assert world.model.mask[world.index(0, 0)].tolist() == [True, True, False, False]
    after = world.model.P.indices[world.model.pair_index(world.index(1, 1), np.arange(4))]
    assert after.tolist() == [world.index(*c) for c in ((2, 1), (1, 2), (0, 1), (1, 0))]
    np.testing.assert_allclose(world.features[world.index(2, 1)], [1, 0.5])


@pytest.mark.parametrize("kind", ["diagonal", "border"])
@pytest.mark.parametrize("goal", ["centre", "offset"])
@pytest.mark.parametrize("n", [5, 7, 25])
def test_trajectories_are_feasible_shortest_paths_to_the_goal(kind, goal, n):
    world = GridWorld(n, goal_cell(n, goal))
    corners = [(0, 0), (n - 1, 0), (n - 1, n - 1), (0, n - 1)]
    for corner, pairs in zip(corners, world.trajectories(kind), strict=True):
        states, actions = np.array(pairs).T
        rows = world.model.pair_index(states, actions)
        assert (rows >= 0).all()
        assert states[0] == world.index(*corner)
        assert [*states[1:], world.goal_state] == world.model.P.indices[rows].tolist()
        assert len(pairs) == np.abs(np.array(corner) - world.goal).sum()
    states, _ = world.demonstrations(kind)
    assert kind == "diagonal" or np.unique(states).size == states.size


def test_border_trajectories_leave_the_border_at_the_goals_column_or_row():
    world = GridWorld(7, (3, 3))
    bottom, right, *_ = world.trajectories("border")
    assert [a for _, a in bottom] == [RIGHT] * 3 + [UP] * 3
    assert [a for _, a in right] == [UP] * 3 + [LEFT] * 3


def test_the_thesis_demonstrates_3_92_percent_of_the_largest_grid():
    for kind in ("diagonal", "border"):
        states, _ = GridWorld(101, goal_cell(101, "centre")).demonstrations(kind)
        assert np.unique(states).size / 10_201 == pytest.approx(0.0392, abs=5e-5)


def test_a_goal_in_the_corner_has_one_empty_trajectory():
    world = GridWorld(4, (0, 0))
    assert [len(t) for t in world.trajectories("diagonal")] == [0, 3, 6, 3]


def test_preferences_are_the_goal_and_the_limits():
    preferences = GridWorld(7, (3, 3)).preferences()
    assert preferences.preferred.tolist() == [24]
    assert preferences.avoided.size == 24


def test_accuracy_by_hand():
    world = GridWorld(5, (1, 3))
    policy = towards(world)
    assert world.accuracy(policy) == 1
    policy[world.goal_state] = DOWN  # what it does at the goal doesn't matter
    assert world.accuracy(policy) == 1
    assert world.accuracy(np.full(25, UP)) == pytest.approx(4 / 25)  # column below, and goal
    # A detour of more than 2n moves doesn't count: a snake that sweeps the rows.
    snake = GridWorld(5, (4, 4))
    x, y = snake.cells.T
    policy = np.where(y % 2 == 0, RIGHT, LEFT)
    policy[((y % 2 == 0) & (x == 4)) | ((y % 2 == 1) & (x == 0))] = UP
    assert snake.accuracy(policy) == pytest.approx(11 / 25)  # the goal and 10 moves before it


def walled(walls, n=11):
    return GridWorld(n, goal_cell(n, "offset"), walls(n))


def by_walking(world, policy, horizon):
    """Moves to the goal, one cell and one move at a time."""
    counts = []
    for cell in world.cells:
        here, moves = tuple(cell), 0
        while here != world.goal and moves < horizon and here not in world.blocked:
            there = tuple(np.array(here) + MOVES[policy[world.index(*here)]])
            if all(0 <= c < world.n for c in there) and there not in world.blocked:
                here = there
            moves += 1
        counts.append(moves if here == world.goal else -1)
    return counts


@pytest.mark.parametrize("walls", [bar, four_rooms])
def test_distances_are_those_of_an_independent_search(walls):
    world = walled(walls)
    model = world.model
    graph = np.zeros((world.n_states, world.n_states))
    graph[model.pair_state, model.P.indices] = 1
    wanted = csgraph.shortest_path(graph, unweighted=True)[:, world.goal_state]
    np.testing.assert_array_equal(world.distance, np.where(np.isinf(wanted), -1, wanted))
    assert np.flatnonzero(world.distance < 0).tolist() == world.blocked_states.tolist()


@pytest.mark.parametrize("walls", [lambda n: frozenset(), bar, four_rooms])
@pytest.mark.parametrize("good", [0.0, 0.9])
def test_moves_to_goal_are_those_of_walking(walls, good):
    world = walled(walls)
    rng = np.random.default_rng(1)
    # Mostly shortest ways with some random actions, infeasible ones among them.
    nearer = world.model.table(
        -world.distance[world.model.P.indices].astype(float), fill=-np.inf
    ).argmax(axis=1)
    policy = np.where(
        rng.random(world.n_states) < good, nearer, rng.integers(4, size=world.n_states)
    )
    walked = by_walking(world, policy, 2 * world.n)
    np.testing.assert_array_equal(world.moves_to_goal(policy), walked)
    way = world.distance >= 0
    assert world.accuracy(policy) == (np.array(walked)[way] >= 0).mean()
    assert world.accuracy(nearer) == world.shortest(nearer) == 1
    assert world.shortest(policy) <= world.accuracy(policy)


def test_a_way_longer_than_2n_counts_if_there_is_none_shorter():
    # Corridors that wind from the bottom to the top: 5 rows of 9 cells and 4 doors.
    n = 9
    blocked = frozenset(
        (x, y) for y in range(1, n, 2) for x in range(n) if x != (n - 1 if y % 4 == 1 else 0)
    )
    world = GridWorld(n, (n - 1, n - 1), blocked)
    assert world.distance.max() == 48 > 2 * n
    x, y = world.cells.T
    policy = np.where(y % 4 == 0, RIGHT, LEFT)
    policy[((y % 4 < 2) & (x == n - 1)) | ((y % 4 >= 2) & (x == 0))] = UP
    assert world.accuracy(policy) == world.shortest(policy) == 1


def test_cells_without_a_way_do_not_count():
    world = GridWorld(5, (3, 3), frozenset({(0, 1), (1, 1), (1, 0)}))  # (0, 0) is walled in
    assert (world.distance < 0).sum() == 4
    assert world.accuracy(towards(world)) == 1
    assert world.trajectories("diagonal")[0] == []
    assert not world.model.mask[world.blocked_states].any()


@pytest.mark.parametrize("kind", ["diagonal", "border"])
@pytest.mark.parametrize("walls", [bar, four_rooms])
def test_trajectories_find_their_way_around_walls(kind, walls):
    world = walled(walls)
    for pairs in world.trajectories(kind):
        states, actions = np.array(pairs).T
        rows = world.model.pair_index(states, actions)
        assert (rows >= 0).all()
        assert [*states[1:], world.goal_state] == world.model.P.indices[rows].tolist()
        assert len(pairs) == world.distance[states[0]]


def test_who_stays_at_the_limits():
    world = GridWorld(5, (2, 2))
    x, y = world.cells.T
    inwards = np.select([x == 0, x == 4, y == 0], [RIGHT, LEFT, UP], DOWN)
    assert world.stays_at_limits(inwards) == 0
    assert world.stays_at_limits(np.full(25, LEFT)) == 9 / 12  # all but the right edge
    demonstrated = inwards.copy()
    states, actions = world.demonstrations("border")
    demonstrated[states] = actions
    assert world.stays_at_limits(demonstrated) == 4 / 12


@pytest.mark.parametrize("kind", ["diagonal", "border"])
@pytest.mark.parametrize("goal", ["centre", "offset"])
def test_learning_solves_the_7_by_7_grid(kind, goal):
    world = GridWorld(7, goal_cell(7, goal))
    network = VRFunction(2, (32, 32), generator=torch.Generator().manual_seed(0))
    problem = LikelihoodProblem.build(world.model, *world.demonstrations(kind))
    config = TrainingConfig(iterations=1000, beta=70.0)
    train(network, problem, world.features, config, np.random.default_rng(0))
    q = world.model.q_values(network.values(world.features))
    assert world.accuracy(q.argmax(axis=1)) == 1


def test_bad_worlds_are_named():
    with pytest.raises(InputError, match="odd size, got 8"):
        goal_cell(8, "centre")
    with pytest.raises(InputError, match=r"goal.*centre, offset, corner"):
        goal_cell(7, "edge")
    with pytest.raises(InputError, match="at least 3"):
        GridWorld(2, (0, 0))
    with pytest.raises(InputError, match="off the 5 × 5"):
        GridWorld(5, (5, 0))
    with pytest.raises(InputError, match=r"goal: \(1, 2\) is blocked"):
        GridWorld(5, (1, 2), frozenset({(1, 2)}))
    with pytest.raises(InputError, match=r"blocked: \(0, -1\) is off the 5 × 5"):
        GridWorld(5, (1, 2), frozenset({(0, -1)}))
    with pytest.raises(InputError, match=r"trajectories.*diagonal, border"):
        GridWorld(5, (2, 2)).trajectories("spiral")
