"""The exported files are the robot, as far as Drake, an XML parser and the command tell."""

import xml.etree.ElementTree as ET
from itertools import product

import numpy as np
import pytest
from pydrake.multibody.parsing import Parser

from models import ModelError
from models import __main__ as command
from models.export.files import export_robot
from models.scenes.parsing import description_hash

from .conftest import CLOSE, POSTURES, Alone

URDF_1_0 = {"box", "cylinder", "sphere", "mesh"}


def read_urdf(sample):
    def add(plant):
        parser = Parser(plant)
        parser.SetStrictParsing()
        parser.AddModels(str(sample.files[0]))
        plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("base_link"))

    return Alone(add, sample.joints, sample.files[1])


def read_mjcf(sample):
    return Alone(lambda plant: Parser(plant).AddModels(str(sample.files[2])), sample.joints)


@pytest.mark.parametrize(("read", "frames"), [(read_urdf, None), (read_mjcf, -1)])
def test_drake_reads_the_same_robot(sample, read, frames):
    """Drake reads no sites, so ``tcp``, the last frame, is not in its MJCF."""
    arm, names = read(sample), sample.frames[:frames]
    verdicts = []
    for i in [*range(0, POSTURES, 5), *range(POSTURES, POSTURES + 2 * CLOSE)]:
        arm.set(sample.positions[i])
        np.testing.assert_allclose(arm.poses(names), sample.X[i, : len(names)], rtol=0, atol=1e-9)
        verdicts.append((arm.distance() < 0) == (sample.distance[i] < 0))
        if i < len(sample.mass_matrix):
            M = sample.mass_matrix[i]
            np.testing.assert_allclose(arm.mass_matrix(), M, rtol=1e-9, atol=1e-12)
    assert np.mean(verdicts) >= 0.99


def test_what_stricter_readers_refuse_is_not_there(sample):
    urdf, srdf, mjcf = sample.files
    root = ET.parse(urdf).getroot()
    assert {shape.tag for geometry in root.iter("geometry") for shape in geometry} <= URDF_1_0
    for path in (urdf, srdf, mjcf):
        assert "drake" not in path.read_text(encoding="utf-8")
        assert "package://" not in path.read_text(encoding="utf-8")
    for transmission in root.iter("transmission"):
        assert transmission.findtext("type") == "transmission_interface/SimpleTransmission"
        assert transmission.find("joint/hardwareInterface") is not None
        assert transmission.find("actuator/mechanicalReduction") is not None


def test_motors_are_on_every_joint_that_is_commanded(sample):
    urdf, _, mjcf = (ET.parse(path).getroot() for path in sample.files)
    following = {j.get("name") for j in urdf.findall("joint") if j.find("mimic") is not None}
    arm = [name for name in sample.joints if name.startswith("joint_")]
    led = [t.find("joint").get("name") for t in urdf.findall("transmission")]
    assert led[:-1] == arm
    assert led[-1] not in following
    both = [m.get("joint") for m in mjcf.find("actuator")]
    assert both[:-2] == arm
    assert {name.partition("_")[2] for name in both[-2:]} in ({"knuckle"}, {"finger_bottom"})


def test_a_capsule_becomes_what_has_the_same_points(sample):
    """Ends of the axis, and radius, as the base's description gives them."""
    if sample.name == "gen3":
        base = ET.parse(sample.files[0]).getroot().find("link[@name='base_link']")
        cylinder, *spheres = base.findall("collision")
        (length, radius) = (
            float(cylinder.find("geometry/cylinder").get(k)) for k in ("length", "radius")
        )
        assert (length, radius) == (0.133590831, 0.0525)
        ends = [np.array(s.find("origin").get("xyz").split(), dtype=float) for s in spheres]
        assert np.linalg.norm(ends[1] - ends[0]) == pytest.approx(length, abs=1e-12)
        np.testing.assert_allclose(np.mean(ends, axis=0), [-0.00255, -5e-5, 0.07885], atol=1e-12)
        assert {float(s.find("geometry/sphere").get("radius")) for s in spheres} == {radius}


def test_writing_again_gives_the_same_bytes_and_leaves_nothing_else(tmp_path):
    first = [path.read_bytes() for path in export_robot(tmp_path / "new" / "folder")]
    paths = export_robot(tmp_path / "new" / "folder")
    assert [path.read_bytes() for path in paths] == first
    assert sorted(paths) == sorted((tmp_path / "new" / "folder").iterdir())


def test_the_description_is_not_touched(tmp_path):
    before = description_hash()
    export_robot(tmp_path)
    assert description_hash() == before


def test_another_robot_and_a_folder_that_is_none_are_refused(tmp_path):
    with pytest.raises(ModelError, match="'gen4'; valid: gen3, gen3_lite"):
        export_robot(tmp_path, "gen4")
    (tmp_path / "file").write_text("")
    with pytest.raises(ModelError, match=r"file.*; valid: a folder that can be written to"):
        export_robot(tmp_path / "file")


@pytest.mark.parametrize(("robot", "name"), [("gen3", "gen3_2f85"), ("gen3_lite", "gen3_lite")])
def test_the_command_writes_and_names_the_files(tmp_path, capsys, robot, name):
    command.main([robot, "--export", str(tmp_path)])
    named = capsys.readouterr().out.split()
    assert named == [str(tmp_path / f"{name}.{kind}") for kind in ("urdf", "srdf", "xml")]
    assert sorted(named) == sorted(map(str, tmp_path.iterdir()))


def test_the_command_says_in_a_line_why_it_cannot(tmp_path, capsys):
    (tmp_path / "file").write_text("")
    with pytest.raises(SystemExit, match="2"):
        command.main(["--export", str(tmp_path / "file")])
    assert "error: --export" in capsys.readouterr().err.splitlines()[-1]


def test_srdf_lists_what_drake_leaves_out_and_no_more(sample):
    root = ET.parse(sample.files[1]).getroot()
    listed = {(p.get("link1"), p.get("link2")) for p in root.iter("disable_collisions")}
    solid = sorted(n for n, k in zip(sample.frames, sample.shapes, strict=True) if k)
    assert listed <= {(a, b) for a, b in product(solid, solid) if a < b}
    excluded = {(e.get("body1"), e.get("body2")) for e in ET.parse(sample.files[2]).iter("exclude")}
    assert excluded == listed
    adjacent = {p.get("reason") for p in root.iter("disable_collisions")}
    assert adjacent == {"Adjacent", "User"}
