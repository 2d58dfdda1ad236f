"""One Bernoulli experiment with a floating gripper: grasp the cube, or drop it (thesis 4.1.3, 5.9).

What happens between pads, cube and table does not need the arm, so three slides carry the
gripper. A trial draws a noisy initial state, executes one action, lets things settle, and
records the outcome with every number behind the verdict.
"""

import time
from dataclasses import asdict, dataclass, field
from enum import StrEnum

import numpy as np
from pydrake.geometry import ProximityProperties, RoleAssign
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction
from pydrake.multibody.tree import FixedOffsetFrame, PdControllerGains, SpatialInertia, UnitInertia
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from diagrams.contact import TIME_STEP, use_grasp_contact
from diagrams.gripper_controller import GripperController, prepare_gripper
from diagrams.reference_ramp import ReferenceRamp
from diagrams.state_identifier import is_held
from models import gripper
from models.gripper_poses import RETREAT, grasp_position
from models.rotations import (
    geodesic_angle,
    matrix_to_rotation_vector,
    rotation_vector_to_matrix,
)
from models.scene import CUBE, add_models
from models.task.spaces import CUBE_EDGE, GRID_Z, R_WG, R_WO, REST_HEIGHT, Kind


@dataclass(frozen=True)
class TrialConfig:
    """Everything that decides a trial's outcome besides its pair and seed.

    The noise stands for what a real cell does to an action that repeats: perception and
    placement errors of a few millimetres and degrees, pads that wear, cubes that differ.
    """

    time_step: float = TIME_STEP
    """Of the discrete solver [s]."""
    position_sd: float = 0.002
    """Of the cube's place against the gripper's target, in x and y [m]."""
    yaw_sd: float = 0.05
    """Of a free cube's yaw against its nominal orientation [rad]."""
    tilt_sd: float = 0.02
    """Of a held cube's turn about the closing axis, and of the gripper's tilt [rad]."""
    friction: tuple[float, float] = (0.6, 0.9)
    """Range of the coefficient of friction of cube, pads and table, uniform."""
    mass: tuple[float, float] = (0.08, 0.12)
    """Range of the cube's mass, uniform [kg]."""
    close_s: float = 1.3
    """From the command to close until the lift [s]."""
    settle_s: float = 0.3
    """Of rest after a motion, before the state is identified [s]."""
    release_s: float = 0.8
    """From the command to open until the gripper withdraws [s]."""
    rest_limit_s: float = 3.0
    """Longest wait for a released cube to come to rest [s]."""


@dataclass(frozen=True)
class Pair:
    """What is tried: the action, from which nominal state, at the table's middle.

    Attributes:
        kind: GRASP or DROP.
        orientation: the cube's nominal orientation 0…47.
        gripper: gripper orientation 0…17, the grasp's or the one that holds the cube.
        layer: 0 or 1, the height z = 0.55 or 0.60 m of a drop; 0 for a grasp.
    """

    kind: Kind
    orientation: int
    gripper: int
    layer: int = 0


class Outcome(StrEnum):
    """What became of the cube."""

    HELD = "held"
    FREE = "free"
    FAULT = "fault"


@dataclass(frozen=True)
class TrialRecord:
    """A trial's outcome and the numbers behind it; world axes, metres, radians, newtons.

    Attributes:
        outcome: `HELD` or `FREE`; `FAULT` if the simulator failed, which judges nothing.
        turn: rotation vector of R_WO_after · R_WOᵀ, from the nominal orientation.
        displacement: of the cube's centre, from the nominal column or cell.
        lift_height: how far the cube's centre rose (grasp), or its height above rest (drop).
        slip: motion of the cube in the hand during the lift, or while it was held.
        in_hand_rotation: turn of the cube against the gripper over the same time.
        pad_force: force of each pad before the lift or the release.
        opening: of the pads at that moment.
        speed: of the cube when the outcome was read [m/s].
        noise: what was drawn.
        fault: the simulator's message, empty if none.
        cpu_s: processor time [s]; not part of the outcome.
    """

    outcome: Outcome
    turn: tuple[float, float, float] = (0.0, 0.0, 0.0)
    displacement: tuple[float, float, float] = (0.0, 0.0, 0.0)
    lift_height: float = 0.0
    slip: float = 0.0
    in_hand_rotation: float = 0.0
    pad_force: float = 0.0
    opening: float = 0.0
    speed: float = 0.0
    noise: dict[str, float] = field(default_factory=dict)
    fault: str = ""
    cpu_s: float = 0.0

    def as_dict(self) -> dict:
        """Return plain values, ready for JSON."""
        return asdict(self)


