"""The verdict of a trial: what became of the cube, from its pose at the end."""

import numpy as np
from pydrake.math import RigidTransform

from diagrams.trials.record import Outcome, TrialRecord
from models.rotations import matrix_to_rotation_vector
from models.task.discretise import nearest_orientation
from models.task.spaces import R_WO, REST_HEIGHT, State


def judge_pose(
    X_WO: RigidTransform, state: State, p_nominal: np.ndarray, *, held: bool, next_state: int
) -> TrialRecord:
    """Record how the cube's pose differs in the end from the nominal one.

    Args:
        X_WO: the cube's pose in the end.
        state: what the trial began in.
        p_nominal: where the cube's centre would be if all went as meant ``[3]`` [m].
        held: whether the hand holds it.
        next_state: index of the state identified.

    Returns:
        A record of that; what hand and pads did is left at its default.
    """
    R_WO_after, p_WO = X_WO.rotation().matrix(), X_WO.translation()
    turn = matrix_to_rotation_vector(R_WO_after @ R_WO[state.orientation].T)
    displacement = p_WO - p_nominal
    return TrialRecord(
        outcome=Outcome.HELD if held else Outcome.FREE,
        next_state=next_state,
        turn=tuple(turn.tolist()),
        displacement=tuple(displacement.tolist()),
        snap_angle=float(nearest_orientation(R_WO_after)[1]),
        drift=float(np.hypot(displacement[0], displacement[1])),
        lift_height=float(p_WO[2] - REST_HEIGHT),
    )
