"""Each arm with its gripper as Drake has it, at random postures, and the files exported of it."""

import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from pydrake.geometry import CollisionFilterDeclaration
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.multibody.tree import BodyIndex
from pydrake.systems.framework import DiagramBuilder

from models.export.files import DIRECTIVES, export_robot
from models.scenes.parsing import add_models
from models.scenes.robots import GEN3, GEN3_LITE

ROBOTS = {"gen3": GEN3, "gen3_lite": GEN3_LITE}
POSTURES, CLOSE = 1000, 80


@dataclass
class Sample:
    """What Drake says of a robot: `POSTURES` random postures, `CLOSE` that touch, `CLOSE` nearly.

    Attributes:
        name: the robot.
        files: URDF, SRDF and MJCF.
        joints: names ``[k]``, fingers last.
        positions: of the joints ``[n, k]`` [rad], all fingers as the hand holds them.
        frames: names of all links, and ``tcp`` ``[f]``.
        X: their poses in the base ``[n, f, 4, 4]``.
        distance: smallest signed distance ``[n]`` [m], at most 0.05.
        mass: of the links ``[f]`` [kg].
        mass_matrix: at the first postures ``[10, k, k]``, in the order of the joints.
        shapes: number of collision shapes of each link ``[f]``.
    """

    name: str
    files: tuple[Path, Path, Path]
    joints: list
    positions: np.ndarray
    frames: list
    X: np.ndarray
    distance: np.ndarray
    mass: np.ndarray
    mass_matrix: np.ndarray
    shapes: np.ndarray


class Alone:
    """An arm with its gripper, on its base at the world's origin.

    ``add`` adds it to a plant; an SRDF may name pairs to leave out.
    """

    def __init__(self, add, joints, srdf=None):
        builder = DiagramBuilder()
        self.plant, scene_graph = AddMultibodyPlantSceneGraph(builder, time_step=1e-3)
        add(self.plant)
        self.plant.Finalize()
        if srdf:
            for pair in ET.parse(srdf).iter("disable_collisions"):
                bodies = [self.plant.GetBodyByName(pair.get(key)) for key in ("link1", "link2")]
                shapes = [self.plant.CollectRegisteredGeometries([body]) for body in bodies]
                scene_graph.collision_filter_manager().Apply(
                    CollisionFilterDeclaration().ExcludeBetween(*shapes)
                )
        self._diagram = builder.Build()
        self._root = self._diagram.CreateDefaultContext()
        self.context = self.plant.GetMyMutableContextFromRoot(self._root)
        self.joints = [self.plant.GetJointByName(name) for name in joints]

    def set(self, positions):
        """Put the joints, in the given order, where they shall be."""
        for joint, angle in zip(self.joints, positions, strict=True):
            joint.set_angle(self.context, angle)

    def poses(self, frames):
        """Poses of frames in the world ``[f, 4, 4]``."""
        found = [self.plant.GetFrameByName(name) for name in frames]
        return np.array([f.CalcPoseInWorld(self.context).GetAsMatrix4() for f in found])

    def distance(self):
        """Smallest signed distance [m], at most 0.05."""
        query = self.plant.get_geometry_query_input_port().Eval(self.context)
        pairs = query.ComputeSignedDistancePairwiseClosestPoints(0.05)
        return min((pair.distance for pair in pairs), default=0.05)

    def mass_matrix(self):
        """Mass matrix at the present posture ``[k, k]``, in the order of the joints."""
        index = [joint.velocity_start() for joint in self.joints]
        return self.plant.CalcMassMatrix(self.context)[np.ix_(index, index)]


def random_positions(arm, robot, n, rng):
    lower, upper = (
        np.array([getattr(joint, f"position_{end}_limits")()[0] for joint in arm.joints])
        for end in ("lower", "upper")
    )
    low, high = np.maximum(lower, -np.pi), np.minimum(upper, np.pi)
    positions = rng.uniform(low, high, (n, len(arm.joints)))
    for row in positions:
        row[len(robot.joints) :] = robot.finger_positions(rng.uniform(0.0, robot.max_opening))
    return positions


@pytest.fixture(scope="session", params=ROBOTS)
def sample(request, tmp_path_factory):
    """A robot's `Sample`, once for all tests."""
    name, robot = request.param, ROBOTS[request.param]
    files = export_robot(tmp_path_factory.mktemp("files"), name)
    joints = [*robot.joints, *robot.finger_joints]

    def add(plant):
        add_models(plant, DIRECTIVES[name])
        plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("base_link"))

    arm = Alone(add, joints)
    more = random_positions(arm, robot, 8000, np.random.default_rng(0))
    distance = np.zeros(len(more))
    for i, row in enumerate(more):
        arm.set(row)
        distance[i] = arm.distance()
    rest = np.arange(POSTURES, len(more))
    touch, free = rest[distance[rest] < 0], rest[distance[rest] >= 0]
    nearest = free[np.argsort(distance[free])[:CLOSE]]
    chosen = np.concatenate([np.arange(POSTURES), touch[:CLOSE], nearest])
    positions, distance = more[chosen], distance[chosen]
    plant = arm.plant
    links = [plant.get_body(BodyIndex(i)) for i in range(1, plant.num_bodies())]
    frames = [link.name() for link in links] + ["tcp"]
    X, mass_matrix = [], []
    for row in positions:
        arm.set(row)
        X.append(arm.poses(frames))
        if len(mass_matrix) < 10:
            mass_matrix.append(arm.mass_matrix())
    return Sample(
        name=name,
        files=files,
        joints=joints,
        positions=positions,
        frames=frames,
        X=np.array(X),
        distance=distance,
        mass=np.array([link.default_mass() for link in links] + [0.0]),
        mass_matrix=np.array(mass_matrix),
        shapes=np.array([len(plant.GetCollisionGeometriesForBody(link)) for link in links] + [0]),
    )
