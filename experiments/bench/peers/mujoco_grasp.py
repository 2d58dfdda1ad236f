"""Grasp trials in MuJoCo: a gripper on a gantry closes on a cube on a table, and lifts.

The gripper is either two bare pads on slides, or a linkage from a URDF whose mimic joints become
equality constraints. Position servos of limited effort close both sides alike. Contact has
elliptic cones and torsional friction.

Reads what all trials share (``edge``, ``mass``, ``table_size [3]``, ``table_centre [3]``,
``gantry_speed``, ``time_step``, ``close_s``, ``lift``, ``lift_s``), the gripper (``urdf``, a file
name, empty for pads; ``tcp``, of the tool centre point before its base; ``pad [3]``; of its two
driven joints ``closing [2]``, from open to closed, ``speed``, ``effort`` and ``gains [2]``) and
the trials (``p_WG [n, 3]``, ``R_WG [n, 3, 3]``, ``p_WO``, ``R_WO``, ``friction [n]``); SI units.
Writes how each ended (``p_WO``, ``R_WO``; ``joint [n]`` and ``effort [n]`` of the driven joints)
and ``cpu_s [n]``, the process' own time.
"""

import sys
import time

import mujoco
import numpy as np

SCENE = """
<mujoco>
  <compiler angle="radian"/>
  <option timestep="{time_step}" integrator="implicitfast" cone="elliptic" impratio="20"/>
  <default><position kp="2e4" kv="600"/></default>
  <worldbody>
    <geom type="box" pos="{table_centre}" size="{table_size}"/>
    <body name="cube" pos="{p_WO}" quat="{q_WO}">
      <freejoint/>
      <geom type="box" mass="{mass}" size="{cube_size}"/>
    </body>
    <body pos="{p_WG}" gravcomp="1">
      <inertial pos="0 0 0" mass="5" diaginertia="0.02 0.02 0.02"/>
      <joint name="x" type="slide" axis="1 0 0"/>
      <joint name="y" type="slide" axis="0 1 0"/>
      <joint name="z" type="slide" axis="0 0 1"/>
      <body name="hand" quat="{q_WG}"/>
    </body>
  </worldbody>
  <actuator><position joint="x"/><position joint="y"/><position name="z" joint="z"/></actuator>
</mujoco>
"""
PADS = """
<mujoco>
  <worldbody>
    <body name="base">
      <inertial pos="0 0 0" mass="0.5" diaginertia="0.001 0.001 0.001"/>
      <body name="left" pos="0 -{pad_y} {tcp}">
        <joint name="left_knuckle" type="slide" axis="0 1 0" range="0 {travel}" limited="true"/>
        <geom type="box" mass="0.1" size="{pad_size}"/>
      </body>
      <body name="right" pos="0 {pad_y} {tcp}">
        <joint name="right_knuckle" type="slide" axis="0 -1 0" range="0 {travel}" limited="true"/>
        <geom type="box" mass="0.1" size="{pad_size}"/>
      </body>
    </body>
  </worldbody>
  <equality><joint joint1="right_knuckle" joint2="left_knuckle" polycoef="0 1 0 0 0"/></equality>
</mujoco>
"""
SIDES = ("gripper_left_knuckle", "gripper_right_knuckle")

with np.load(sys.argv[1], allow_pickle=False) as given:
    shared = dict(given)
trials = {name: shared.pop(name) for name in ("p_WG", "R_WG", "p_WO", "R_WO", "friction")}
step, (opened, closed) = float(shared["time_step"]), map(float, shared["closing"])
close_step, lift_step = (step * float(shared[name]) for name in ("speed", "gantry_speed"))


def quaternion(R: np.ndarray) -> np.ndarray:
    """Of a rotation matrix ``[3, 3]``: w, x, y, z."""
    q = np.empty(4)
    mujoco.mju_mat2Quat(q, np.ascontiguousarray(R).ravel())
    return q


def filled(template: str, **values: np.ndarray | float) -> mujoco.MjSpec:
    """A model from a template."""
    texts = {
        name: " ".join(f"{v:.17g}" for v in np.atleast_1d(value)) for name, value in values.items()
    }
    return mujoco.MjSpec.from_string(template.format(**texts))


