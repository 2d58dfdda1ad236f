"""The two arms as scenes know them: description files, joints and how the hand opens."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from models.scenes import gripper, lite_gripper
from models.scenes.parsing import STATION_FILES


@dataclass(frozen=True)
class Robot:
    """An arm with its hand, in front of the table.

    Attributes:
        station: the directives of the scene.
        files: the description files that these take in.
        joints: names of the arm's joints.
        finger_joints: names of the hand's joints.
        finger_positions: their positions [rad] at an opening [m].
        max_opening: widest opening [m].
    """

    station: str
    files: tuple[str, ...]
    joints: tuple[str, ...]
    finger_joints: tuple[str, ...]
    finger_positions: Callable[[float], np.ndarray]
    max_opening: float


GEN3 = Robot(
    station="station.dmd.yaml",
    files=STATION_FILES,
    joints=tuple(f"joint_{i}" for i in range(1, 8)),
    finger_joints=gripper.JOINTS,
    finger_positions=lambda width: gripper.joint_positions(float(gripper.knuckle_angle(width))),
    max_opening=gripper.MAX_OPENING,
)
"""Kinova Gen3 with the Robotiq 2F-85."""

GEN3_LITE = Robot(
    station="gen3_lite_station.dmd.yaml",
    files=(
        "box.sdf",
        "cube.sdf",
        "furniture.dmd.yaml",
        "gen3_lite.dmd.yaml",
        "gen3_lite.urdf",
        "gen3_lite_2f.urdf",
        "gen3_lite_station.dmd.yaml",
        "table.sdf",
    ),
    joints=tuple(f"joint_{i}" for i in range(1, 7)),
    finger_joints=lite_gripper.JOINTS,
    finger_positions=lite_gripper.joint_positions,
    max_opening=lite_gripper.MAX_OPENING,
)
"""Kinova Gen3 Lite with its own gripper."""