MODEL_FILES = ("table.sdf", "gantry.urdf", "robotiq_2f_85.urdf", "cube.sdf")
"""What a trial's scene consists of."""
COLUMN = np.array([0.55, 0.0])
"""Where trials happen: x, y of the table's middle [m]. The place does not matter (5.9.1)."""
FLUSH_LIMIT = np.radians(22.5)
"""Largest misalignment [rad] that closing fingers turn flush; beyond it edges jam."""
GRAVITY = 9.81
LIFT_SPEED = 0.1
WITHDRAWAL = 0.1
"""How far the open gripper rises after a release [m]."""


class TrialRig:
    """A diagram built once that runs any number of trials, each from a fresh context.

    ::

       gantry.position_command ── ReferenceRamp ──┐
                                                  ├── plant: slides, 2F-85, cube, table
       gripper.position_command ── GripperController
    """

    def __init__(self, config: TrialConfig | None = None) -> None:
        """Build the diagram."""
        self.config = config or TrialConfig()
        builder = DiagramBuilder()
        plant, self._scene_graph = AddMultibodyPlantSceneGraph(builder, self.config.time_step)
        use_grasp_contact(plant)
        add_models(plant, *MODEL_FILES)
        table = RigidTransform([*COLUMN, 0.5])
        plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("table"), table)
        plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("rail"))
        # The gripper's orientation is a parameter of the context: one plant serves all 18.
        self._mount = plant.AddFrame(
            FixedOffsetFrame("mount", plant.GetFrameByName("carriage"), RigidTransform())
        )
        self._hand = plant.GetModelInstanceByName("robotiq_2f_85")
        self._gantry = plant.GetModelInstanceByName("gantry")
        plant.WeldFrames(self._mount, plant.GetFrameByName("base", self._hand))
        prepare_gripper(plant, self._hand)
        for axis in "xyz":
            actuator = plant.GetJointActuatorByName(axis, self._gantry)
            actuator.set_controller_gains(PdControllerGains(p=2e4, d=600.0))
        for instance in (self._hand, self._gantry):
            plant.set_gravity_enabled(instance, False)
        plant.Finalize()
        self._plant = plant
        self._cube = plant.GetBodyByName(CUBE)

        self._gripper = GripperController.add_to_builder(builder, plant, self._hand)
        self._ramp = builder.AddNamedSystem(
            "gantry_ramp", ReferenceRamp(3, speed=LIFT_SPEED, period=self.config.time_step)
        )
        builder.Connect(
            self._ramp.get_output_port(), plant.get_desired_state_input_port(self._gantry)
        )
        builder.ExportInput(self._ramp.get_input_port(), "gantry.position_command")
        builder.ExportInput(
            self._gripper.GetInputPort("position_command"), "gripper.position_command"
        )
        builder.ExportInput(plant.get_applied_generalized_force_input_port(), "support")
        self._diagram = builder.Build()

    def run(self, pair: Pair, seed: int | np.random.SeedSequence) -> TrialRecord:
        """Run one trial; the record depends on configuration, pair and seed alone."""
        started = time.process_time()
        noise = _draw(self.config, np.random.default_rng(seed))
        try:
            record = _Trial(self, pair, noise).run()
        except RuntimeError as error:  # Drake reports a failed solver step this way.
            record = {"outcome": Outcome.FAULT, "fault": str(error).splitlines()[0]}
        return TrialRecord(noise=noise, cpu_s=time.process_time() - started, **record)


def _draw(config: TrialConfig, rng: np.random.Generator) -> dict[str, float]:
    """Draw every random quantity of a trial, always all and in the same order."""
    return {
        "x": rng.normal(0.0, config.position_sd),
        "y": rng.normal(0.0, config.position_sd),
        "yaw": rng.normal(0.0, config.yaw_sd),
        "turn_about_closing": rng.normal(0.0, config.tilt_sd),
        "gripper_roll": rng.normal(0.0, config.tilt_sd),
        "gripper_pitch": rng.normal(0.0, config.tilt_sd),
        "friction": rng.uniform(*config.friction),
        "mass": rng.uniform(*config.mass),
    }


