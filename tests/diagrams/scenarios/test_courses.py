import numpy as np
import pytest

from diagrams.scenarios.courses import ASIDE, HAND, PUTTING, SPARE, Moving, place_aside, put_down
from diagrams.scenarios.draws import REACH
from models.maps.gripper_poses import gripper_pose
from models.rotations import rotation_vector_to_matrix
from models.task.spaces import N_GRIPPERS, POSITIONS, REST_HEIGHT

LOW, HIGH = REACH + SPARE


def at_rest(R, p):
    return Moving(np.asarray(R), np.asarray(p), np.zeros(3), np.zeros(3))


def beside(p, hand):
    """How far a point is from the hand seen from above, by many points on the hand's axis."""
    along = np.linspace(0.0, HAND, 401)[:, None] * hand.R[:, 2]
    return np.linalg.norm((hand.p - along)[:, :2] - p[:2], axis=1).min()


def pulled_out(rng):
    """A hand in one of the task's poses, and a cube some 8 cm from it."""
    X = gripper_pose(POSITIONS[rng.integers(len(POSITIONS))], int(rng.integers(N_GRIPPERS)))
    hand = at_rest(X.rotation().matrix(), X.translation() + rng.normal(0.0, 0.02, 3))
    heading = rng.uniform(-np.pi, np.pi)
    away = hand.R @ [np.cos(heading), 0.0, np.sin(heading)]
    cube = hand.p + 0.08 * away
    p = [*np.clip(cube[:2], *REACH), max(cube[2], REST_HEIGHT)]
    return at_rest(rotation_vector_to_matrix(rng.normal(size=3)), p), hand


@pytest.mark.parametrize("seed", range(40))
def test_a_cube_is_put_beside_the_hand_in_reach_and_on_its_way_not_led_past_it(seed):
    cube, hand = pulled_out(np.random.default_rng(seed))
    place = place_aside(cube, hand)
    assert (place >= LOW - 1e-9).all()
    assert (place <= HIGH + 1e-9).all()
    x, y = (np.linspace(LOW[i], HIGH[i], 20) for i in range(2))
    others = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    furthest = max(beside(p, hand) for p in others)
    assert beside(place, hand) >= min(ASIDE, furthest) - 5e-3

    def nearest_on_the_way(p):
        return min(beside(cube.p[:2] + s * (p - cube.p[:2]), hand) for s in np.linspace(0, 1, 11))

    enough = min(ASIDE, beside(cube.p, hand))
    far = min(ASIDE, furthest)
    best = max(nearest_on_the_way(p) for p in others if beside(p, hand) >= far)
    assert nearest_on_the_way(place) >= min(enough, best) - 5e-3


def test_the_place_is_no_further_than_it_must_be():
    hand = at_rest(np.diag([1.0, -1.0, -1.0]), [0.55, 0.0, 0.6])
    aside = at_rest(np.eye(3), [0.55, 0.14, 0.55])
    assert place_aside(aside, hand) == pytest.approx(aside.p[:2], abs=0.0051)
    near = at_rest(np.eye(3), [0.55, 0.05, 0.55])
    place = place_aside(near, hand)
    assert place[1] > 0.05
    assert ASIDE <= np.linalg.norm(place - hand.p[:2]) < ASIDE + 0.015


def test_it_is_led_level_and_then_down_at_one_speed_and_comes_to_rest_there():
    cube = at_rest(rotation_vector_to_matrix(np.array([0.3, 0.2, 0.1])), [0.5, 0.05, 0.62])
    place = np.array([0.6, -0.05])
    level, down = np.linalg.norm(place - cube.p[:2]), 0.62 - REST_HEIGHT
    seconds = (level + down) / PUTTING
    times = np.linspace(0.0, seconds, 400)
    course = [put_down(cube, place, t)[0] for t in times]
    points = np.array([each.p for each in course])
    speeds = np.linalg.norm(np.diff(points, axis=0), axis=1) / np.diff(times)
    assert speeds.max() <= PUTTING * (1.0 + 1e-6)
    assert points[times < level / PUTTING, 2] == pytest.approx(0.62)
    assert points[times > level / PUTTING + 1e-9, :2] == pytest.approx(
        np.tile(place, ((times > level / PUTTING + 1e-9).sum(), 1))
    )
    for each in course[:-1]:
        assert np.linalg.norm(each.v) == pytest.approx(PUTTING)
    assert not put_down(cube, place, seconds - 1e-3)[1]
    last, arrived = put_down(cube, place, seconds + 1e-9)
    assert arrived
    assert last.p == pytest.approx([*place, REST_HEIGHT])
    assert not last.v.any()


@pytest.mark.parametrize("seed", range(20))
def test_no_corner_of_a_cube_is_led_below_the_table(seed):
    rng = np.random.default_rng(seed)
    R = rotation_vector_to_matrix(rng.normal(size=3))
    corners = np.stack(np.meshgrid(*[(-0.02, 0.02)] * 3), axis=-1).reshape(-1, 3) @ R.T
    lowest = corners[:, 2].min()
    x, y, z = 0.5, 0.1, 0.5 - lowest  # it stands on a corner
    for height, down in ((-0.01, -0.2), (-0.01, 0.2), (0.01, -0.2)):
        v = np.array([0.1, 0.0, down])
        led = Moving(np.eye(3), np.array([x, y, z + height]), np.ones(3), v)
        raised = led.above_table(R)
        assert raised.p == pytest.approx([x, y, z + max(height, 0.0)])
        assert raised.v == pytest.approx(v if height > 0.0 else [0.1, 0.0, max(down, 0.0)])
        assert raised.R is led.R
        assert raised.w is led.w
