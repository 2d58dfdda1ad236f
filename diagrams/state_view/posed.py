"""The station posed by hand: what a state looks like, and how an action would be carried out.

Nothing is simulated: arm, fingers and cube are put where the state's name, or a plan, has them.
"""

from collections.abc import Callable, Iterator, Sequence

import numpy as np
from pydrake.geometry import Meshcat, MeshcatVisualizer, MeshcatVisualizerParams
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.parsing import (
    AddModel,
    ModelDirective,
    ModelDirectives,
    ProcessModelDirectives,
)
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.framework import DiagramBuilder

from diagrams.execution.timeline import Timeline
from diagrams.state_view.viewer import FRAME, SPEED, Posture, Preview
from models.arrays import finite_number, finite_vector
from models.errors import ModelError
from models.maps.gripper_poses import RETREAT
from models.motion.failures import ActionFailure, Infeasible
from models.motion.moves import CLOSE, Grip, Move
from models.motion.planner import ActionPlanner
from models.scenes import gripper
from models.scenes.inputs import finite_pose
from models.scenes.parsing import ARM, CUBE, GRIPPER, PACKAGE, strict_parser
from models.scenes.planning_scene import HOME
from models.task.spaces import (
    CUBE_EDGE,
    LOST,
    POSITIONS,
    R_WG,
    R_WO,
    REST_HEIGHT,
    VERTICAL,
    Action,
    Kind,
    State,
)

_FINGERS = 0.1
"""Speed of the pads in a preview [m/s of the robot's time]."""
_FALL, _FLUSH = 0.3, 0.5
"""Until the fingers let a cube go, and again until it lies; until they have turned it flush [s]."""
_GHOSTS = (0.45, 0.25)
"""Opacities of the likeliest outcome and of the next one."""
_AWAY = RigidTransform([0.0, 0.0, -5.0])

Outcomes = Callable[[int, int], Sequence[tuple[int, float]]]
"""What may come of an action in a state: states and their probabilities, the likeliest first."""


