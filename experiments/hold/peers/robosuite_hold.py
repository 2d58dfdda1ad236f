"""Cubes held in MuJoCo by robosuite's 2F-85 while gravity changes as in a hand that is swung.

The hand stands still; at every step gravity is what a swinging hand feels, in its own axes. Hand,
contacts and solver are robosuite's own; the gain of its servos is what lets the pads press with a
given force, found by trial: with robosuite's 20 N m/rad it is some 18 N. robosuite is not imported;
its description is read, as robosuite reads it.

Reads what all cases share (``edge``, ``time_step``, ``settle_s``, ``after_s``, ``look_s``,
``gone``) and the cases: ``time [k]`` and ``felt [k, 3]``, all swings' samples of gravity one after
the other; ``first [n]`` and ``count [n]``, where a case's swing lies among them; ``mass [n]``,
``friction [n]`` and ``force [n]``; SI units. Writes for each what was seen at every look since the
swing began: ``pose [l, 7]`` of the cube (position from where it was gripped, quaternion), ``speed
[l]`` of a knuckle and ``pad_force [l]``, all cases one after the other, ``looks [n]`` of each, and
``cpu_s [n]``.
"""

import importlib.util
import os
import sys
import time
from functools import cache
from pathlib import Path
from xml.etree import ElementTree

import mujoco
import numpy as np

SCENE = """
<mujoco>
  <compiler angle="radian" inertiagrouprange="0 0" autolimits="true"/>
  <option timestep="{step}" impratio="20" cone="elliptic"/>
  <worldbody>
    <body name="cube"><freejoint/><geom name="cube" type="box" size="{h} {h} {h}" mass="1"/></body>
    <body name="hand"/>
  </worldbody>
</mujoco>
"""
PADS = ("left_fingerpad_collision", "right_fingerpad_collision")
OPEN = [-0.026, -0.267, -0.200, -0.026, -0.267, -0.200]  # as robosuite begins [rad]
SHUT, CLOSING = 0.8, 1.0  # the servos' command [rad], and how fast it gets there [rad/s]
CLOSE_S, GRIP_S = 0.8, 0.4  # until the pads are on the cube; from then until they press evenly
STIFFEST = 200.0  # gain of a servo, robosuite's 20 [N m/rad]

with np.load(sys.argv[1], allow_pickle=False) as given:
    shared = dict(given)
os.chdir(Path(sys.argv[2]).parent)  # MuJoCo logs warnings in a file where it runs
step, half_edge = float(shared["time_step"]), float(shared["edge"]) / 2


def description() -> mujoco.MjSpec:
    """Robosuite's 2F-85; of two meshes of one name the first counts, as robosuite has it."""
    found = importlib.util.find_spec("robosuite")
    if found is None or not found.submodule_search_locations:
        raise SystemExit("robosuite is not installed")
    folder = Path(found.submodule_search_locations[0]) / "models/assets/grippers"
    tree = ElementTree.parse(folder / "robotiq_gripper_85.xml").getroot()
    compiler = ElementTree.SubElement(tree, "compiler")
    compiler.attrib.update(angle="radian", inertiagrouprange="0 0", autolimits="true")
    asset = tree.find("asset")
    assert asset is not None
    seen = set()
    for mesh in list(asset):
        mesh.set("file", str(folder / mesh.attrib["file"]))
        if mesh.attrib["name"] in seen:
            asset.remove(mesh)
        seen.add(mesh.attrib["name"])
    return mujoco.MjSpec.from_string(ElementTree.tostring(tree, encoding="unicode"))


def compiled() -> mujoco.MjModel:
    """Hand and cube."""
    spec = mujoco.MjSpec.from_string(SCENE.format(step=step, h=half_edge))
    hand = description()
    base = hand.body("robotiq_85_adapter_link")
    for child in base.bodies:
        # As of any parent and child; MuJoCo makes an exception of a parent that stands still.
        hand.add_exclude(bodyname1=base.name, bodyname2=child.name)
    spec.attach(hand, prefix="", frame=spec.body("hand").add_frame())
    return spec.compile()


