"""The two arms as scenes know them: description files, joints and how the hand opens."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from models.scenes import gripper, lite_gripper
from models.scenes.parsing import STATION_FILES

HOME = np.array([0.0, 0.26, np.pi, -2.27, 0.0, 0.96, np.pi / 2])
"""The Gen3's home posture [rad], the vendor's: elbow up, gripper before the robot."""


@dataclass(frozen=True)
class Robot:
    """An arm with its hand, in front of the table.

    Attributes:
        station: the directives of the scene: a name in `models/description`, or an absolute path.
        files: the description files that these take in.
        joints: names of the arm's joints.
        finger_joints: names of the hand's joints.
        finger_positions: their positions [rad] at an opening [m].
        max_opening: widest opening [m].
        home: its home posture ``[n]`` [rad], where inverse kinematics starts if not told.
    """

    station: str
    files: tuple[str, ...]
    joints: tuple[str, ...]
    finger_joints: tuple[str, ...]
    finger_positions: Callable[[float], np.ndarray]
    max_opening: float
    home: np.ndarray

    def without_fingers(self) -> "Robot":
        """The same arm, whose hand has no joints."""
        return replace(
            self, finger_joints=(), finger_positions=lambda _: np.empty(0), max_opening=0.0
        )


GEN3 = Robot(
    station="station.dmd.yaml",
    files=STATION_FILES,
    joints=tuple(f"joint_{i}" for i in range(1, 8)),
    finger_joints=gripper.JOINTS,
    finger_positions=lambda width: gripper.joint_positions(float(gripper.knuckle_angle(width))),
    max_opening=gripper.MAX_OPENING,
    home=HOME,
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
    home=np.array([0.0, -0.28, 1.309, 0.0, -1.047, 0.0]),
)
"""Kinova Gen3 Lite with its own gripper."""
