"""Falls in MuJoCo: a cube that nothing holds falls on a table without an edge, and comes to rest.

Contacts are springs with dampers, as stiff as to last a millisecond, so that the coefficient of
restitution does not depend on the speed of a blow.

Reads ``edge``, ``mass``, ``top`` (the table's height) and ``time_step``, and of the cubes
``p_WO [n, 3]``, ``R_WO [n, 3, 3]``, ``friction [n]``, ``restitution [n]``; SI units. Writes
``p_WO``, ``R_WO`` in the end and ``cpu_s [n]``, the process' own time.
"""

import sys
import time

import mujoco
import numpy as np

FREQUENCY = 3000.0
"""Of the spring [rad/s]."""
MOST, LOOK, STILL = 3.0, 0.1, 1e-3
"""Longest time [s]; between two looks at whether the cube rests [s]; it does if slower [m/s]."""
SCENE = """
<mujoco>
  <option timestep="{step}" integrator="implicitfast" cone="elliptic" impratio="10"/>
  <default>
    <geom friction="{friction} 0 0" condim="3" solref="-{stiffness} -{damping}"
          solimp="0.9999 0.9999 0.001"/>
  </default>
  <worldbody>
    <geom type="plane" size="1 1 0.1" pos="0 0 {top}"/>
    <body><freejoint/><geom type="box" size="{half} {half} {half}" mass="{mass}"/></body>
  </worldbody>
</mujoco>
"""


def rebound(ratio: float) -> float:
    """Restitution of a contact that pushes only, of a damping ratio."""
    s = np.sqrt(1.0 - ratio * ratio)
    return float(np.exp(-ratio / s * np.arctan2(2.0 * ratio * s, 2.0 * ratio * ratio - 1.0)))


def damping_ratio(restitution: float) -> float:
    """The damping ratio that gives a restitution, by bisection."""
    low, high = 1e-6, 1.0 - 1e-6
    for _ in range(60):
        middle = (low + high) / 2.0
        low, high = (middle, high) if rebound(middle) > restitution else (low, middle)
    return low


def fall(
    p_WO: np.ndarray, R_WO: np.ndarray, friction: float, restitution: float
) -> tuple[np.ndarray, np.ndarray]:
    """Where a cube comes to rest, and how it lies."""
    model = mujoco.MjModel.from_xml_string(
        SCENE.format(
            step=step,
            friction=friction,
            stiffness=FREQUENCY**2,
            damping=2.0 * damping_ratio(restitution) * FREQUENCY,
            top=float(given["top"]),
            half=float(given["edge"]) / 2.0,
            mass=float(given["mass"]),
        )
    )
    data = mujoco.MjData(model)
    data.qpos[:3] = p_WO
    mujoco.mju_mat2Quat(data.qpos[3:], np.ascontiguousarray(R_WO).ravel())
    while data.time < MOST:
        mujoco.mj_step(model, data, nstep=round(LOOK / step))
        spin = np.linalg.norm(data.qvel[3:]) * float(given["edge"])
        if data.time > 4.0 * LOOK and np.linalg.norm(data.qvel[:3]) + spin < STILL:
            break
    return data.qpos[:3].copy(), data.xmat[1].reshape(3, 3).copy()


with np.load(sys.argv[1], allow_pickle=False) as file:
    given = dict(file)
step = float(given["time_step"])
ends, cpu_s = [], []
for each in zip(*(given[n] for n in ("p_WO", "R_WO", "friction", "restitution")), strict=True):
    began = time.process_time()
    ends.append(fall(each[0], each[1], float(each[2]), float(each[3])))
    cpu_s.append(time.process_time() - began)
p_WO, R_WO = (np.array(values) for values in zip(*ends, strict=True))
np.savez(sys.argv[2], p_WO=p_WO, R_WO=R_WO, cpu_s=cpu_s)
