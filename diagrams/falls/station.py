"""A station in which a cube that nothing holds falls as in a `FallScene`.

The station is simulated in equal steps, too long for the blow of a landing. So while a cube is in
the air, and until it rests, a fall beside the station leads it: after every few of the
station's steps the cube is put where the fall has it. The fall in turn has the hand where the
station's is, and takes friction and mass from there.
"""

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import Simulator

from diagrams.contact import RESTITUTION, friction_of
from diagrams.falls.scene import AT_REST, Fall, FallScene, Hand, travel
from diagrams.faults import simulating
from models.scenes.parsing import CUBE, GRIPPER
from models.task.spaces import TABLE_TOP

PERIOD = 0.01
"""Between two looks at whether the cube falls, and two moments at which a fall leads it [s]."""
LOOK = 0.1
"""A cube at rest is looked at for so long [s]."""
_FALLS = 0.03
"""A cube that is faster may be falling [m/s]; one in the air is within a third of a period."""
_CLOSES = 0.1
"""Fingers close whose knuckles turn faster [rad/s]."""
_GONE = TABLE_TOP - 0.1
"""A cube below has missed the table [m]."""


class StationSimulator:
    """Simulates a diagram that has a station in it.

    ::

                   where the hand is
       simulator ───────────────────► Fall     from when the cube touches nothing
                 ◄───────────────────          until it rests, or something takes hold of it
                  where the cube is

    The fall knows of weight, table and hand. A cube that another force acts on is the station's.
    """

    def __init__(
        self,
        simulator: Simulator,
        plant: MultibodyPlant,
        scene: FallScene | None,
        restitution: float = RESTITUTION,
    ) -> None:
        """Simulate with ``simulator``.

        Args:
            simulator: of the diagram.
            plant: of the station.
            scene: where falls happen; without one, in the station's own steps.
            restitution: of cube and table, as `set_restitution` takes it.
        """
        self._simulator, self._plant, self._scene = simulator, plant, scene
        self._restitution = restitution
        hand = plant.GetModelInstanceByName(GRIPPER)
        self._root = simulator.get_mutable_context()
        self._context = plant.GetMyMutableContextFromRoot(self._root)
        self._cube = plant.GetBodyByName(CUBE)
        (free,) = plant.GetJointIndices(self._cube.model_instance())
        self._free = plant.get_joint(free)
        self._base = plant.GetBodyByName("base", hand)
        self._knuckle = plant.GetJointByName("left_knuckle", hand)
        self._fall: Fall | None = None
        self._seen: tuple[float, RigidTransform] = (0.0, RigidTransform())

    def advance_to(self, time: float) -> None:
        """Simulate up to a time [s], or until a monitor ends it.

        Raises:
            SimulatorFault: if Drake fails.
        """
        if self._scene is None:
            with simulating():
                self._simulator.AdvanceTo(time)
            return
        while (now := self._root.get_time()) < time:
            then = min(time, PERIOD * (np.floor(now / PERIOD + 1e-6) + 1))
            with simulating():
                if self._fall is None and self._falls():
                    self._begin(self._scene)
                hand = self._hand()
                self._simulator.AdvanceTo(then)
            if self._fall is not None:
                self._lead(self._fall, self._root.get_time() - now, hand)
            if self._root.get_time() < then:
                return

    @property
    def time(self) -> float:
        """Of the simulation [s]."""
        return self._root.get_time()

    @property
    def falling(self) -> bool:
        """Whether a fall leads the cube."""
        return self._fall is not None

    def _hand(self) -> Hand:
        X_WB = self._base.EvalPoseInWorld(self._context)
        return Hand(X_WB, self._knuckle.get_angle(self._context))

    def _falls(self) -> bool:
        """Whether the cube touches nothing, nothing pulls at it, and it moves."""
        # Of the cube's own joint, whose values are at hand: this is asked all the time.
        if np.linalg.norm(self._free.get_translational_velocity(self._context)) < _FALLS:
            return False
        if self._free.get_translation(self._context)[2] < _GONE or self._pulled():
            return False
        plant = self._plant
        shapes = set(plant.GetCollisionGeometriesForBody(self._cube))
        results = plant.get_contact_results_output_port().Eval(self._context)
        for i in range(results.num_hydroelastic_contacts()):
            surface = results.hydroelastic_contact_info(i).contact_surface()
            if {surface.id_M(), surface.id_N()} & shapes:
                return False
        own = self._cube.index()
        pairs = map(results.point_pair_contact_info, range(results.num_point_pair_contacts()))
        return all(own not in (pair.bodyA_index(), pair.bodyB_index()) for pair in pairs)

    def _pulled(self) -> bool:
        """Whether a force from outside acts on the cube."""
        port, own = self._plant.get_applied_spatial_force_input_port(), self._cube.index()
        forces = port.Eval(self._context) if port.HasValue(self._context) else ()
        return any(force.body_index == own for force in forces)

    def _begin(self, scene: FallScene) -> None:
        X_WO = self._cube.EvalPoseInWorld(self._context)
        self._fall = Fall(
            scene,
            X_WO,
            self._cube.EvalSpatialVelocityInWorld(self._context),
            friction=friction_of(self._plant, self._context),
            mass=self._cube.get_mass(self._context),
            restitution=self._restitution,
            settles=True,
        )
        self._seen = self._root.get_time(), X_WO

    def _lead(self, fall: Fall, seconds: float, before: Hand) -> None:
        """Bring the fall up to the station, and the station's cube to the fall's."""
        hand = self._hand()
        closes = hand.knuckle - before.knuckle > _CLOSES * seconds
        if closes or self._pulled():  # What is held is the station's.
            self._fall = None
            return
        fall.advance(seconds, before, hand)
        X_WO, plant = fall.X_WO, self._plant
        plant.SetFreeBodyPose(self._context, self._cube, X_WO)
        plant.SetFreeBodySpatialVelocity(context=self._context, body=self._cube, V_JpJc=fall.V_WO)
        now, (since, X_seen) = self._root.get_time(), self._seen
        if now - since >= LOOK * (1 - 1e-6):
            self._seen = now, X_WO
            if travel(X_seen, X_WO) < AT_REST or X_WO.translation()[2] < _GONE:
                self._fall = None
