"""Cubes that are let go over the table: how many tumble onto another face, beside MuJoCo.

The same cubes, no hand about them: level but for a tilt of a degree or two, at the height of
either layer of cells, friction and restitution as trials draw them. Contact is hydroelastic here,
with Hunt and Crossley's dissipation, whose restitution rises as blows get slower; in MuJoCo, at
points, it does not depend on the speed.
"""

import time
from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.math import SpatialVelocity

from diagrams.falls.scene import AT_REST, Fall, FallScene, Hand, travel
from diagrams.trials.record import TrialConfig
from experiments.bench.comparison import Peers, Row
from irl.metrics import wilson_interval
from models.rotations import rotation_vector_to_matrix, rotation_z
from models.task.spaces import CUBE_EDGE, GRID_Z, TABLE_TOP

CUBES = 48
"""Of each height."""
TILT = np.radians(1.5)
"""Of a cube that fingers let go, about x and y: a standard deviation [rad]."""
MASS = 0.1  # [kg]
STEP = 1e-4  # of MuJoCo [s]; a blow lasts ten
MOST, LOOK = 3.0, 0.1  # longest time to wait for rest, and between two looks [s]
_AWAY = Hand(RigidTransform([0.0, 0.0, 5.0]), 0.0)


@dataclass(frozen=True)
class Cubes:
    """Cubes at rest in the air.

    Attributes:
        p_WO: centres ``[n, 3]`` [m].
        R_WO: orientations ``[n, 3, 3]``.
        friction: coefficient, of everything ``[n]``.
        restitution: of cube and table ``[n]``.
    """

    p_WO: np.ndarray
    R_WO: np.ndarray
    friction: np.ndarray
    restitution: np.ndarray


def rows(peers: Peers, seed: int) -> list[Row]:
    """Let the same cubes fall from either layer, here and in MuJoCo."""
    scene = FallScene(edge=False)
    drawn = (
        draw(height, np.random.default_rng([seed, layer])) for layer, height in enumerate(GRID_Z)
    )
    return [_row(peers, scene, cubes) for cubes in drawn]


def draw(height: float, rng: np.random.Generator) -> Cubes:
    """Cubes of a height [m]."""
    config = TrialConfig()
    tilts = rng.normal(0.0, TILT, (CUBES, 2))
    yaws = rng.uniform(0.0, 2.0 * np.pi, CUBES)
    return Cubes(
        p_WO=np.tile([0.0, 0.0, height], (CUBES, 1)),
        R_WO=np.array(
            [
                rotation_vector_to_matrix([*tilt, 0.0]) @ rotation_z(yaw)
                for tilt, yaw in zip(tilts, yaws, strict=True)
            ]
        ),
        friction=rng.uniform(*config.friction, CUBES),
        restitution=rng.uniform(*config.restitution, CUBES),
    )


def tumbled(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Whether cubes lie on another face ``[n]`` than was down ``[n, 3, 3]``."""
    down, now = (-R[:, 2] for R in (before, after))
    nearest = np.abs(down).argmax(axis=1)
    rows = np.arange(len(down))
    return np.sign(down[rows, nearest]) * now[rows, nearest] < np.cos(np.pi / 4.0)


def in_drake(scene: FallScene, cubes: Cubes) -> tuple[np.ndarray, float]:
    """How cubes lie in the end ``[n, 3, 3]``, and the processor time of one [s]."""
    began, ends = time.process_time(), []
    for p, R, friction, restitution in zip(*vars(cubes).values(), strict=True):
        X_WO = RigidTransform(RotationMatrix(R), p)
        material = {"friction": friction, "mass": MASS, "restitution": restitution}
        fall = Fall(scene, X_WO, SpatialVelocity.Zero(), **material)
        moved, waited = np.inf, 0.0
        while moved > AT_REST and waited < MOST:
            before = fall.X_WO
            fall.advance(LOOK, _AWAY, _AWAY)
            moved, waited = travel(before, fall.X_WO), waited + LOOK
        ends.append(fall.X_WO.rotation().matrix())
    return np.array(ends), (time.process_time() - began) / len(ends)


def _row(peers: Peers, scene: FallScene, cubes: Cubes) -> Row:
    ours, ours_s = in_drake(scene, cubes)
    theirs = peers.run(
        "mujoco_landing.py",
        **vars(cubes),
        edge=np.array(CUBE_EDGE),
        mass=np.array(MASS),
        top=np.array(TABLE_TOP),
        time_step=np.array(STEP),
    )
    fell = 1e3 * (cubes.p_WO[0, 2] - CUBE_EDGE / 2.0 - TABLE_TOP)
    counts = {
        name: int(tumbled(cubes.R_WO, ends).sum())
        for name, ends in (("ours", ours), ("mujoco", theirs["R_WO"]))
    }
    return Row(
        f"a fall of {fell:.0f} mm until the cube rests, mean of {CUBES}",
        ours_s,
        "MuJoCo",
        float(theirs["cpu_s"].mean()),
        details={
            "cubes": CUBES,
            "tumbled": counts,
            "interval": {name: list(wilson_interval(n, CUBES)) for name, n in counts.items()},
        },
    )