class _Trial:
    """The course of one trial on a rig."""

    def __init__(self, rig: TrialRig, pair: Pair, noise: dict[str, float]) -> None:
        self.rig, self.pair, self.noise, self.config = rig, pair, noise, rig.config
        self.simulator = Simulator(rig._diagram)
        self.root = self.simulator.get_mutable_context()
        self.context = rig._plant.GetMyMutableContextFromRoot(self.root)
        tilt = rotation_vector_to_matrix([noise["gripper_roll"], noise["gripper_pitch"], 0.0])
        self.R_WG = RotationMatrix(R_WG[pair.gripper] @ tilt)
        self.R_nominal = R_WO[pair.orientation]
        self._set_friction_and_mass()

    def run(self) -> dict:
        return self._grasp() if self.pair.kind == Kind.GRASP else self._drop()

    def _grasp(self) -> dict:
        """Close on a cube at rest, lift it to the held layer."""
        config, noise = self.config, self.noise
        offset = np.array([noise["x"], noise["y"], 0.0])
        p_nominal = np.array([*COLUMN, REST_HEIGHT])
        R_before = rotation_vector_to_matrix([0.0, 0.0, noise["yaw"]]) @ self.R_nominal
        X_before = RigidTransform(RotationMatrix(R_before), p_nominal)
        p_WG = grasp_position(p_nominal, self.pair.gripper) + offset
        self._start(p_WG, gripper.MAX_OPENING, X_before)
        self._command(p_WG, 0.0)
        self.simulator.AdvanceTo(config.close_s)
        grip, X_GO = self._grip(), self._X_GO()
        p_WG[2] = GRID_Z[0]
        self._command(p_WG, 0.0)
        lift = (GRID_Z[0] - REST_HEIGHT) / LIFT_SPEED
        self.simulator.AdvanceTo(config.close_s + lift + config.settle_s)
        X_after = self._X_WO()
        held = is_held(self._X_GO().translation(), *self._grip().values())
        return {
            "outcome": Outcome.HELD if held else Outcome.FREE,
            **self._change(X_after, p_nominal),
            "lift_height": float(X_after.translation()[2] - REST_HEIGHT),
            **self._in_hand(X_GO),
            **grip,
            "speed": self._speed(),
        }

    def _drop(self) -> dict:
        """Hold the cube as a grasp leaves it, open, withdraw, wait for rest."""
        config = self.config
        p_WG = np.array([*COLUMN, GRID_Z[self.pair.layer]])
        X_WG = RigidTransform(self.R_WG, p_WG)
        X_GO = self._held_pose()
        closing_extent = CUBE_EDGE * float(np.abs(X_GO.rotation().matrix()[1]).sum())
        self._start(p_WG, closing_extent + 5e-4, X_WG @ X_GO)
        self._support(True)
        self._command(p_WG, 0.0)
        self.simulator.AdvanceTo(config.settle_s)
        self._support(False)
        self.simulator.AdvanceTo(2 * config.settle_s)
        before = {**self._grip(), **self._in_hand(X_GO)}
        self._command(p_WG, gripper.MAX_OPENING)
        self._advance(config.release_s)
        self._command(p_WG + np.array([0.0, 0.0, WITHDRAWAL]), gripper.MAX_OPENING)
        self._advance(WITHDRAWAL / LIFT_SPEED)
        deadline = self.root.get_time() + config.rest_limit_s
        while self._speed() > 1e-3 and self.root.get_time() < deadline:
            self._advance(config.settle_s)
        X_after = self._X_WO()
        return {
            "outcome": Outcome.FREE,
            **self._change(X_after, p_WG),
            "lift_height": float(X_after.translation()[2] - REST_HEIGHT),
            **before,
            "speed": self._speed(),
        }

    def _held_pose(self) -> RigidTransform:
        """X_GO with which a held state begins: what a grasp would have left, and noise.

        Closing turns a nearly flush cube flush; one that is further off is held by its edges.
        A cube that shows the palm an edge was grasped with the fingers drawn back.
        """
        noise = self.noise
        R_GO = R_WG[self.pair.gripper].T @ self.R_nominal
        flush = R_GO @ self._turn_to_flush(R_GO)
        if geodesic_angle(R_GO, flush) < FLUSH_LIMIT:
            R_GO = flush
        R_GO = rotation_vector_to_matrix([0.0, noise["turn_about_closing"], 0.0]) @ R_GO
        depth = 0.5 * CUBE_EDGE * np.abs(R_GO[2]).sum()
        drawn_back = RETREAT if depth > 0.6 * CUBE_EDGE else 0.0
        # Within the pads' plane; across it the fingers centre the cube.
        return RigidTransform(RotationMatrix(R_GO), [noise["x"], 0.0, noise["y"] + drawn_back])

    @staticmethod
    def _turn_to_flush(R_GO: np.ndarray) -> np.ndarray:
        """Smallest turn, in the cube's frame, that lays a face's normal along the closing axis."""
        closing_O = R_GO[1]
        normal_O = np.zeros(3)
        nearest = int(np.abs(closing_O).argmax())
        normal_O[nearest] = np.sign(closing_O[nearest])
        axis = np.cross(closing_O, normal_O)
        sine = float(np.linalg.norm(axis))
        if sine < 1e-12:
            return np.eye(3)
        angle = np.arctan2(sine, float(closing_O @ normal_O))
        # R_GO · turn has the normal as its closing row: rotate the closing axis onto it.
        return rotation_vector_to_matrix(-angle * axis / sine)

    def _start(self, p_WG: np.ndarray, width: float, X_WO: RigidTransform) -> None:
        rig = self.rig
        p_GB = np.array([0.0, 0.0, -gripper.TCP_FROM_FLANGE])
        rig._mount.SetPoseInParentFrame(self.context, RigidTransform(self.R_WG, self.R_WG @ p_GB))
        rig._plant.SetPositions(self.context, rig._gantry, p_WG)
        angles = gripper.joint_positions(float(gripper.knuckle_angle(width)))
        for name, angle in zip(gripper.JOINTS, angles, strict=True):
            rig._plant.GetJointByName(name, rig._hand).set_angle(self.context, angle)
        rig._plant.SetFreeBodyPose(self.context, rig._cube, X_WO)
        rig._ramp.set_reference(rig._ramp.GetMyMutableContextFromRoot(self.root), p_WG)
        rig._gripper.set_opening(self.root, width)
        self._support(False)
        self.simulator.Initialize()

    def _set_friction_and_mass(self) -> None:
        rig, mu = self.rig, self.noise["friction"]
        inspector = rig._scene_graph.model_inspector()
        context = rig._scene_graph.GetMyMutableContextFromRoot(self.root)
        for geometry_id in inspector.GetAllGeometryIds():
            old = inspector.GetProximityProperties(geometry_id)
            if old is None:
                continue
            properties = ProximityProperties(old)
            properties.UpdateProperty("material", "coulomb_friction", CoulombFriction(mu, mu))
            rig._scene_graph.AssignRole(
                context,
                rig._plant.get_source_id(),
                geometry_id,
                properties,
                RoleAssign.kReplace,
            )
        rig._cube.SetSpatialInertiaInBodyFrame(
            self.context,
            SpatialInertia(self.noise["mass"], np.zeros(3), UnitInertia.SolidCube(CUBE_EDGE)),
        )

    def _command(self, p_WG: np.ndarray, width: float) -> None:
        diagram = self.rig._diagram
        diagram.GetInputPort("gantry.position_command").FixValue(self.root, p_WG)
        diagram.GetInputPort("gripper.position_command").FixValue(self.root, [width])

    def _support(self, on: bool) -> None:
        """Carry the cube's weight, while the fingers have not closed on it yet."""
        force = np.zeros(self.rig._plant.num_velocities())
        # A free body's velocities in the plant: angular, then linear; the last is along z.
        last = self.rig._cube.floating_velocities_start_in_v() + 5
        force[last] = self.noise["mass"] * GRAVITY if on else 0.0
        self.rig._diagram.GetInputPort("support").FixValue(self.root, force)

    def _advance(self, seconds: float) -> None:
        self.simulator.AdvanceTo(self.root.get_time() + seconds)

    def _X_WO(self) -> RigidTransform:
        return self.rig._cube.EvalPoseInWorld(self.context)

    def _X_GO(self) -> RigidTransform:
        p_WG = self.rig._plant.GetPositions(self.context, self.rig._gantry)
        return RigidTransform(self.R_WG, p_WG).inverse() @ self._X_WO()

    def _grip(self) -> dict[str, float]:
        context = self.rig._gripper.GetMyContextFromRoot(self.root)
        ports = {"opening": "position_measured", "pad_force": "force_measured"}
        return {
            name: float(self.rig._gripper.GetOutputPort(port).Eval(context)[0])
            for name, port in ports.items()
        }

    def _speed(self) -> float:
        velocity = self.rig._cube.EvalSpatialVelocityInWorld(self.context)
        spin = np.linalg.norm(velocity.rotational()) * CUBE_EDGE
        return float(np.linalg.norm(velocity.translational()) + spin)

    def _change(self, X_after: RigidTransform, p_nominal: np.ndarray) -> dict:
        turn = X_after.rotation().matrix() @ self.R_nominal.T
        return {
            "turn": tuple(float(v) for v in matrix_to_rotation_vector(turn)),
            "displacement": tuple(float(v) for v in X_after.translation() - p_nominal),
        }

    def _in_hand(self, X_GO_before: RigidTransform) -> dict[str, float]:
        change = X_GO_before.inverse() @ self._X_GO()
        moved = self._X_GO().translation() - X_GO_before.translation()
        return {
            "slip": float(np.linalg.norm(moved)),
            "in_hand_rotation": float(change.rotation().ToAngleAxis().angle()),
        }
