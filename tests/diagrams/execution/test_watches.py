import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix
from scipy.spatial.transform import Rotation

from diagrams.execution.phases import Watch, phases
from diagrams.execution.watches import LOOK, PATIENCE, RECENT, Measured, Vigil
from models.motion.failures import ActionFailure
from models.motion.moves import CLOSE, OPEN, Move

MOVE = Move(np.array([np.zeros(7), np.ones(7)]))
LIES = RigidTransform([0.55, 0.0, 0.52])
HOLDS = {"opening": 0.04, "force": 40.0}


@pytest.mark.parametrize(
    ("plan", "watched"),
    [
        ((MOVE, CLOSE, MOVE), ["cube", "nothing", "grip"]),
        ((OPEN, MOVE, CLOSE, MOVE), ["cube", "cube", "nothing", "grip"]),
        ((MOVE,), ["grip"]),
        ((OPEN, MOVE), ["nothing", "nothing"]),
        ((MOVE, OPEN, MOVE), ["grip", "nothing", "nothing"]),
        ((), []),
    ],
    ids=["grasp", "grasp with closed fingers", "carry", "drop", "drop from elsewhere", "none"],
)
def test_each_part_of_a_plan_has_its_watch(plan, watched):
    assert [phase.watch for phase in phases(plan)] == watched
    assert tuple(phase.part for phase in phases(plan)) == plan


def after(vigil, watch, looks):
    for seen in looks:
        vigil = vigil.looked(watch, seen)
        if vigil.failure:
            return vigil
    return vigil


@pytest.mark.parametrize("lost", [{"force": 2.0}, {"opening": 0.02}, {"opening": 0.08}])
def test_a_grip_is_lost_once_two_looks_say_so(lost):
    good, bad = Measured(**HOLDS), Measured(**{**HOLDS, **lost})
    vigil = Vigil(LIES)
    assert after(vigil, Watch.GRIP, [good] * 50).failure is None
    assert after(vigil, Watch.GRIP, [good] * 50) is vigil  # nothing new, nothing written
    assert after(vigil, Watch.GRIP, [good, bad, good, bad, good, bad, good]).failure is None
    enough = PATIENCE[ActionFailure.GRIP_LOST]
    assert after(vigil, Watch.GRIP, [good] + [bad] * enough).failure == ActionFailure.GRIP_LOST
    assert after(vigil, Watch.NOTHING, [bad] * 20).failure is None
    assert after(vigil, Watch.CUBE, [bad] * 20).failure is None
    assert after(vigil, Watch.GRIP, [Measured()] * 20).failure is None


@pytest.mark.parametrize("watch", list(Watch))
def test_an_arm_that_stays_behind_is_obstructed_whatever_else_is_watched(watch):
    late, stuck = Measured(behind=0.021, **HOLDS), Measured(behind=0.0249, **HOLDS)
    enough = PATIENCE[ActionFailure.OBSTRUCTED]
    assert after(Vigil(LIES), watch, [late] * 20).failure is None
    assert after(Vigil(LIES), watch, [stuck] * (enough - 1) + [late] + [stuck]).failure is None
    assert after(Vigil(LIES), watch, [stuck] * enough).failure == ActionFailure.OBSTRUCTED


def test_looks_that_find_fault_with_the_arm_do_not_count_against_the_grip():
    stuck, lost = Measured(behind=0.2, **HOLDS), Measured(**{**HOLDS, "force": 0.0})
    assert after(Vigil(LIES), Watch.GRIP, [stuck, lost, stuck, lost, stuck, lost]).failure is None
    assert after(Vigil(LIES), Watch.GRIP, [stuck, lost, lost]).failure == ActionFailure.GRIP_LOST


def noisy(X_WO, rng, place=0.005, turn=0.087):
    """Off by a vector and a rotation vector, whose lengths have these root mean squares."""
    spin = Rotation.from_rotvec(rng.normal(0.0, turn / np.sqrt(3), 3)).as_matrix()
    offset = rng.normal(0.0, place / np.sqrt(3), 3)
    return RigidTransform(
        RotationMatrix(spin @ X_WO.rotation().matrix()), X_WO.translation() + offset
    )


def looks_until_displaced(planned, truth, rng, most=300):
    vigil = Vigil(planned)
    for look in range(1, most + 1):
        vigil = vigil.looked(Watch.CUBE, Measured(X_WO=noisy(truth, rng)))
        if vigil.failure:
            assert vigil.failure == ActionFailure.DISPLACED
            return look
    return None


def test_noise_does_not_look_like_a_cube_that_moves():
    """Planned with a mean of six looks, then watched for 30 s, a hundred times."""
    for seed in range(100):
        rng = np.random.default_rng(seed)
        seen = [noisy(LIES, rng) for _ in range(6)]
        planned = RigidTransform(
            RotationMatrix(
                Rotation.from_matrix([X.rotation().matrix() for X in seen]).mean().as_matrix()
            ),
            np.mean([X.translation() for X in seen], axis=0),
        )
        assert looks_until_displaced(planned, LIES, rng) is None


@pytest.mark.parametrize(
    ("away", "turn"), [((0.02, 0.0, 0.0), 0.0), ((0.0, 0.0, 0.0), 20.0), ((0.03, -0.02, 0.0), 40.0)]
)
def test_a_push_of_2_cm_or_20_degrees_is_seen_through_the_noise_within_half_a_second(away, turn):
    pushed = RigidTransform(
        RollPitchYaw(0.0, 0.0, np.radians(turn)), LIES.translation() + np.array(away)
    )
    for seed in range(50):
        looks = looks_until_displaced(LIES, pushed, np.random.default_rng(seed))
        assert looks is not None and looks * LOOK <= RECENT * LOOK + 0.31
