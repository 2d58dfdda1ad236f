"""One grasp without noise, in Drake as our trials simulate it, and in MuJoCo.

A cube rests on the table; the hand closes, rises by `LIFT`, and waits. Either simulator has two
grippers: the whole 2F-85, and its pads alone. The whole one is read from the same description;
MuJoCo's two pads are a model of their own, on slides. Contact is hydroelastic here, at points
with elliptic cones there (`peers/mujoco_grasp.py`). Force, friction, cube, table, speeds and
time step are the same.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.geometry import CollisionFilterDeclaration, GeometrySet, Role
from pydrake.math import RigidTransform, RotationMatrix

from diagrams.gripper_controller import GRIP_FORCE, KNUCKLE_SPEED
from diagrams.trials.record import TrialConfig
from diagrams.trials.references import SPEED
from diagrams.trials.rig import COLUMN, TrialRig
from diagrams.trials.scene import TrialScene
from experiments.bench.comparison import Peers
from models.maps.gripper_poses import grasp_position
from models.rotations import rotation_vector_to_matrix
from models.scenes import gripper
from models.scenes.parsing import DESCRIPTION
from models.task.discretise import nearest_orientation
from models.task.spaces import CUBE_EDGE, N_YAWS, R_WG, REST_HEIGHT, TABLE_TOP

COURSE = TrialConfig()
"""How long each phase takes, and how it is simulated; MuJoCo has the time step."""
LIFT = 0.03
"""How far the closed hand rises [m]; a cube that rose by half of it was lifted."""
MASS = 0.1  # of the cube [kg]
PAD = np.array([0.022, 0.00635, 0.0375])  # as in robotiq_2f_85.urdf [m]
TABLE = np.array([0.4, 0.4, TABLE_TOP])  # as in table.sdf [m]


@dataclass(frozen=True)
class Grasp:
    """One grasp of a cube that rests in the middle of the table.

    Attributes:
        gripper: orientation of the hand, 5…17.
        yaw: of the cube [degrees].
        friction: coefficient, of everything.
        offset: how far the hand is off along −G_x, the pads' width, to the camera's side [m].
    """

    gripper: int
    yaw: float = 0.0
    friction: float = 0.8
    offset: float = 0.0

    @property
    def p_WO(self) -> np.ndarray:
        """The cube's centre ``[3]`` [m]."""
        return np.array([*COLUMN, REST_HEIGHT])

    @property
    def R_WO(self) -> np.ndarray:
        """The cube's orientation ``[3, 3]``."""
        return rotation_vector_to_matrix([0.0, 0.0, np.radians(self.yaw)])

    @property
    def p_WG(self) -> np.ndarray:
        """The tool centre point ``[3]`` [m]."""
        return grasp_position(self.p_WO, self.gripper) - self.offset * R_WG[self.gripper][:, 0]

    @property
    def overlap_limit(self) -> float:
        """Offset from which on the pads don't reach the cube [m]."""
        half_cube = 0.5 * CUBE_EDGE * np.abs(R_WG[self.gripper][:, 0] @ self.R_WO).sum()
        return float(half_cube + PAD[0] / 2)


@dataclass(frozen=True)
class Ends:
    """How grasps ended.

    Attributes:
        p_WO: the cube's centre ``[n, 3]`` [m].
        R_WO: its orientation ``[n, 3, 3]``.
        opening: between the pads ``[n]`` [m].
        pad_force: of each pad ``[n]`` [N].
        cpu_s: processor time ``[n]`` [s].
    """

    p_WO: np.ndarray
    R_WO: np.ndarray
    opening: np.ndarray
    pad_force: np.ndarray
    cpu_s: np.ndarray

    @property
    def lifted(self) -> np.ndarray:
        """Whether the cube rose with the hand ``[n]``."""
        return self.p_WO[:, 2] > REST_HEIGHT + LIFT / 2

    @property
    def orientation(self) -> np.ndarray:
        """Nearest of the 48 orientations ``[n]``."""
        return nearest_orientation(self.R_WO)[0]

    @property
    def face(self) -> np.ndarray:
        """The face that is down ``[n]``, 0…5 in the order of Table 4.1."""
        return self.orientation // N_YAWS

    @property
    def yaw(self) -> np.ndarray:
        """Angle of the cube's x about the vertical ``[n]`` [degrees]."""
        return np.degrees(np.arctan2(self.R_WO[:, 1, 0], self.R_WO[:, 0, 0]))


