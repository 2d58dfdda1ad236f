"""The Gen3 Lite's map: every positive by Drake, every negative with its reason; its file."""

from collections import Counter

import numpy as np
import pytest

from models.errors import ModelError
from models.gen3_lite.chain import LIMIT, forward
from models.gen3_lite.ik import solve, within_limits
from models.inverse_kinematics.solution import Failure, reaches
from models.maps.gripper_poses import gripper_pose
from models.maps.lite import LiteScene, _entry, build, numerical
from models.maps.lite_csv import COLUMNS, read_map, write_map
from models.scenes.planning_scene import MARGIN, Clearance, PlanningScene
from models.scenes.robots import GEN3_LITE
from models.task.spaces import N_GRIPPERS, POSITIONS


@pytest.fixture(scope="module")
def entries():
    return build()


@pytest.fixture(scope="module")
def scene():
    return LiteScene()


def test_every_cell_pose_is_there_once(entries):
    keys = {(*entry.p_WG.tolist(), entry.gripper) for entry in entries}
    assert keys == {(*p.tolist(), g) for p in POSITIONS for g in range(N_GRIPPERS)}
    assert len(entries) == len(keys) == 324


def test_counts(entries):
    """Half the poses: the vertical hand reaches the nearest columns only."""
    assert Counter(entry.value for entry in entries) == {0: 162, 1: 162}
    vertical = [entry for entry in entries if entry.gripper >= 10]
    assert all((entry.value == 1) == (entry.p_WG[0] < 0.52) for entry in vertical)


def test_positives_are_judged_again_by_drake(entries):
    scene = PlanningScene(robot=GEN3_LITE, carrying=True)
    for entry in entries:
        if entry.q is None:
            continue
        assert entry.failure is None
        assert reaches(scene, entry.q, gripper_pose(entry.p_WG, entry.gripper))
        assert scene.is_free(entry.q, MARGIN)
        assert scene.clearance(entry.q) == entry.clearance
        assert 1 <= entry.within_limits <= entry.solutions <= 16


def test_negatives_have_a_reason(entries):
    for entry in entries:
        if entry.value:
            continue
        # No real root; brute force agrees, else the value were 2 or the failure another.
        assert (entry.solutions, entry.within_limits, entry.clearance) == (0, 0, None)
        assert entry.failure in (Failure.OUT_OF_REACH, Failure.NOT_FOUND)


def test_the_value_names_the_procedure(scene, entries):
    known = next(entry for entry in entries if entry.value)
    none = np.empty((0, 6))
    given = known.p_WG, known.gripper
    assert _entry(scene, *given, known.q[None], []).value == 1
    second = _entry(scene, *given, none, [known.q])
    assert (second.value, second.solutions) == (2, 0)
    np.testing.assert_array_equal(second.q, known.q)
    assert _entry(scene, *given, none, []).failure == Failure.NOT_FOUND


def test_solutions_that_are_no_use_are_named(scene):
    X_WG = gripper_pose(np.array([0.45, 0.0, 0.42]), 10)  # inside the table
    (R,), (p,) = scene.end_effector([X_WG])
    solutions = solve(R, p)
    entry = _entry(scene, X_WG.translation(), 10, solutions, [])
    assert (entry.value, entry.failure) == (0, Failure.BLOCKED)
    assert entry.clearance is not None and entry.clearance.distance < MARGIN
    beyond = solutions[~within_limits(solutions)]
    assert len(beyond)
    entry = _entry(scene, X_WG.translation(), 10, beyond, [])
    assert (entry.failure, entry.within_limits) == (Failure.JOINT_LIMIT, 0)


def test_numerical_solver_meets_what_the_arm_reaches():
    rng = np.random.default_rng(0)
    for q in rng.uniform(-LIMIT, LIMIT, (20, 6)):
        R, p = forward(q)
        answers = numerical(R, p, rng)
        assert answers
        for answer in answers:
            assert np.abs(forward(answer)[1] - p).max() < 1e-11


@pytest.fixture
def file(entries, tmp_path):
    path = tmp_path / "map.csv"
    entry = entries[0]
    collides = Clearance(-0.01, ("table::table", "arm::forearm_link"))
    other = type(entry)(entry.p_WG + 0.01, 3, 0, None, collides, Failure.COLLISION, 8, 2)
    write_map([entry, other, *entries[18:22]], 5, path)
    return path


def test_file_holds_every_bit(file, tmp_path):
    again = tmp_path / "again.csv"
    write_map(read_map(file), 5, again)
    assert again.read_bytes() == file.read_bytes()
    entry, other, *_ = read_map(file)
    assert entry.q.shape == (6,)
    assert other.clearance.bodies == ("table::table", "arm::forearm_link")
    assert other.failure == Failure.COLLISION


def test_two_builds_give_the_same_file(entries, tmp_path):
    for name, map_ in (("a", entries), ("b", build())):
        write_map(map_, 0, tmp_path / name)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


@pytest.mark.parametrize(
    ("line", "column", "text", "message"),
    [
        (3, "x", "east", "line 3, x: 'east'; valid: a finite number"),
        (3, "q6", "", "line 3, q6: ''"),
        (3, "gripper", "18", "line 3, gripper: 18; valid: 0…17"),
        (3, "value", "3", "line 3, value: 3; valid: 0…2"),
        (4, "failure", "tired", "line 4, failure: 'tired'; valid: out of reach"),
        (4, "solutions", "17", "line 4, solutions: 17; valid: 0…16"),
        (4, "clearance", "near", "line 4, clearance: 'near'"),
    ],
)
def test_malformed_fields_are_named(file, line, column, text, message):
    rows = file.read_text().splitlines()
    fields = rows[line - 1].split(",")
    fields[COLUMNS.index(column)] = text
    rows[line - 1] = ",".join(fields)
    file.write_text("\n".join(rows))
    with pytest.raises(ModelError, match=message):
        read_map(file)


def test_other_files_are_refused(file, tmp_path):
    text = file.read_text()
    title, header, first, *_ = text.splitlines()
    for broken, message in (
        ("", "line 1"),
        (text.replace(title[-64:], "0" * 64), "line 1: .*build the map again"),
        (f"{title}\nx,y,z", "line 2: valid columns: x,y,z,roll"),
        (f"{title}\n{header}\n{first},1", "line 3: 21 fields; valid: 20"),
    ):
        file.write_text(broken)
        with pytest.raises(ModelError, match=message):
            read_map(file)
    with pytest.raises(ModelError, match=r"absent\.csv: cannot be read"):
        read_map(tmp_path / "absent.csv")
