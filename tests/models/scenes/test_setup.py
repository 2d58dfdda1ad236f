"""Scenes of one's own, from Python and from YAML, compared with plain geometry."""

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw

from models.errors import ModelError
from models.scenes.planning_scene import HOME, PlanningScene
from models.scenes.robots import GEN3, GEN3_LITE
from models.scenes.setup import Obstacle, Setup, Tool, read_setup

ROBOTS = pytest.mark.parametrize("robot", [GEN3, GEN3_LITE], ids=["gen3", "gen3_lite"])
SHIPPED_BASE = RigidTransform([0.0, 0.0, 0.5])

BALL = """
<sdf version="1.9"><model name="ball"><link name="ball"><collision name="ball">
<geometry><sphere><radius>0.04</radius></sphere></geometry></collision></link></model></sdf>
"""
YAML = """
base: {translation: [0.1, 0.2, 0.7], rotation: !Rpy {deg: [0, 0, 30]}}
tool: {shape: cylinder, size: [0.01, 0.2], pose: {translation: [0, 0, 0.1]},
       tcp: {translation: [0, 0, 0.1]}}
obstacles:
- {name: pole, shape: cylinder, size: [0.02, 0.8], pose: {translation: [0.4, 0.4, 0.9]}}
directives: [package://cell/fence.dmd.yaml]
packages: {cell: FOLDER}
furniture: false
"""
FENCE = """
directives:
- add_model: {name: fence, file: package://cell/ball.sdf}
- add_weld: {parent: world, child: "fence::ball", X_PC: {translation: [0, 0, 1.9]}}
"""


@pytest.fixture
def cell(tmp_path):
    (tmp_path / "ball.sdf").write_text(BALL)
    (tmp_path / "fence.dmd.yaml").write_text(FENCE)
    (tmp_path / "cell.yaml").write_text(YAML.replace("FOLDER", str(tmp_path)))
    return tmp_path


@ROBOTS
def test_the_base_is_where_the_setup_says(robot):
    X_WB = RigidTransform(RollPitchYaw(np.pi, 0.1, 0.5), [0.3, 0.2, 1.6])
    shipped, moved = PlanningScene(robot=robot), PlanningScene(robot=robot, setup=Setup(base=X_WB))
    X_BG = SHIPPED_BASE.inverse() @ shipped.forward(robot.home)
    assert moved.forward(robot.home).IsNearlyEqualTo(X_WB @ X_BG, 1e-12)


@ROBOTS
def test_a_probe_is_in_place_of_the_gripper(robot):
    probe = Tool("cylinder", [0.01, 0.2], tcp=RigidTransform([0.0, 0.0, 0.1]))
    probe.pose = RigidTransform([0.0, 0.0, 0.1])
    scene = PlanningScene(robot=robot, setup=Setup(tool=probe))
    X_WG = scene.forward(robot.home)
    arm = scene.plant.GetModelInstanceByName("arm")
    flange = scene.plant.GetBodyByName("end_effector_link", arm).EvalPoseInWorld(scene.context)
    assert X_WG.IsNearlyEqualTo(flange @ RigidTransform([0.0, 0.0, 0.2]), 1e-12)
    assert not scene.plant.HasModelInstanceNamed("gripper")
    assert scene.robot.finger_joints == ()
    assert scene.is_free(robot.home)


@ROBOTS
def test_a_tool_on_the_gripper_has_a_centre_point_of_its_own(robot):
    X_PT, X_TG = (
        RigidTransform(RollPitchYaw(0.1, 0.2, 0.3), [0.0, 0.02, 0.2]),
        RigidTransform([0, 0, 0.05]),
    )
    tool = Tool("sphere", [0.02], "", "gripper", X_PT, X_TG)
    scene = PlanningScene(robot=robot, setup=Setup(tool=tool))
    X_WG = scene.forward(robot.home)
    bodies = scene.plant.GetBodyIndices(scene.hand_instance)
    base = scene.plant.get_body(bodies[0]).EvalPoseInWorld(scene.context)
    assert X_WG.IsNearlyEqualTo(base @ X_PT @ X_TG, 1e-12)
    assert scene.plant.HasModelInstanceNamed("gripper")


