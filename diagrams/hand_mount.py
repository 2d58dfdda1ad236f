"""How the hand sits on the arm: a body of its own, held to the flange by constraints.

In a discrete step h every body moves by h times its new velocity: a free one along a straight line,
one at the end of an arm along the arm's arc. A cube in a hand that is part of the arm's tree would
lag behind it by ½·h·∫a dt, a the acceleration of the hand on its way: 1 mm in one swing at 2 ms,
for friction resists a speed, no distance. A hand that is a free body itself, joined to the world
at its tool centre point, moves as the cube does, and the constraints lead both along the arc.
"""

import numpy as np
from pydrake.common.schema import Transform
from pydrake.geometry import CollisionFilterDeclaration, SceneGraph
from pydrake.math import RigidTransform
from pydrake.multibody.parsing import (
    AddFrame,
    FlattenModelDirectives,
    LoadModelDirectives,
    ModelDirective,
    ProcessModelDirectives,
)
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import QuaternionFloatingJoint
from pydrake.systems.framework import Context

from models.scenes.parsing import ARM, DESCRIPTION, GRIPPER, strict_parser

BASE = "arm_base"
"""Frame of the world that a robot stands in whose base can be moved."""
_ANGLES = np.radians([0.0, 120.0, 240.0])
_POINTS = np.column_stack([0.06 * np.cos(_ANGLES), 0.06 * np.sin(_ANGLES), np.full(3, 0.05)])
"""Of the gripper's base that are held [m]: around its centre of mass, apart against turns.
Drake softens a constraint by the least inertia it meets; its weld, by that of the hand's turns,
lets the hand sag by 3 mm, these by 0.02."""


class HandMount:
    """The scene of ``station.dmd.yaml``, with constraints in place of the weld at the flange.

    The hand's pose is state: seven positions and six velocities before those of its fingers. It
    keeps to the flange within 0.03 mm and 0.02° at the arm's speeds; whoever sets the arm's angles
    in a context puts it there by `place`.
    """

    def __init__(self, plant: MultibodyPlant, *, movable_base: bool = False) -> None:
        """Add the scene to ``plant``, before it is finalized.

        A plant with continuous state has no such constraints: there nothing holds the hand.

        Args:
            plant: what the scene is added to.
            movable_base: whether the robot stands in a frame `BASE` of the world, whose pose is a
                parameter of the context.
        """
        parser = strict_parser(plant)
        scene = FlattenModelDirectives(
            LoadModelDirectives(str(DESCRIPTION / "station.dmd.yaml")), parser.package_map()
        )
        (at,) = (
            i
            for i, each in enumerate(scene.directives)
            if each.add_weld is not None and each.add_weld.child == f"{GRIPPER}::base"
        )
        weld = scene.directives[at].add_weld
        X_FB = weld.X_PC.GetDeterministicValue()
        arm, _, flange = weld.parent.partition("::")
        scene.directives = scene.directives[:at] + scene.directives[at + 1 :]
        if movable_base:
            scene.directives = _standing_in(BASE, scene.directives)
        ProcessModelDirectives(scene, parser)

        self._plant = plant
        self._base = base = plant.GetBodyByName("base", plant.GetModelInstanceByName(GRIPPER))
        tcp = plant.GetFrameByName("tcp")
        self._flange = plant.GetBodyByName(flange, plant.GetModelInstanceByName(arm))
        self._joint = plant.AddJoint(QuaternionFloatingJoint("hand", plant.world_frame(), tcp))
        if plant.time_step() > 0.0:
            for point in _POINTS:
                plant.AddBallConstraint(self._flange, X_FB @ point, base, point)
        self._X_FG = X_FB @ tcp.GetFixedPoseInBodyFrame()

    def let_touch(self, scene_graph: SceneGraph) -> None:
        """Let hand and wrist touch, as what a weld joins may; call before contexts are made."""
        wrist, palm = (
            self._plant.CollectRegisteredGeometries(self._plant.GetBodiesWeldedTo(body))
            for body in (self._flange, self._base)
        )
        touching = CollisionFilterDeclaration().ExcludeBetween(wrist, palm)
        scene_graph.collision_filter_manager().Apply(touching)

    def move_base(self, context: Context, X: RigidTransform) -> None:
        """Move the robot, in its own base's frame, from where it stands if that can be moved."""
        frame = self._flange.GetParentPlant().GetFrameByName(BASE)
        frame.SetPoseInParentFrame(context, frame.GetPoseInParentFrame(context) @ X)

    def place(self, context: Context) -> None:
        """Put the hand where the arm's angles have the flange, in a context of the plant."""
        X_WF = self._flange.EvalPoseInWorld(context)
        self._joint.SetPose(context, X_WF @ self._X_FG)


def _standing_in(frame: str, directives: list[ModelDirective]) -> list[ModelDirective]:
    """The same scene, with the arm welded to a frame of the world where it was to the world."""
    (at,) = (
        i
        for i, each in enumerate(directives)
        if each.add_weld is not None and each.add_weld.child.startswith(f"{ARM}::")
    )
    weld = directives[at].add_weld
    X_PF = Transform(weld.X_PC.GetDeterministicValue())
    X_PF.base_frame = weld.parent
    weld.parent, weld.X_PC = frame, Transform()
    return [
        *directives[:at],
        ModelDirective(add_frame=AddFrame(name=frame, X_PF=X_PF)),
        ModelDirective(add_weld=weld),
        *directives[at + 1 :],
    ]
