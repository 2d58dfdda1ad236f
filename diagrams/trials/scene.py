"""One simulation of a grasp trial on its rig: what it is told, and what it shows."""

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator

from diagrams.contact import set_cube_mass, set_friction
from diagrams.falls.scene import Hand
from diagrams.faults import simulating
from diagrams.gripper_controller import KNUCKLE_SPEED, add_finger_inertia
from diagrams.trials.landing import Release, come_to_rest
from diagrams.trials.rig import TrialRig
from models.scenes import gripper
from models.task.spaces import CUBE_EDGE

LONGEST_STEP = 0.0987
"""Of the integrator with error control [s]. Phases last multiples of it never: what rounding would
leave of one is a step of 1e-16 s, after which velocities mean nothing."""
FASTEST_KNUCKLE = 50.0
"""A simulation in which one turns faster has come apart: commanded are 0.5 [rad/s]."""
_LETTING_GO = 0.1  # the force of the pads is gone sooner after it begins to go down [s]
_GLANCE = 0.005  # between two looks at whether it is gone [s]
_X_GB = RigidTransform([0.0, 0.0, -gripper.TCP_FROM_FLANGE])
"""The gripper's base in the frame of the tool centre point."""


class TrialScene:
    """One simulation on a rig, from a fresh context."""

    def __init__(
        self,
        rig: TrialRig,
        R_WG: np.ndarray,
        turn_W: np.ndarray | None = None,
        *,
        friction: float,
        mass: float,
        restitution: float | None = None,
        accuracy: float | None = None,
    ) -> None:
        """Set what stays the same through a trial.

        Args:
            rig: the diagram.
            R_WG: the gripper's orientation at the start ``[3, 3]``.
            turn_W: rotation vector in W ``[3]`` [rad], not zero, that `command` may turn the
                gripper by; none if absent.
            friction: coefficient, of everything.
            mass: of the cube [kg].
            restitution: of cube and table, if a fall has a scene of its own.
            accuracy: of CENIC, if that is the rig's solver; by default the rig's own.
        """
        self._rig, self._mass = rig, mass
        self._material = {"friction": friction, "mass": mass}
        if restitution is not None:
            self._material["restitution"] = restitution
        self.clearance = np.inf
        """Smallest distance between hand and table after any `advance` so far [m]."""
        self._simulator = Simulator(rig.diagram)
        self._root = self._simulator.get_mutable_context()
        self._context = rig.plant.GetMyMutableContextFromRoot(self._root)
        self.turn_angle = 0.0 if turn_W is None else float(np.linalg.norm(turn_W))
        """Of the turn that `command` may ask for [rad]."""
        self.accuracy = 0.0
        """Of CENIC; 0 with the discrete solver."""
        if rig.landing:
            ResetIntegratorFromFlags(self._simulator, "cenic", LONGEST_STEP)
            self._use(self._usual if accuracy is None else accuracy)
        # Frame A has its z along the axis.
        axis_W = (
            turn_W / self.turn_angle if turn_W is not None and self.turn_angle else [0.0, 0.0, 1.0]
        )
        R_WA = RotationMatrix.MakeFromOneVector(np.asarray(axis_W), 2)
        R_AG = R_WA.inverse() @ RotationMatrix(R_WG)
        rig.axis.SetPoseInParentFrame(self._context, RigidTransform(R_WA))
        rig.mount.SetPoseInParentFrame(self._context, RigidTransform(R_AG) @ _X_GB)
        set_friction(rig.plant, rig.scene_graph, self._root, friction)
        set_cube_mass(rig.plant, self._context, mass)
        if rig.landing:
            add_finger_inertia(rig.plant, self._context, rig.hand, rig.config.finger_inertia)

    @property
    def _usual(self) -> float:
        config = self._rig.config
        return config.turning_accuracy if self.turn_angle else config.accuracy

    def _use(self, accuracy: float) -> None:
        self.accuracy = accuracy
        self._simulator.get_mutable_integrator().set_target_accuracy(accuracy)

    def relax(self) -> None:
        """Go on with the rig's own accuracy."""
        if self._rig.landing and self.accuracy != self._usual:
            self._use(self._usual)
            # The integrator reads its accuracy when it begins.
            self._simulator.get_mutable_integrator().Initialize()

    def start(self, p_WG: np.ndarray, width: float, X_WO: RigidTransform) -> None:
        """Put gripper (opening in metres) and cube in place, at rest.

        Raises:
            SimulatorFault: if Drake cannot begin there.
        """
        rig = self._rig
        rig.plant.SetPositions(self._context, rig.gantry, [*p_WG, 0.0])
        angles = gripper.joint_positions(float(gripper.knuckle_angle(width)))
        for name, angle in zip(gripper.JOINTS, angles, strict=True):
            rig.plant.GetJointByName(name, rig.hand).set_angle(self._context, angle)
        rig.plant.SetFreeBodyPose(self._context, rig.cube, X_WO)
        rig.references.start(self._root, [*p_WG, 0.0], width)
        self.support(False)
        with simulating():
            self._simulator.Initialize()

    def command(self, p_WG: np.ndarray, width: float, *, turned: bool = False) -> None:
        """Send tool centre point and opening on their way [m], and the gripper to its turn."""
        gantry = [*p_WG, self.turn_angle if turned else 0.0]
        self._rig.references.command(self._root, gantry, width)

    def support(self, on: bool) -> None:
        """Carry the cube's weight, while the fingers have not closed on it yet."""
        force = np.zeros(self._rig.plant.num_velocities())
        # A free body's velocities in the plant: angular, then linear; the last is along z.
        last = self._rig.cube.floating_velocities_start_in_v() + 5
        weight = -self._mass * self._rig.plant.gravity_field().gravity_vector()[2]
        force[last] = weight if on else 0.0
        self._rig.diagram.GetInputPort("support").FixValue(self._root, force)

    def advance(self, seconds: float) -> None:
        """Simulate on.

        Raises:
            SimulatorFault: if the solver fails.
        """
        with simulating():
            self._simulator.AdvanceTo(self._root.get_time() + seconds)
            self._check_knuckle()
            # Asked within: this is where a pose that is not finite any more shows.
            self.clearance = min(self.clearance, self._hand_to_table())

    def _check_knuckle(self) -> None:
        """Refuse a state that no hand can be in: such were seen from one moment to the next."""
        rate = abs(self._rig.knuckle.get_angular_rate(self._context))
        if rate > FASTEST_KNUCKLE:
            raise RuntimeError(f"the simulation came apart: a knuckle turns at {rate:.3g} rad/s")

    def let_go(self) -> None:
        """Simulate an opening hand up to where its fingers no longer press on the cube.

        A closed hand's command lies far beyond what it holds: it opens a while after it is told.

        Raises:
            SimulatorFault: if the solver fails.
        """
        rig = self._rig
        beyond = rig.references.knuckle(self._root) - rig.knuckle.get_angle(self._context)
        self.advance(max(0.0, beyond / KNUCKLE_SPEED - _LETTING_GO))
        deadline = self.time + 2 * _LETTING_GO
        while self.pad_force > 0.0 and self.time < deadline:
            self.advance(_GLANCE)

    def land(self, *, opens: bool, rise: float, limit: float) -> None:
        """Let a cube that the hand does not hold come to rest.

        Args:
            opens: whether the fingers are opening.
            rise: as `come_to_rest` takes it.
            limit: the same.

        Raises:
            SimulatorFault: if the solver fails.
        """
        rig, context = self._rig, self._context
        assert rig.landing is not None
        hand = Hand(rig.palm.EvalPoseInWorld(context), rig.knuckle.get_angle(context))
        V_WO = rig.cube.EvalSpatialVelocityInWorld(context)
        release = Release(hand, opens, self.X_WO, V_WO)
        fall = come_to_rest(rig.landing, release, rise, limit, **self._material)
        rig.plant.SetFreeBodyPose(context, rig.cube, fall.X_WO)
        rig.plant.SetFreeBodySpatialVelocity(context=context, body=rig.cube, V_JpJc=fall.V_WO)

    @property
    def time(self) -> float:
        """Since the start [s]."""
        return self._root.get_time()

    @property
    def X_WO(self) -> RigidTransform:
        """Pose of the cube."""
        return self._rig.cube.EvalPoseInWorld(self._context)

    @property
    def X_WG(self) -> RigidTransform:
        """Pose of the tool centre point."""
        return self._rig.palm.EvalPoseInWorld(self._context) @ _X_GB.inverse()

    @property
    def X_GO(self) -> RigidTransform:
        """Pose of the cube in the gripper."""
        return self.X_WG.inverse() @ self.X_WO

    @property
    def opening(self) -> float:
        """Between the pads [m]."""
        return float(gripper.opening(self._rig.knuckle.get_angle(self._context)))

    @property
    def pad_force(self) -> float:
        """Of each pad [N]."""
        torque = self._rig.plant.get_net_actuation_output_port(self._rig.hand).Eval(self._context)
        rate = gripper.closing_rate(self._rig.knuckle.get_angle(self._context))
        return float(torque.mean() / rate)

    @property
    def cube_speed(self) -> float:
        """Of the cube, its spin counted at an edge's length [m/s]."""
        velocity = self._rig.cube.EvalSpatialVelocityInWorld(self._context)
        spin = np.linalg.norm(velocity.rotational()) * CUBE_EDGE
        return float(np.linalg.norm(velocity.translational()) + spin)

    def _hand_to_table(self) -> float:
        rig = self._rig
        port = rig.scene_graph.get_query_output_port()
        query = port.Eval(rig.scene_graph.GetMyContextFromRoot(self._root))
        return min(
            query.ComputeSignedDistancePairClosestPoints(shape, table).distance
            for shape in rig.hand_shapes
            for table in rig.table_shapes
        )