model = compiled()
data = mujoco.MjData(model)
actuators = [model.actuator(name).id for name in ("finger_1", "finger_2")]
cube, cube_body = model.geom("cube").id, model.body("cube").id
tcp = np.array([0.0, 0.0, 0.1425])
"""Where the cube is put: between the pads as they hold it."""


def pressed() -> float:
    """Force of each finger on the cube along the closing axis [N]."""
    total, found = 0.0, np.zeros(6)
    for k in range(data.ncon):
        if cube in data.contact[k].geom:
            mujoco.mj_contactForce(model, data, k, found)
            total += abs(data.contact[k].frame.reshape(3, 3)[:, 1] @ found[:3])
    return total / 2


def steps(seconds: float) -> range:
    """The simulator's steps in a time [s]."""
    return range(round(seconds / step))


def grip(mass: float, friction: float, gain: float) -> float:
    """Close on the cube without gravity, with servos of a gain [N m/rad]; the pads' force [N]."""
    model.geom_friction[:, 0] = friction
    model.body_mass[cube_body] = mass
    model.body_inertia[cube_body] = mass * (2 * half_edge) ** 2 / 6
    model.actuator_gainprm[actuators, 0], model.actuator_biasprm[actuators, 1] = gain, -gain
    model.opt.gravity[:] = 0.0
    mujoco.mj_setConst(model, data)
    mujoco.mj_resetData(model, data)
    data.qpos[:7] = [*tcp, 1, 0, 0, 0]
    data.qpos[7:] = OPEN
    for n in steps(CLOSE_S + GRIP_S):
        data.ctrl[actuators] = min(SHUT, n * step * CLOSING)
        mujoco.mj_step(model, data)
    return pressed()


@cache
def gain_for(mass: float, friction: float, force: float) -> float:
    """Of the servos, with which the pads press with a force, by bisection [N m/rad]."""
    low, high = 0.0, STIFFEST
    for _ in range(12):
        middle = (low + high) / 2
        low, high = (middle, high) if grip(mass, friction, middle) < force else (low, middle)
    return high


def run(samples: slice, mass: float, friction: float, force: float) -> dict:
    """Hold through one swing.

    Args:
        samples: of ``time`` and ``felt``.
        mass: of the cube [kg].
        friction: coefficient.
        force: of each pad [N].
    """
    began = time.process_time()
    times, felt = shared["time"][samples], shared["felt"][samples]
    grip(mass, friction, gain_for(mass, friction, force))
    put = data.qpos[:3].copy()  # closing moves it by some millimetres
    settle, look = len(steps(float(shared["settle_s"]))), len(steps(float(shared["look_s"])))
    poses, speeds, forces = [], [], []
    for n in steps(float(shared["settle_s"]) + times[-1] + float(shared["after_s"])):
        if n >= settle and (n - settle) % look == 0:
            poses.append(np.concatenate([data.qpos[:3] - put, data.qpos[3:7]]))
            speeds.append(data.joint("finger_joint").qvel[0])
            forces.append(pressed())
            if np.linalg.norm(poses[-1][:3]) > float(shared["gone"]):
                break
        now = (n - settle) * step
        model.opt.gravity[:] = [np.interp(now, times, felt[:, i]) for i in range(3)]
        mujoco.mj_step(model, data)
    return {
        "pose": np.array(poses),
        "speed": np.array(speeds),
        "pad_force": np.array(forces),
        "looks": len(poses),
        "cpu_s": time.process_time() - began,
    }


columns = (shared[name] for name in ("first", "count", "mass", "friction", "force"))
ended = [
    run(slice(first, first + count), *map(float, rest))
    for first, count, *rest in zip(*columns, strict=True)
]
written = {
    name: np.concatenate([end[name] for end in ended]) for name in ("pose", "speed", "pad_force")
} | {name: np.array([end[name] for end in ended]) for name in ("looks", "cpu_s")}
np.savez(sys.argv[2], **written)  # type: ignore[arg-type]