def gripper() -> mujoco.MjSpec:
    """The gripper, its base's frame as it is on the flange."""
    if urdf := str(shared["urdf"]):
        return mujoco.MjSpec.from_file(urdf)
    pad, travel = shared["pad"], closed - opened
    pad_y = travel + pad[1] / 2
    return filled(PADS, tcp=shared["tcp"], travel=travel, pad_size=pad / 2, pad_y=pad_y)


def scene(trial: dict[str, np.ndarray]) -> mujoco.MjModel:
    """Compile the scene of one trial."""
    spec = filled(
        SCENE,
        time_step=step,
        mass=shared["mass"],
        cube_size=np.full(3, shared["edge"] / 2),
        table_size=shared["table_size"] / 2,
        table_centre=shared["table_centre"],
        p_WO=trial["p_WO"],
        q_WO=quaternion(trial["R_WO"]),
        p_WG=trial["p_WG"],
        q_WG=quaternion(trial["R_WG"]),
    )
    for geom in spec.geoms:
        geom.conaffinity = 3
    hand = gripper()
    for joint in hand.joints:
        # What keeps the fingers parallel yields the less, the more inertia it holds.
        joint.armature = 0.005
    for equality in hand.equalities:
        equality.solref, equality.solimp = [2 * step, 1], [0.99, 0.999, 0.001, 0.5, 2]
    for geom in hand.geoms:
        # Its parts meet table and cube, not each other.
        geom.contype, geom.conaffinity = 2, 0
    flange = spec.body("hand").add_frame(pos=[0, 0, -float(shared["tcp"])])
    spec.attach(hand, prefix="gripper_", frame=flange)
    for body in spec.body("hand").find_all("body"):
        body.gravcomp = 1
    for geom in spec.geoms:
        geom.condim, geom.friction = 4, [float(trial["friction"]), 0.005, 0.0001]
        geom.solref = [0.006, 1]
    for side in SIDES:
        actuator = spec.add_actuator(
            name=side, target=side, trntype=mujoco.mjtTrn.mjTRN_JOINT, forcelimited=True
        )
        actuator.set_to_position(*shared["gains"])
        actuator.forcerange = [-shared["effort"], shared["effort"]]
    return spec.compile()


def run(trial: dict[str, np.ndarray]) -> dict[str, np.ndarray | float]:
    """Close, lift, wait; where the cube ended.

    Raises:
        RuntimeError: if the simulation became unstable.
    """
    began = time.process_time()
    model = scene(trial)
    data = mujoco.MjData(model)
    for k in range(model.neq):
        # Every joint of the gripper follows the left knuckle.
        joint, rate = model.eq_obj1id[k], model.eq_data[k, 1]
        data.qpos[model.jnt_qposadr[joint]] = rate * opened
    data.joint(SIDES[0]).qpos = opened
    sides = [model.actuator(side).id for side in SIDES]
    z = model.actuator("z").id
    data.ctrl[sides] = opened

    def advance(seconds: float, lift: float) -> None:
        for _ in range(round(seconds / step)):
            data.ctrl[z] = min(data.ctrl[z] + lift_step, lift)
            data.ctrl[sides] = min(data.ctrl[sides[0]] + close_step, closed)
            mujoco.mj_step(model, data)

    advance(float(shared["close_s"]), 0.0)
    advance(float(shared["lift_s"]), float(shared["lift"]))
    mujoco.mj_forward(model, data)
    for warning in data.warning:
        if warning.number:
            raise RuntimeError(f"unstable, MuJoCo warning {warning}")
    cube = data.body("cube")
    return {
        "p_WO": cube.xpos.copy(),
        "R_WO": cube.xmat.reshape(3, 3).copy(),
        "joint": float(np.mean([data.joint(side).qpos for side in SIDES])),
        "effort": float(data.actuator_force[sides].mean()),
        "cpu_s": time.process_time() - began,
    }


ended = [
    run(dict(zip(trials, values, strict=True))) for values in zip(*trials.values(), strict=True)
]
written = {name: np.array([end[name] for end in ended]) for name in ended[0]}
np.savez(sys.argv[2], **written)  # type: ignore[arg-type]
