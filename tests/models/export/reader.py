"""Reads exported files in pinocchio, yourdfpy and MuJoCo; run by the peers' interpreter.

``reader.py GIVEN ANSWER``: both npz. Given are the files' paths, names of joints and of frames, and
the joints' positions ``[n, k]``. The answer has, by reader, frames' poses ``[n, f, 4, 4]``, whether
anything collides ``[n]``, masses ``[f]``, mass matrices ``[10, k, k]`` in the order of the joints,
and numbers of collision shapes ``[f]``, as far as the reader has them.
"""

import sys

import mujoco
import numpy as np
import pinocchio
import yourdfpy

given = np.load(sys.argv[1])
urdf, srdf, mjcf = (str(given[kind]) for kind in ("urdf", "srdf", "mjcf"))
joints, frames, positions = given["joints"].tolist(), given["frames"].tolist(), given["positions"]
answer = {}
DYNAMICS, FEW = 10, 50  # postures: yourdfpy takes 5 ms each


def blank():
    return np.tile(np.eye(4), (len(positions), len(frames), 1, 1)), np.zeros(len(positions), bool)


def in_pinocchio():
    model = pinocchio.buildModelFromUrdf(urdf)
    shapes = pinocchio.buildGeomFromUrdf(model, urdf, pinocchio.GeometryType.COLLISION)
    shapes.addAllCollisionPairs()
    pinocchio.removeCollisionPairs(model, shapes, srdf)
    data, shape_data = model.createData(), shapes.createData()
    ids = [model.getFrameId(name, pinocchio.FrameType.BODY) for name in frames]
    led = [model.joints[model.getJointId(name)] for name in joints]
    index = [joint.idx_v for joint in led]
    X, collides = blank()
    answer["pinocchio_mass_matrix"] = []
    for i, row in enumerate(positions):
        q = pinocchio.neutral(model)
        for joint, angle in zip(led, row, strict=True):
            angles = [angle] if joint.nq == 1 else [np.cos(angle), np.sin(angle)]
            q[joint.idx_q : joint.idx_q + joint.nq] = angles
        pinocchio.framesForwardKinematics(model, data, q)
        X[i] = [data.oMf[frame].homogeneous for frame in ids]
        collides[i] = pinocchio.computeCollisions(model, data, shapes, shape_data, q, True)
        if i < DYNAMICS:
            upper = np.triu(pinocchio.crba(model, data, q))
            whole = upper + np.triu(upper, 1).T
            answer["pinocchio_mass_matrix"].append(whole[np.ix_(index, index)])
    answer["pinocchio_X"], answer["pinocchio_collides"] = X, collides
    parents = [shape.parentFrame for shape in shapes.geometryObjects]
    answer["pinocchio_shapes"] = [parents.count(frame) for frame in ids]
    answer["pinocchio_postures"] = pinocchio_postures(model)


def pinocchio_postures(model):
    pinocchio.loadReferenceConfigurations(model, srdf, False)
    return sorted(entry.key() for entry in model.referenceConfigurations)


def in_yourdfpy():
    robot = yourdfpy.URDF.load(urdf)
    assert robot.validate()
    X = []
    for row in positions[:FEW]:
        led = dict(zip(joints, row, strict=True))
        robot.update_cfg({name: led[name] for name in robot.actuated_joint_names})
        X.append([robot.get_transform(frame) for frame in frames])
    answer["yourdfpy_X"] = X
    links = [robot.link_map[name] for name in frames]
    answer["yourdfpy_mass"] = [link.inertial.mass if link.inertial else 0.0 for link in links]
    answer["yourdfpy_shapes"] = [len(link.collisions) for link in links]


def in_mujoco():
    model = mujoco.MjModel.from_xml_path(mjcf)
    data = mujoco.MjData(model)
    X, collides = blank()
    sites = [model.site(i).name for i in range(model.nsite)]
    index = [model.joint(name).dofadr[0] for name in joints]
    answer["mujoco_mass_matrix"] = []
    for i, row in enumerate(positions):
        data.qpos[[model.joint(name).qposadr[0] for name in joints]] = row
        mujoco.mj_fwdPosition(model, data)
        for k, name in enumerate(frames):
            of = data.site(name) if name in sites else data.body(name)
            X[i, k, :3, :3], X[i, k, :3, 3] = of.xmat.reshape(3, 3), of.xpos
        collides[i] = (data.contact.dist < 0).any()
        if i < DYNAMICS:
            whole = np.zeros((model.nv, model.nv))
            for k in range(model.nv):  # column by column: the full matrix has no stable name
                unit, column = np.eye(model.nv)[k], np.zeros(model.nv)
                mujoco.mj_mulM(model, data, column, unit)
                whole[:, k] = column
            answer["mujoco_mass_matrix"].append(whole[np.ix_(index, index)])
    answer["mujoco_X"], answer["mujoco_collides"] = X, collides
    bodies = [None if name in sites else model.body(name) for name in frames]
    answer["mujoco_mass"] = [0.0 if body is None else body.mass[0] for body in bodies]
    meant = model.geom_bodyid[model.geom_contype > 0].tolist()
    answer["mujoco_shapes"] = [0 if body is None else meant.count(body.id) for body in bodies]
    answer["mujoco_slack"] = pushed(model, data)


def pushed(model, data):
    """How far the couplers are off [rad] while the fingers' motors push the fingers 0.2 rad."""
    first, second = model.eq_obj1id, model.eq_obj2id
    mujoco.mj_resetData(model, data)
    data.qpos[first] = model.eq_data[:, 0]
    model.opt.gravity[:] = 0.0
    fingers = [k for k in range(model.nu) if not model.actuator(k).name.startswith("joint_")]
    data.ctrl[fingers] = 0.01
    slack = 0.0
    for _ in range(1000):
        mujoco.mj_step(model, data)
        wanted = model.eq_data[:, 0] + model.eq_data[:, 1] * data.qpos[second]
        slack = max(slack, np.abs(data.qpos[first] - wanted).max())
        if np.abs(data.qpos[second]).max() > 0.2:
            return slack
    raise AssertionError("the fingers did not move")


in_pinocchio()
in_yourdfpy()
in_mujoco()
np.savez(sys.argv[2], **answer)