Engine = Callable[[Sequence[Grasp]], Ends]


def in_drake(rig: TrialRig, grasps: Sequence[Grasp]) -> Ends:
    """Run grasps as our trials do."""
    ends: dict[str, list[Any]] = {name: [] for name in Ends.__annotations__}
    for grasp in grasps:
        began = time.process_time()
        scene = TrialScene(rig, R_WG[grasp.gripper], friction=grasp.friction, mass=MASS)
        X_WO = RigidTransform(RotationMatrix(grasp.R_WO), grasp.p_WO)
        scene.start(grasp.p_WG, gripper.MAX_OPENING, X_WO)
        scene.command(grasp.p_WG, 0.0)
        scene.advance(COURSE.close_s)
        scene.command(grasp.p_WG + np.array([0.0, 0.0, LIFT]), 0.0)
        scene.advance(LIFT / SPEED + COURSE.settle_s)
        ends["p_WO"].append(scene.X_WO.translation())
        ends["R_WO"].append(scene.X_WO.rotation().matrix())
        ends["opening"].append(scene.opening)
        ends["pad_force"].append(scene.pad_force)
        ends["cpu_s"].append(time.process_time() - began)
    return Ends(**{name: np.array(values) for name, values in ends.items()})


def touch_with_pads_alone(rig: TrialRig) -> None:
    """Let cubes pass through every part of a rig's gripper but its pads."""
    inspector = rig.scene_graph.model_inspector()
    frame = rig.plant.GetBodyFrameIdOrThrow(rig.cube.index())
    cube = inspector.GetGeometries(frame, Role.kProximity)
    others = [shape for shape in rig.hand_shapes if not inspector.GetName(shape).endswith("_pad")]
    rig.scene_graph.collision_filter_manager().Apply(
        CollisionFilterDeclaration().ExcludeBetween(GeometrySet(cube), GeometrySet(others))
    )


def in_mujoco(peers: Peers, grasps: Sequence[Grasp], *, pads_alone: bool = False) -> Ends:
    """Run grasps in MuJoCo, with the whole gripper or two pads on slides."""
    at_cube = float(gripper.closing_rate(gripper.knuckle_angle(CUBE_EDGE)))
    hand: dict[str, Any]
    if pads_alone:
        # Gains and speed are the knuckles', seen at the pads.
        hand = {
            "urdf": "",
            "closing": [0.0, gripper.MAX_OPENING / 2],
            "speed": KNUCKLE_SPEED * at_cube,
            "effort": GRIP_FORCE,
            "gains": [100.0 / at_cube**2, 2.0 / at_cube**2],
        }
    else:
        hand = {
            "urdf": str(DESCRIPTION / "robotiq_2f_85.urdf"),
            "closing": gripper.knuckle_angle([gripper.MAX_OPENING, 0.0]),
            "speed": KNUCKLE_SPEED,
            "effort": GRIP_FORCE * at_cube,
            "gains": [100.0, 2.0],
        }
    scene = {
        "edge": CUBE_EDGE,
        "mass": MASS,
        "table_size": TABLE,
        "table_centre": [*COLUMN, TABLE_TOP - TABLE[2] / 2],
        "gantry_speed": SPEED,
        "time_step": COURSE.time_step,
        "close_s": COURSE.close_s,
        "lift": LIFT,
        "lift_s": LIFT / SPEED + COURSE.settle_s,
        "tcp": gripper.TCP_FROM_FLANGE,
        "pad": PAD,
    }
    trials = {
        "p_WG": [grasp.p_WG for grasp in grasps],
        "R_WG": [R_WG[grasp.gripper] for grasp in grasps],
        "p_WO": [grasp.p_WO for grasp in grasps],
        "R_WO": [grasp.R_WO for grasp in grasps],
        "friction": [grasp.friction for grasp in grasps],
    }
    given = {name: np.array(value) for name, value in (scene | hand | trials).items()}
    ends = peers.run("mujoco_grasp.py", **given)
    joint, effort = ends.pop("joint"), ends.pop("effort")
    if pads_alone:
        opening, force = gripper.MAX_OPENING - 2 * joint, effort
    else:
        opening, force = gripper.opening(joint), effort / gripper.closing_rate(joint)
    return Ends(opening=opening, pad_force=force, **ends)
