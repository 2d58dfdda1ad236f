"""A scenario's sizes for one episode, drawn from the episode's own seed."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import cache

import numpy as np
from pydrake.common.schema import Uniform
from pydrake.math import RigidTransform, RotationMatrix

from diagrams.scenarios.schema import Scenario, Size
from models.errors import ModelError
from models.rotations import rotation_vector_to_matrix
from models.scenes.planning_scene import HOME, PlanningScene
from models.task.discretise import X_LIMITS, Y_LIMITS
from models.task.spaces import REST_HEIGHT

HEADINGS = 32
"""Directions drawn for what an unseen hand does: the first that ends in reach is taken."""
BESIDE = 0.02
"""How far beside the grid a cube may come to lie [m]; it can still be grasped there."""
REACH = np.array([X_LIMITS, Y_LIMITS]).T + np.array([[-BESIDE], [BESIDE]])
"""Least and largest x and y of the centre of a cube that is in reach ``[2, 2]`` [m]."""
APART = 0.08
"""From a distractor's centre to the goal's, so that the goal can be reached [m]."""
CLEAR = 0.02
"""Of a drawn posture from everything, the cube included [m]."""
_TRIES = 10_000
_SPAN = 1.2
"""How far a drawn posture's joints are from the usual one's, at most [rad]."""


class Kind(StrEnum):
    """What an unseen hand does with the cube."""

    PUSH = "push"
    SLIP = "slip"
    YANK = "yank"


@dataclass(frozen=True)
class Lead:
    """One thing that an unseen hand does with the cube.

    Attributes:
        kind: what it is.
        distance: how far the cube is led [m].
        turn: how far it is turned [rad].
        wait: from its occasion until it begins [s].
        seconds: how long it takes [s].
        grip: share of the grip's force that is left meanwhile.
        headings: directions to choose among ``[n]`` [rad].
    """

    kind: Kind
    distance: float
    turn: float
    wait: float
    seconds: float
    grip: float
    headings: tuple[float, ...]


@dataclass(frozen=True)
class Draws:
    """What is otherwise than usual in one episode.

    Attributes:
        key: whole numbers that everything is drawn from.
        leads: what an unseen hand does, in this order.
        friction: coefficient, None for the usual.
        mass: of the cube [kg], None for the usual.
        X_BB: where the robot's base truly is, from where its model says; None if there.
        distractor: distance of the second cube [m], None without.
        posture: whether the arm starts in another posture.
    """

    key: tuple[int, ...]
    leads: tuple[Lead, ...] = ()
    friction: float | None = None
    mass: float | None = None
    X_BB: RigidTransform | None = None
    distractor: float | None = None
    posture: bool = False

    def start_posture(self, X_WO: RigidTransform) -> np.ndarray:
        """Joint angles ``[7]`` [rad] that the arm starts at, free of collisions with the cube.

        Raises:
            ModelError: if none is found.
        """
        if not self.posture:
            return HOME
        scene = _scene()
        scene.place_cube(X_WO)
        rng = _rng(self.key, "posture")
        lower, upper = np.maximum(scene.lower, HOME - _SPAN), np.minimum(scene.upper, HOME + _SPAN)
        for _ in range(_TRIES):
            q = rng.uniform(lower, upper)
            if scene.is_free(q, CLEAR):
                return q
        raise ModelError(f"posture: none of {_TRIES} drawn is free")

    def second_cube(self, p_WO: np.ndarray, goals: Sequence[np.ndarray]) -> RigidTransform:
        """Pose of the distractor on the table.

        Args:
            p_WO: the first cube's centre ``[3]`` [m].
            goals: where cubes are to be brought, `APART` from it ``[3]`` [m] each.

        Raises:
            ModelError: if there is no place for it.
        """
        assert self.distractor is not None
        rng = _rng(self.key, "distractor")
        yaw = rng.uniform(-np.pi, np.pi)
        for _ in range(_TRIES):
            heading = rng.uniform(-np.pi, np.pi)
            p = p_WO[:2] + self.distractor * np.array([np.cos(heading), np.sin(heading)])
            away = [np.linalg.norm(p - goal[:2]) >= APART for goal in goals]
            if within_reach(p) and all(away):
                R = RotationMatrix.MakeZRotation(yaw)
                return RigidTransform(R, np.array([*p, REST_HEIGHT]))
        raise ModelError(f"distractor: no place {self.distractor:g} m from {p_WO.tolist()}")

    def noise_rng(self, number: int) -> np.random.Generator:
        """Generator of the measurement of a number."""
        return np.random.default_rng([*self.key, 1 + _STREAMS.index("noise"), number])


_STREAMS = ("push", "slip", "yank", "friction", "mass", "noise", "posture", "base", "distractor")
"""Each draws by itself: what one draws does not depend on which others there are."""


def _rng(key: tuple[int, ...], stream: str) -> np.random.Generator:
    return np.random.default_rng([*key, 1 + _STREAMS.index(stream)])


@cache
def _scene() -> PlanningScene:
    return PlanningScene()


def within_reach(p_WO: np.ndarray) -> bool:
    """Whether a cube that lies at x and y ``[2]`` [m] can be grasped."""
    return bool((REACH[0] <= p_WO[:2]).all() and (p_WO[:2] <= REACH[1]).all())


def draw(scenario: Scenario, key: tuple[int, ...]) -> Draws:
    """Draw a scenario's sizes for one episode.

    Args:
        scenario: what goes otherwise.
        key: three whole numbers from 0 on that no other episode has: a seed, the episode's
            number, and which repetition it is.
    """
    base = scenario.base
    X_BB = None
    if base is not None:
        rng = _rng(key, "base")
        heading, axis = rng.uniform(-np.pi, np.pi), rng.normal(size=3)
        turn = np.radians(_size(base.turn, rng)) * axis / np.linalg.norm(axis)
        offset = _size(base.offset, rng) * np.array([np.cos(heading), np.sin(heading), 0.0])
        X_BB = RigidTransform(RotationMatrix(rotation_vector_to_matrix(turn)), offset)
    distractor = scenario.distractor
    return Draws(
        key,
        tuple(_leads(scenario, key)),
        _drawn(scenario.friction, key, "friction"),
        _drawn(scenario.mass, key, "mass"),
        X_BB,
        _drawn(distractor.distance if distractor else None, key, "distractor"),
        scenario.posture,
    )


def _leads(scenario: Scenario, key: tuple[int, ...]) -> list[Lead]:
    leads = []
    for kind in Kind:
        part = getattr(scenario, kind.value)
        if part is not None:
            rng = _rng(key, kind.value)
            turn = np.radians(_size(getattr(part, "turn", 0.0), rng)) * rng.choice([-1.0, 1.0])
            leads.append(
                Lead(
                    kind,
                    _size(part.distance, rng),
                    float(turn),
                    _size(part.wait, rng),
                    part.seconds,
                    getattr(part, "grip", 1.0),
                    tuple(rng.uniform(-np.pi, np.pi, HEADINGS).tolist()),
                )
            )
    return leads


def _drawn(size: Size | None, key: tuple[int, ...], stream: str) -> float | None:
    return None if size is None else _size(size, _rng(key, stream))


def _size(size: Size, rng: np.random.Generator) -> float:
    """A number as it is, or drawn from its range."""
    return float(rng.uniform(size.min, size.max)) if isinstance(size, Uniform) else float(size)
