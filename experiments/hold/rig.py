"""The hand with the cube in it, shaken as the arm's swing shakes it.

The hand sits on three slides. It does not turn: the slides give it the acceleration less gravity
that the swing gives the arm's hand, in the hand's own axes, and gravity as it is at the start. What
hand and cube feel is then what they feel at the arm's end but for the hand's rotation, whose own
forces are below 0.6 m/s² at the faces of the cube and cancel over it.

The reason is numerical. In each step of a simulation a free body goes straight on, while a joint
that turns keeps to its arc. A cube in a hand that turns about a far axis creeps outwards by
½ · step · ∫ a dt, a being the acceleration towards the axis: by 1.3 mm in the widest swing here at
2 ms, which is arithmetic and no slip. Along slides both go straight.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, ContactResults
from pydrake.multibody.tree import (
    FixedOffsetFrame,
    PdControllerGains,
    PrismaticJoint,
    SpatialInertia,
    UnitInertia,
)
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource, TrajectorySource
from pydrake.trajectories import PiecewisePolynomial
from scipy.interpolate import CubicSpline

from diagrams.contact import set_cube_mass, set_friction, use_grasp_contact
from diagrams.faults import simulating
from diagrams.gripper_controller import prepare_gripper
from experiments.hold.held import AFTER, LOOK, SETTLE, Held, is_gone, judge
from experiments.hold.swings import Motion
from models.arrays import Array
from models.scenes import gripper
from models.scenes.parsing import CUBE, add_models
from models.task.spaces import CUBE_EDGE

_X_GB = RigidTransform([0.0, 0.0, -gripper.TCP_FROM_FLANGE])
_SLIDES = PdControllerGains(p=4e5, d=4e3)  # they lag by 15 µm per m/s²
_CARRIAGE = SpatialInertia(5.0, np.zeros(3), UnitInertia.SolidSphere(0.1))
_SLIDE = SpatialInertia(0.1, np.zeros(3), UnitInertia.SolidSphere(0.1))
_TRAVEL = 1e3  # how long the way is that a swing's replaces [s]


@dataclass(frozen=True)
class Load:
    """What is held, and how.

    Attributes:
        mass: of the cube [kg].
        friction: coefficient, of everything.
        force: of each pad [N].
    """

    mass: float
    friction: float
    force: float


class HoldRig:
    """A diagram for one grip force and time step, that serves any number of swings.

    ::

       slides ──── TrajectorySource ─┐
                                     ├── plant: slides, 2F-85, cube
       knuckles ── constant, shut ───┘
    """

    def __init__(self, force: float, time_step: float) -> None:
        """Build it.

        Args:
            force: of each pad [N].
            time_step: of the discrete solver [s].
        """
        builder = DiagramBuilder()
        plant, self.scene_graph = AddMultibodyPlantSceneGraph(builder, time_step)
        use_grasp_contact(plant)
        add_models(plant, "robotiq_2f_85.urdf", "cube.sdf")
        self.hand = plant.GetModelInstanceByName("robotiq_2f_85")
        self.slides = plant.AddModelInstance("slides")
        parent = plant.world_body()
        for i, axis in enumerate("xyz"):
            body = plant.AddRigidBody(axis, self.slides, _CARRIAGE if axis == "z" else _SLIDE)
            joint = plant.AddJoint(
                PrismaticJoint(axis, parent.body_frame(), body.body_frame(), np.eye(3)[i])
            )
            plant.AddJointActuator(axis, joint).set_controller_gains(_SLIDES)
            parent = body
        self.mount = plant.AddFrame(
            FixedOffsetFrame("mount", parent.body_frame(), RigidTransform())
        )
        plant.WeldFrames(self.mount, plant.GetFrameByName("base", self.hand))
        prepare_gripper(plant, self.hand, force)
        for instance in (self.hand, self.slides):
            plant.set_gravity_enabled(instance, False)
        plant.Finalize()
        self.plant = plant
        still = PiecewisePolynomial.FirstOrderHold([0.0, _TRAVEL], np.zeros((3, 2)))
        self.way = builder.AddSystem(TrajectorySource(still, 1))
        builder.Connect(self.way.get_output_port(), plant.get_desired_state_input_port(self.slides))
        shut = builder.AddSystem(ConstantVectorSource([gripper.KNUCKLE_LIMIT] * 2 + [0.0] * 2))
        builder.Connect(shut.get_output_port(), plant.get_desired_state_input_port(self.hand))
        self.diagram = builder.Build()
        self.cube = plant.GetBodyByName(CUBE)
        self.palm = plant.GetBodyByName("base", self.hand)
        self.knuckle = plant.GetJointByName("left_knuckle", self.hand)


@cache
def _rig(force: float, time_step: float) -> HoldRig:
    return HoldRig(force, time_step)


def hold(motion: Motion, load: Load, time_step: float) -> Held:
    """Hold the cube through a swing.

    Args:
        motion: the arm's.
        load: cube, friction and force.
        time_step: of the discrete solver [s], a divisor of `LOOK`.

    Raises:
        SimulatorFault: if the solver fails.
    """
    rig = _rig(load.force, time_step)
    plant = rig.plant
    simulator = Simulator(rig.diagram)
    root = simulator.get_mutable_context()
    context = plant.GetMyMutableContextFromRoot(root)
    R_WG = RotationMatrix(motion.R_WG)
    rig.mount.SetPoseInParentFrame(context, RigidTransform(R_WG) @ _X_GB)
    set_friction(plant, rig.scene_graph, root, load.friction)
    set_cube_mass(plant, context, load.mass)
    rig.way.UpdateTrajectory(slide_way(motion, plant.gravity_field().gravity_vector()))
    angles = gripper.joint_positions(float(gripper.knuckle_angle(CUBE_EDGE)))
    for name, angle in zip(gripper.JOINTS, angles, strict=True):
        plant.GetJointByName(name, rig.hand).set_angle(context, angle)
    plant.SetFreeBodyPose(context, rig.cube, RigidTransform(R_WG, np.zeros(3)))

    contacts = plant.get_contact_results_output_port()
    seen: list[tuple[RigidTransform, float, float]] = []
    with simulating():
        simulator.Initialize()
        for time in looks(motion):
            simulator.AdvanceTo(time)
            X_BW = rig.palm.EvalPoseInWorld(context).inverse()
            X_GO = _X_GB @ X_BW @ rig.cube.EvalPoseInWorld(context)
            force = pad_force(contacts.Eval(context), motion.R_WG[:, 1])
            seen.append((X_GO, rig.knuckle.get_angular_rate(context), force))
            if is_gone(X_GO):
                break
    poses, *numbers = zip(*seen, strict=True)
    return judge(poses, *map(np.array, numbers))


def looks(motion: Motion) -> Array:
    """Times of the looks at a swing, its end and what is after it included ``[n]`` [s]."""
    return SETTLE + LOOK * np.arange(round((motion.time[-1] + AFTER) / LOOK))


def pad_force(found: ContactResults, axis: Array) -> float:
    """Of each pad along their normal [N]; ``found`` are the cube's contacts with them alone.

    Args:
        found: contacts, hydroelastic.
        axis: the normal in the world ``[3]``.
    """
    surfaces = map(found.hydroelastic_contact_info, range(found.num_hydroelastic_contacts()))
    return sum(abs(float(axis @ info.F_Ac_W().translational())) for info in surfaces) / 2.0


def slide_way(motion: Motion, gravity: Array) -> PiecewisePolynomial:
    """The slides' way through a swing, after `SETTLE` at rest.

    Args:
        motion: the arm's.
        gravity: in the world ``[3]`` [m/s²].
    """
    a_W = gravity - motion.felt_G @ motion.R_WG.T
    speed = CubicSpline(motion.time, a_W).antiderivative()
    way = speed.antiderivative()
    time = np.concatenate([[0.0], SETTLE + motion.time])
    p, v = (np.vstack([np.zeros(3), f(motion.time)]) for f in (way, speed))
    # Then it goes on as it goes, at constant speed: what is felt is gravity alone.
    last = motion.time[-1]
    time = np.append(time, time[-1] + 1.0)
    p, v = np.vstack([p, way(last) + speed(last)]), np.vstack([v, speed(last)])
    return PiecewisePolynomial.CubicHermite(time, p.T, v.T)
