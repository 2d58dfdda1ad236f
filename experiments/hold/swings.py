"""How the arm can swing its hand, and what that feels like in the hand.

A swing goes out and back: joints accelerate as one whole sine wave, then as its negative, so that
it begins and ends at rest in the same posture, and no acceleration jumps. Its joints all reach the
same share of their acceleration limits at the same moments; how long it takes is what the slowest
joint's speed limit asks for at the whole share. Arm and hand are rigid here.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import JacobianWrtVariable
from pydrake.systems.framework import Context

from diagrams.arm_controller import ACCELERATION_LIMIT, JOINTS
from models.arrays import Array
from models.scenes.parsing import ARM, add_models

AXES = {"across": 0, "closing": 1, "approach": 2}
"""Of the hand, in frame G: along the pads, along their normal, and from the palm outwards."""
SAMPLE = 1e-3
"""Between two samples of a swing [s]."""
_HELPS = 0.05  # a joint takes part if it moves the hand so far along the axis [m/rad]
_STEEP = np.pi / 2


@dataclass(frozen=True)
class Swing:
    """A swing of the arm, stretched out level but for what the hand's axis asks of the wrist.

    Attributes:
        name: of the swing.
        axis: of the hand that it accelerates along, of `AXES`.
        posture: that it begins and ends in ``[7]`` [rad].
        joints: that take part.
    """

    name: str
    axis: str
    posture: tuple[float, ...]
    joints: tuple[int, ...]

    @property
    def key(self) -> str:
        """Name and axis."""
        return f"{self.name}-{self.axis}"

    @property
    def acceleration(self) -> Array:
        """Of the joints at the whole share ``[7]`` [rad/s²]; those that don't help rest."""
        plant, context = _arm()
        plant.SetPositions(context, plant.GetModelInstanceByName(ARM), self.posture)
        tcp, world = plant.GetFrameByName("tcp"), plant.world_frame()
        wrt = JacobianWrtVariable.kV
        J = plant.CalcJacobianTranslationalVelocity(context, wrt, tcp, np.zeros(3), world, world)
        axis = tcp.CalcPoseInWorld(context).rotation().matrix()[:, AXES[self.axis]]
        along = axis @ J[:, _columns(plant)]
        helps = np.isin(np.arange(len(JOINTS)), self.joints) & (np.abs(along) > _HELPS)
        return np.where(helps, np.sign(along) * ACCELERATION_LIMIT, 0.0)

    @property
    def half(self) -> float:
        """How long it takes out, or back [s]."""
        plant, _ = _arm()
        joints = [plant.GetJointByName(name) for name in JOINTS]
        speed = np.array([joint.velocity_upper_limits()[0] for joint in joints])
        moves = self.acceleration != 0.0
        # The sine's integral: the speed is at most acceleration · half / π.
        return float(np.pi * (speed / ACCELERATION_LIMIT)[moves].min())


@dataclass(frozen=True)
class Motion:
    """A swing at a share of the limits, sampled.

    Attributes:
        time: ``[n]`` [s].
        q: posture ``[n, 7]`` [rad].
        v: joint speeds ``[n, 7]`` [rad/s].
        R_WG: the hand's orientation at the start ``[3, 3]``.
        a_G: acceleration of the tool centre point, in the hand's axes ``[n, 3]`` [m/s²].
        felt_G: gravity less acceleration, in the hand's axes ``[n, 3]`` [m/s²].
    """

    time: Array
    q: Array
    v: Array
    R_WG: Array
    a_G: Array
    felt_G: Array

    @property
    def largest(self) -> float:
        """Largest acceleration of the tool centre point [m/s²]."""
        return float(np.linalg.norm(self.a_G, axis=1).max())


def swings() -> dict[str, Swing]:
    """The swings there are, by key: three of the arm, each along the three axes of the hand.

    ``sweep``: joint 1 alone, up to its speed limit, where the hand is pulled outwards too.
    ``sideways``: joints 1, 4 and 6 at once. ``up-down``: joints 2, 4 and 6.
    """
    level = _STEEP
    postures = {
        # Joint 3 lays the elbow's axis upright or level; joints 5 to 7 turn the hand.
        ("sweep", "across"): (0, level, 0, 0, 0, 0, 0),
        ("sweep", "closing"): (0, level, 0, 0, 0, 0, _STEEP),
        ("sweep", "approach"): (0, level, 0, 0, _STEEP, _STEEP, 0),
        ("sideways", "across"): (0, level, _STEEP, 0, 0, 0, -_STEEP),
        ("sideways", "closing"): (0, level, _STEEP, 0, 0, 0, 0),
        ("sideways", "approach"): (0, level, _STEEP, 0, 0, _STEEP, 0),
        ("up-down", "across"): (0, level, 0, 0, 0, 0, _STEEP),
        ("up-down", "closing"): (0, level, 0, 0, 0, 0, 0),
        ("up-down", "approach"): (0, level, 0, 0, 0, _STEEP, 0),
    }
    joints = {"sweep": (0,), "sideways": (0, 3, 5), "up-down": (1, 3, 5)}
    found = [
        Swing(name, axis, tuple(map(float, posture)), joints[name])
        for (name, axis), posture in postures.items()
    ]
    return {swing.key: swing for swing in found}


def motion(swing: Swing, share: float) -> Motion:
    """A swing at a share of the joints' acceleration limits.

    Args:
        swing: of `swings`.
        share: in (0, 1].
    """
    half, peak = swing.half, share * swing.acceleration
    n = int(np.ceil(half / SAMPLE))
    out = np.linspace(0.0, half, n + 1)
    rate = 2.0 * np.pi / half
    wave = np.sin(rate * out)
    speed = (1.0 - np.cos(rate * out)) / rate
    way = out / rate - wave / rate**2
    there_and_back = [
        np.concatenate([first, second[1:]])
        for first, second in ((wave, -wave), (speed, -speed), (way, way[-1] - way))
    ]
    a, v, q = (profile[:, None] * peak for profile in there_and_back)
    q = np.array(swing.posture) + q
    plant, context = _arm()
    arm, tcp = plant.GetModelInstanceByName(ARM), plant.GetFrameByName("tcp")
    world = plant.world_frame()
    columns, wrt = _columns(plant), JacobianWrtVariable.kV
    accelerations, orientations = [], []
    for position, rates, change in zip(q, v, a, strict=True):
        plant.SetPositions(context, arm, position)
        plant.SetVelocities(context, arm, rates)
        given = context, wrt, tcp, np.zeros(3), world, world
        J = plant.CalcJacobianTranslationalVelocity(*given)[:, columns]
        accelerations.append(J @ change + plant.CalcBiasTranslationalAcceleration(*given)[:, 0])
        orientations.append(tcp.CalcPoseInWorld(context).rotation().matrix())
    R_WG, a_W = np.array(orientations), np.array(accelerations)
    gravity = plant.gravity_field().gravity_vector()
    return Motion(
        np.concatenate([out, half + out[1:]]),
        q,
        v,
        R_WG[0],
        *(np.einsum("nij,ni->nj", R_WG, each) for each in (a_W, gravity - a_W)),
    )


@cache
def _arm() -> tuple[MultibodyPlant, Context]:
    plant = MultibodyPlant(0.0)
    add_models(plant, "gen3_2f85.dmd.yaml")
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("base_link"))
    plant.Finalize()
    return plant, plant.CreateDefaultContext()


def _columns(plant: MultibodyPlant) -> list[int]:
    """Where the arm's joints are among the plant's velocities."""
    return [plant.GetJointByName(name).velocity_start() for name in JOINTS]
