"""What is no rotation, angle or quaternion is refused, in one line."""

import numpy as np
import pytest

from models import rotations as rot
from models.errors import ModelError


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: rot.matrix_to_quaternion(np.diag([1.0, 1, -1])), "det = -1"),
        (lambda: rot.matrix_to_xyz_euler(1.1 * np.eye(3)), "‖RᵀR − I‖ = 0.364"),
        (lambda: rot.require_rotation([np.eye(3), np.zeros((3, 3))], "R_WO"), r"R_WO\[1\]"),
        (lambda: rot.matrix_to_zyx_euler(np.eye(4)), r"shape \[4, 4\]; wanted \[\.\.\., 3, 3\]"),
        (lambda: rot.matrix_to_quaternion(np.full((3, 3), np.nan)), "not finite"),
        (lambda: rot.quaternion_to_matrix([0, 0, 0, 0]), "is zero"),
        (lambda: rot.quaternion_to_matrix([1, 0, 0]), r"wanted \[\.\.\., 4\]"),
        (lambda: rot.rotation_vector_to_matrix(1.0), r"shape \[\]"),
    ],
)
def test_what_is_no_rotation_is_refused(call, said):
    with pytest.raises(ModelError, match=said) as error:
        call()
    assert "\n" not in str(error.value)


TAKES_A_MATRIX = (
    rot.matrix_to_xyz_euler,
    rot.matrix_to_zyx_euler,
    rot.matrix_to_quaternion,
    rot.matrix_to_rotation_vector,
    rot.require_rotation,
    lambda R: rot.geodesic_angle(R, np.eye(3)),
    lambda R: rot.geodesic_angle(np.eye(3), R),
)
TAKES_ANGLES = (rot.xyz_euler_to_matrix, rot.zyx_euler_to_matrix, rot.rotation_vector_to_matrix)
ABOUT_AN_AXIS = (rot.rotation_x, rot.rotation_y, rot.rotation_z)
NO_NUMBERS = ("text", 1j, np.nan, np.inf, None, [[1.0], [1.0, 2.0]], np.datetime64("2020-01-01"))


@pytest.mark.parametrize("bad", [*NO_NUMBERS, 1e7, -1e300, 10**400])
def test_what_is_no_angle_is_refused(bad):
    for turn in ABOUT_AN_AXIS:
        with pytest.raises(ModelError, match="angle"):
            turn(bad)
    for convert in TAKES_ANGLES:
        with pytest.raises(ModelError, match=r"angles|rotation vector"):
            convert([0.0, bad, 0.0])


@pytest.mark.parametrize("bad", [*NO_NUMBERS, 1e7, -1e300, 1e155, 10**400])
def test_what_is_no_entry_of_a_rotation_is_refused(bad):
    for convert in TAKES_A_MATRIX:
        with pytest.raises(ModelError, match="R"):
            convert([[1.0, 0.0, 0.0], [0.0, 1.0, bad], [0.0, 0.0, 1.0]])


@pytest.mark.parametrize("bad", NO_NUMBERS)
def test_what_is_no_component_of_a_quaternion_is_refused(bad):
    with pytest.raises(ModelError, match="quaternion"):
        rot.quaternion_to_matrix([1.0, 0.0, bad, 0.0])
