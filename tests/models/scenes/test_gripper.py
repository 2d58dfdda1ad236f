"""The linkage's closed form against the plant that Drake parses."""

import numpy as np
import pytest

from models.scenes import gripper
from models.scenes.parsing import GRIPPER
from models.scenes.planning_scene import PlanningScene

WIDTHS = np.linspace(0.002, gripper.MAX_OPENING, 12)


def test_knuckle_angle_inverts_opening():
    np.testing.assert_allclose(gripper.opening(gripper.knuckle_angle(WIDTHS)), WIDTHS, atol=1e-12)


def test_widths_beyond_the_linkage_are_clipped():
    assert gripper.knuckle_angle(np.array(-1.0)) == gripper.KNUCKLE_LIMIT
    widest = gripper.knuckle_angle(np.array(1.0))
    assert gripper.opening(widest) == pytest.approx(gripper.MAX_OPENING)


def test_closing_rate_is_half_the_slope_of_the_opening():
    angle, step = np.linspace(0.05, 0.75, 9), 1e-6
    slope = (gripper.opening(angle + step) - gripper.opening(angle - step)) / (2 * step)
    np.testing.assert_allclose(gripper.closing_rate(angle), -slope / 2, atol=1e-8)


@pytest.mark.parametrize("width", WIDTHS[1::3])
def test_pads_of_the_plant_stand_as_far_apart(width):
    scene = PlanningScene()
    scene.open_to(width)
    plant = scene.plant
    instance = plant.GetModelInstanceByName(GRIPPER)
    frames = [plant.GetFrameByName(f"{side}_inner_finger", instance) for side in ("left", "right")]
    tcp = plant.GetFrameByName("tcp")
    surface = np.array([0.0, gripper.PAD_SURFACE_Y, 0.03242])
    left, right = (
        plant.CalcPointsPositions(scene.context, frame, surface, tcp).ravel() for frame in frames
    )
    np.testing.assert_allclose(np.abs(left - right), [0.0, width, 0.0], atol=1e-9)
    # The pads are parallel, and either side of the middle plane.
    np.testing.assert_allclose(left[1], -right[1], atol=1e-9)
    R_LR = scene.plant.CalcRelativeTransform(scene.context, *frames).rotation().matrix()
    np.testing.assert_allclose(R_LR, np.diag([-1.0, -1.0, 1.0]), atol=1e-9)


def test_tool_centre_point_is_between_the_pads_that_hold_the_cube():
    scene = PlanningScene()
    scene.open_to(0.04)
    plant, instance = scene.plant, scene.plant.GetModelInstanceByName(GRIPPER)
    frame = plant.GetFrameByName("left_inner_finger", instance)
    pad = plant.CalcPointsPositions(
        scene.context, frame, np.array([0.0, 0.0, 0.03242]), plant.GetFrameByName("tcp")
    ).ravel()
    assert abs(pad[2]) < 1e-4
