"""Which actions have a plan."""

from pathlib import Path

import numpy as np
import pytest

from models.maps.reachability_csv import read_map
from models.motion.feasibility import Feasibility, compute
from models.task.spaces import LOST, N_ACTIONS, Action, Kind, State

MAP = Path(__file__).parents[3] / "experiments" / "data" / "gen3" / "map.csv"
CELLS = (8, 9, 12)
"""The middle column, and a lower corner, which level hands from the sides do not reach."""


@pytest.fixture(scope="module")
def some():
    reports = []
    answer = compute(read_map(MAP), lambda done, total: reports.append((done, total)), CELLS)
    assert reports == [(1, 3), (2, 3), (3, 3)]
    return answer


def test_grasps_are_all_but_the_level_ones(some):
    for cell in (8, 12):
        np.testing.assert_array_equal(np.flatnonzero(some.grasp[cell // 2]), range(5, 18))


def test_whatever_is_held_can_be_dropped(some):
    np.testing.assert_array_equal(some.drop, some.held)
    assert some.held[8].all() and some.held[9].all()
    assert np.flatnonzero(~some.held[12]).tolist() == [1, 3]


def test_no_action_stays_where_it_is(some):
    for cell in CELLS:
        assert not some.rotate[cell].diagonal().any()
        assert not some.translate[cell, :, cell].any()


def test_there_and_back_again(some):
    for cell in CELLS:
        np.testing.assert_array_equal(some.rotate[cell], some.rotate[cell].T)
    np.testing.assert_array_equal(some.translate, some.translate.transpose(2, 1, 0))


def test_nothing_ends_out_of_reach(some):
    for cell in CELLS:
        assert not some.rotate[cell][:, ~some.held[cell]].any()
    assert not (some.translate[8, :, 12] & ~some.held[12]).any()


def test_nearly_all_the_rest_has_a_plan(some):
    held = some.held[list(CELLS)]
    pairs = sum(int(row.sum()) * int(row.sum() - 1) for row in held)
    assert some.rotate.sum() >= 0.99 * pairs
    assert some.translate[8, :, 9].all()
    assert some.translate[8, :, 12].sum() == some.held[12].sum()


def test_mask_holds_every_action_in_its_place():
    rng = np.random.default_rng(0)
    arrays = {
        name: rng.random(shape) < 0.5
        for name, shape in (
            ("grasp", (9, 18)),
            ("translate", (18, 18, 18)),
            ("rotate", (18, 18, 18)),
            ("drop", (18, 18)),
            ("held", (18, 18)),
        )
    }
    mask = Feasibility(**arrays).mask()
    assert mask.shape == (LOST + 1, N_ACTIONS)
    assert not mask[LOST].any()
    for _ in range(500):
        cell, orientation, gripper, target = (int(rng.integers(n)) for n in (18, 48, 18, 18))
        free = State(cell // 2 * 2, orientation).index
        held = State(cell, orientation, gripper).index
        grasp, translate, rotate = (Action(Kind(k), target).index for k in range(3))
        drop = Action(Kind.DROP).index
        assert mask[free, grasp] == arrays["grasp"][cell // 2, target]
        assert not mask[free, [translate, rotate, drop]].any()
        assert mask[held, translate] == arrays["translate"][cell, gripper, target]
        assert mask[held, rotate] == arrays["rotate"][cell, gripper, target]
        assert mask[held, drop] == arrays["drop"][cell, gripper]
        assert not mask[held, grasp]