class StateView:
    """A `Viewer` in Meshcat.

    Meshcat wants to be called from one thread only, the one that made it.
    """

    def __init__(self, meshcat: Meshcat, planner: ActionPlanner, outcomes: Outcomes) -> None:
        """Put the station into a view.

        Args:
            meshcat: where to show it.
            planner: plans the motions.
            outcomes: what may come of an action in a state.
        """
        self._planner, self._outcomes, self._meshcat = planner, outcomes, meshcat
        builder = DiagramBuilder()
        self._plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
        parser = strict_parser(self._plant)
        names = [f"ghost_{k}" for k in range(len(_GHOSTS))]
        cubes = [
            ModelDirective(add_model=AddModel(name=name, file=f"{PACKAGE}/cube.sdf"))
            for name in names
        ]
        parser.AddModels(url=f"{PACKAGE}/station.dmd.yaml")
        ProcessModelDirectives(ModelDirectives(directives=cubes), parser)
        self._plant.Finalize()
        visualizer = MeshcatVisualizer.AddToBuilder(
            builder, scene_graph, meshcat, MeshcatVisualizerParams(publish_period=1e6)
        )
        del visualizer
        self._diagram = builder.Build()
        self._root = self._diagram.CreateDefaultContext()
        self._context = self._plant.GetMyMutableContextFromRoot(self._root)
        self._arm, self._hand = (self._plant.GetModelInstanceByName(n) for n in (ARM, GRIPPER))
        self._tcp = self._plant.GetFrameByName("tcp")
        self._cube, *self._ghosts = (
            self._plant.GetBodyByName("cube", self._plant.GetModelInstanceByName(name))
            for name in (CUBE, *names)
        )
        self._shown: tuple[int, ...] | None = None  # as ghosts
        self.ghosts(())
        self.pose(Posture(HOME, gripper.MAX_OPENING, None))
        for name, opacity in zip(names, _GHOSTS, strict=True):
            meshcat.SetProperty(f"/drake/visualizer/{name}", "modulated_opacity", opacity)

    def show(self, state: int) -> None:
        """Show a state: the arm at home if the cube is free, else where it holds it.

        Raises:
            ModelError: if there is no such state, or the arm cannot reach it.
        """
        self.ghosts(())
        self.pose(self.posture(state))

    def posture(self, state: int) -> Posture:
        """Where everything is in a state.

        Raises:
            ModelError: as `show`.
        """
        if state == LOST:
            return Posture(HOME, gripper.MAX_OPENING, None)
        parts, X_WO = State.from_index(state), cube_pose(state)
        if parts.gripper is None:
            return Posture(HOME, gripper.MAX_OPENING, X_WO)
        q = self._planner.posture(parts.position, parts.gripper)
        if q is None:
            raise ModelError(
                f"state {state}: cell {parts.position} is out of reach of gripper {parts.gripper}"
            )
        # As wide as the cube is between the fingers, however it is turned there.
        closing = X_WO.rotation().matrix().T @ R_WG[parts.gripper][:, 1]
        width = min(CUBE_EDGE * float(np.abs(closing).sum()), gripper.MAX_OPENING)
        return Posture(q, width, X_WO)

    def preview(self, state: int, action: int) -> Preview:
        """Plan an action's motion, as the robot would carry it out.

        Raises:
            Infeasible: if it cannot be; the message says why.
            ModelError: if there is no such state or action, or the arm cannot reach the state.
        """
        if state == LOST:
            raise Infeasible(ActionFailure.UNFIT, "the cube is lost")
        parts, asked = State.from_index(state), Action.from_index(action)
        start = self.posture(state)
        assert start.X_WO is not None
        plan = self._planner.plan(
            asked, parts.position, parts.gripper, start.q, start.width, start.X_WO
        )
        outcomes = tuple(self._outcomes(state, action))
        # Where a lost cube lies no state says: it is shown where else it may come to lie.
        places = [cube_pose(after) for after, _ in outcomes if after != LOST]
        end = places[0] if places else None
        postures = tuple(self._follow(start, plan, asked.kind, end))
        return Preview(state, action, outcomes, postures)

    def pose(self, posture: Posture) -> None:
        """Put everything where it is to be, and show it.

        Raises:
            ModelError: if a part of it is not finite, or of another size.
        """
        q = finite_vector(posture.q, len(HOME), "q")
        width = finite_number(posture.width, "width", valid="metres")
        X_WO = _AWAY if posture.X_WO is None else finite_pose(posture.X_WO, "X_WO")
        self._plant.SetPositions(self._context, self._arm, q)
        angles = gripper.joint_positions(float(gripper.knuckle_angle(width)))
        for name, angle in zip(gripper.JOINTS, angles, strict=True):
            self._plant.GetJointByName(name, self._hand).set_angle(self._context, angle)
        self._plant.SetFreeBodyPose(self._context, self._cube, X_WO)
        self._diagram.ForcedPublish(self._root)

    def ghosts(self, states: Sequence[int]) -> None:
        """Show see-through cubes where one may come to be, the likeliest first.

        Only as many as `_GHOSTS` has; *lost* has none.
        """
        some = tuple(states)[: len(self._ghosts)]
        if some == self._shown:
            return
        self._shown = some
        poses = [cube_pose(s) if s != LOST else _AWAY for s in some]
        poses += [_AWAY] * (len(self._ghosts) - len(poses))
        for body, X_WO in zip(self._ghosts, poses, strict=True):
            self._plant.SetFreeBodyPose(self._context, body, X_WO)
        self._diagram.ForcedPublish(self._root)

    def _follow(
        self, start: Posture, plan: Sequence[Move | Grip], kind: Kind, end: RigidTransform | None
    ) -> Iterator[Posture]:
        """Everything at each picture of a plan.

        A grasped cube turns flush with the fingers while they close, a dropped one falls to where
        it comes to rest; between them it is rigid in the hand.

        Args:
            start: where everything is before it.
            plan: what is done.
            kind: of the action.
            end: the cube's pose after it, None if it is lost.
        """
        timeline = Timeline(start.q, start.width, plan, self._planner.velocity_limit)
        lies = _AWAY if start.X_WO is None else start.X_WO
        joins, X_GO = 0.0, self._forward(start.q).inverse() @ lies
        flush, width = X_GO, start.width
        if kind == Kind.GRASP:
            joins = timeline.starts(list(plan).index(CLOSE))
            X_GO = self._forward(timeline.arm(joins)).inverse() @ lies
            over = self._forward(timeline.arm(timeline.duration))
            flush = X_GO if end is None else over.inverse() @ end
        step = SPEED * FRAME
        for picture in range(1 + int(np.ceil(timeline.duration / step))):
            t = min(picture * step, timeline.duration)
            q, wanted = timeline.arm(t), max(timeline.width(t), CUBE_EDGE)
            width += float(np.clip(wanted - width, -_FINGERS * step, _FINGERS * step))
            if kind == Kind.DROP:
                X_WO = _between(lies, end or _AWAY, max(0.0, t / _FALL - 1.0) ** 2)
            elif t < joins:
                X_WO = lies
            else:
                X_WO = self._forward(q) @ _between(X_GO, flush, (t - joins) / _FLUSH)
            yield Posture(q, width, X_WO)

    def _forward(self, q: np.ndarray) -> RigidTransform:
        self._plant.SetPositions(self._context, self._arm, q)
        return self._tcp.CalcPoseInWorld(self._context)


def cube_pose(state: int) -> RigidTransform:
    """X_WO of the cube as a state's name has it: in its cell, or on the table.

    Raises:
        ModelError: if there is no such state, or the cube is lost.
    """
    parts = State.from_index(state)
    p = POSITIONS[parts.position].copy()
    if parts.gripper is None:
        p[2] = REST_HEIGHT
    elif parts.gripper not in VERTICAL:
        p += RETREAT * R_WG[parts.gripper][:, 2]
    return RigidTransform(RotationMatrix(R_WO[parts.orientation]), p)


def _between(X_A: RigidTransform, X_B: RigidTransform, share: float) -> RigidTransform:
    """A pose on the way from one to another; ``share`` is clipped to 0…1."""
    share = float(np.clip(share, 0.0, 1.0))
    turn = X_A.rotation().ToQuaternion().slerp(share, X_B.rotation().ToQuaternion())
    p = (1.0 - share) * X_A.translation() + share * X_B.translation()
    return RigidTransform(RotationMatrix(turn), p)