@pytest.mark.parametrize(
    ("shape", "size"),
    [
        ("sphere", [0.1]),
        ("ellipsoid", [0.2, 0.2, 0.1]),
        ("cylinder", [0.2, 0.2]),
        ("capsule", [0.05, 0.1]),
        ("box", [0.3, 0.3, 0.2]),
    ],
)
def test_obstacles_are_as_far_away_as_they_are_said_to_be(shape, size):
    """Each reaches 10 cm below its centre, above a ball on the flange of an upright arm."""
    ball = Tool("sphere", [0.05], pose=RigidTransform([0.0, 0.0, 0.1]))
    top = PlanningScene(setup=Setup(tool=ball)).forward(np.zeros(7)).translation()
    above = RigidTransform(top + np.array([0.0, 0.0, 0.05 + 0.03 + 0.1]))
    setup = Setup(tool=ball, obstacles=[Obstacle("thing", shape, size, above)])
    clearance = PlanningScene(setup=setup).clearance(np.zeros(7), 0.045)
    assert clearance.distance == pytest.approx(0.03, abs=1e-4)
    assert set(clearance.bodies) == {"thing::thing", "tool::tool"}


def test_a_mesh_counts_as_its_hull(tmp_path):
    corners = [f"v {x} {y} {z}" for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    faces = ["1 2 4 3", "5 7 8 6", "1 5 6 2", "3 4 8 7", "1 3 7 5", "2 6 8 4"]
    file = tmp_path / "crate.obj"
    file.write_text("\n".join([*corners, *(f"f {face}" for face in faces)]) + "\n")
    at = RigidTransform(RollPitchYaw(0.3, 0.2, 0.1), [0.75, 0.1, 0.95])
    mesh = Obstacle("crate", "mesh", [0.05], at, str(file))
    box = Obstacle("crate", "box", [0.1, 0.1, 0.1], at)
    scenes = [PlanningScene(setup=Setup(obstacles=[one])) for one in (mesh, box)]
    rng = np.random.default_rng(0)
    for q in HOME + rng.normal(0.0, 0.1, (20, 7)):
        distances = [scene.clearance(q, 0.5).distance for scene in scenes]
        assert distances[0] == pytest.approx(distances[1], abs=1e-4)


def test_yaml_says_what_python_says(cell):
    from_yaml = read_setup(cell / "cell.yaml")
    in_python = Setup(
        base=RigidTransform(RollPitchYaw(0.0, 0.0, np.pi / 6), [0.1, 0.2, 0.7]),
        tool=Tool("cylinder", [0.01, 0.2], pose=RigidTransform([0, 0, 0.1])),
        obstacles=[Obstacle("pole", "cylinder", [0.02, 0.8], RigidTransform([0.4, 0.4, 0.9]))],
        directives=[str(cell / "fence.dmd.yaml")],
        packages={"cell": str(cell)},
        furniture=False,
    )
    in_python.tool.tcp = RigidTransform([0, 0, 0.1])
    scenes = [PlanningScene(setup=setup) for setup in (from_yaml, in_python)]
    rng = np.random.default_rng(0)
    for q in rng.uniform(-1.0, 1.0, (20, 7)):
        poses = [scene.forward(q) for scene in scenes]
        assert poses[0].IsNearlyEqualTo(poses[1], 1e-12)
        clearances = [scene.clearance(q, 1.0) for scene in scenes]
        assert clearances[0].bodies == clearances[1].bodies
    for scene in scenes:
        assert scene.plant.HasModelInstanceNamed("fence")
        assert not scene.plant.HasModelInstanceNamed("table")


def test_a_tool_from_a_file(cell):
    tool = Tool(file=str(cell / "ball.sdf"), tcp=RigidTransform([0.0, 0.0, 0.04]))
    by_package = Tool(file="package://cell/ball.sdf", tcp=tool.tcp)
    shape = Tool("sphere", [0.04], tcp=tool.tcp)
    setups = [Setup(tool=one, packages={"cell": str(cell)}) for one in (tool, by_package, shape)]
    poses = [PlanningScene(setup=setup).forward(HOME) for setup in setups]
    assert poses[0].IsExactlyEqualTo(poses[2]) and poses[1].IsExactlyEqualTo(poses[2])


NOT_FINITE = RigidTransform([np.nan, 0.0, 0.0])


PLANE = "<plane><normal>0 0 1</normal></plane>"
SPHERE = "<sphere><radius>0.04</radius></sphere>"


@pytest.mark.parametrize("where", ["directives", "tool"])
def test_a_plane_is_refused_by_its_bodys_name(cell, where):
    """Drake has no distance from a half space to a box, and said so in the first question."""
    (cell / "ball.sdf").write_text(BALL.replace(SPHERE, PLANE))
    setup = (
        Setup(directives=[str(cell / "fence.dmd.yaml")], packages={"cell": str(cell)})
        if where == "directives"
        else Setup(tool=Tool(file=str(cell / "ball.sdf")))
    )
    name = "fence::ball" if where == "directives" else "ball::ball"
    with pytest.raises(ModelError, match=f"^{name}: a half space.*; valid: .*box"):
        PlanningScene(setup=setup)


@pytest.mark.parametrize(
    ("setup", "message"),
    [
        (7, "setup: int; valid"),
        (Setup(base="up"), "base: str; valid"),
        (Setup(base=NOT_FINITE), "base.*not finite"),
        (Setup(obstacles=[Obstacle("a", "cone", [1.0])]), "'a': shape 'cone'; valid: box, sphere"),
        (Setup(obstacles=[Obstacle("a", "box", [1.0])]), "'a': size .*valid: length in x"),
        (Setup(obstacles=[Obstacle("a", "sphere", [-1.0])]), "'a': size: -1.0; valid"),
        (Setup(obstacles=[Obstacle("a", "sphere", [np.nan])]), "'a': size: nan; valid"),
        (Setup(obstacles=[Obstacle("", "sphere", [1.0])]), "a name of its own"),
        (Setup(obstacles=[Obstacle("arm", "sphere", [1.0])]), "a name of its own"),
        (Setup(obstacles=[Obstacle("a", "mesh", file="rock.obj")]), "'rock.obj'; valid"),
        (Setup(obstacles=[Obstacle("a", "sphere", [1.0], NOT_FINITE)]), "'a'.*not finite"),
        (Setup(tool=Tool()), "either a shape or a file"),
        (Setup(tool=Tool("sphere", [0.1], on="elbow")), "on 'elbow'; valid: flange, gripper"),
        (Setup(tool=Tool(file="tool.sdf")), "tool: tool.sdf: .*valid: an absolute path"),
        (Setup(tool=Tool(file="/nowhere/tool.sdf")), "tool: /nowhere/tool.sdf: "),
        (Setup(directives=["mine.dmd.yaml"]), "directives: mine.dmd.yaml: .*valid"),
        (Setup(directives=["package://nobody/a.dmd.yaml"]), "directives: package://nobody"),
        (Setup(packages={"mine": "/nowhere"}), "packages: mine: "),
    ],
)
def test_what_is_wrong_is_told(setup, message):
    with pytest.raises(ModelError, match=message):
        PlanningScene(setup=setup)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("bas: {}", "bas"),
        ("base: 7", "base"),
        ("obstacles: [{name: a, radius: 3}]", "radius"),
        ("furniture: maybe", "furniture"),
        ("{", "line"),
    ],
)
def test_wrong_yaml_names_file_and_field(tmp_path, text, message):
    file = tmp_path / "cell.yaml"
    file.write_text(text)
    with pytest.raises(ModelError, match=rf"cell.yaml.*({message})"):
        read_setup(file)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(ModelError, match=r"none\.yaml"):
        read_setup(tmp_path / "none.yaml")


def test_a_tool_carries_no_cube():
    with pytest.raises(ModelError, match="carrying"):
        PlanningScene(carrying=True, setup=Setup(tool=Tool("sphere", [0.1])))
    PlanningScene(carrying=True, setup=Setup(base=SHIPPED_BASE))
