import csv
import io
from dataclasses import replace

import numpy as np
import pytest
import yaml

from models.errors import ModelError
from models.export.precomputed import (
    ACCELERATION_LIMITS,
    MARGIN,
    POSITION_LIMITS,
    require_precomputed,
    require_precomputed_text,
    to_precomputed,
)
from models.export.trajectories import (
    JOINT_NAMES,
    JOINT_SPEEDS,
    STEP,
    grips_to_csv,
    time_program,
    to_csv,
    to_ros,
)
from models.motion.moves import Grip, Move
from models.scenes.gripper import MAX_OPENING
from models.scenes.planning_scene import HOME

AWAY = HOME + np.array([0.7, 0.3, -0.5, 0.4, 1.2, -0.2, 2.0])
PROGRAM = (
    Grip(MAX_OPENING, 0.5),
    Move(np.array([HOME, AWAY])),
    Grip(0.0, 1.3),
    Move(np.array([AWAY, HOME, HOME + 1e-7])),
    Grip(MAX_OPENING, 1.6),
)


@pytest.fixture(scope="module")
def motion():
    return time_program(HOME, MAX_OPENING, PROGRAM)


@pytest.fixture(scope="module")
def text(motion):
    return to_precomputed(motion)


def table(text):
    rows = list(csv.reader(line for line in io.StringIO(text) if not line.startswith("#")))
    return rows[0], np.array(rows[1:], dtype=float)


@pytest.mark.parametrize("speed", [5.0, 50.0, 80.0])
def test_the_pre_computed_form_keeps_its_rules(tmp_path, speed):
    (tmp_path / "p.csv").write_text(to_precomputed(time_program(HOME, MAX_OPENING, PROGRAM, speed)))
    require_precomputed(tmp_path / "p.csv", HOME)
    # The same rules, read and computed here with none of that code.
    heads, values = table((tmp_path / "p.csv").read_text())
    time, q, v, a = values[:, 0], values[:, 1:8], values[:, 8:15], values[:, 15:]
    assert heads[:3] == ["time_s", "joint_1_deg", "joint_2_deg"]
    assert time[0] == 0.0 and np.allclose(np.diff(time), 0.001, atol=1e-9)
    assert np.allclose(np.radians(q[0]), HOME, atol=1e-8)
    assert np.allclose(np.radians(q[-1]), HOME + 1e-7, atol=1e-8)
    fastest = np.abs(np.diff(q, axis=0)).max(axis=0) / 0.001
    assert (fastest <= np.minimum(speed, [80] * 4 + [70] * 3)).all()
    assert fastest.max() > 0.9 * min(speed, 70)
    assert np.abs(v).max() <= speed and (np.abs(a) <= ACCELERATION_LIMITS).all()
    assert np.abs(v[[0, -1]]).max() == 0.0


def test_the_arm_passes_its_waypoints_and_stands_while_the_gripper_moves(motion):
    passed = np.abs(motion.q - AWAY).max(axis=1).argmin()
    assert np.allclose(motion.q[passed], AWAY, atol=1e-9)
    close, open_ = motion.grips
    assert (close[1], open_[1]) == (0.0, MAX_OPENING)
    for seconds, wait in ((close[0], 1.3), (open_[0], 1.6)):
        held = (motion.time > seconds + 2 * STEP) & (motion.time < seconds + wait - 2 * STEP)
        assert np.abs(motion.velocity[held]).max() < 1e-12
        assert len(set(motion.opening[held])) == 1
    assert grips_to_csv(motion).splitlines() == [
        "time_s,opening_m,closed",
        f"{close[0]:.3f},0.000000,1.000000",
        f"{open_[0]:.3f},{MAX_OPENING:.6f},0.000000",
    ]


def test_csv_and_ros_say_the_same_motion(motion):
    heads, values = table(to_csv(motion))
    assert heads[1] == "joint_1_rad" and heads[-1] == "gripper_opening_m"
    message = yaml.safe_load(to_ros(motion))
    assert message["joint_names"] == list(JOINT_NAMES)
    times = [p["time_from_start"] for p in message["points"]]
    seconds = [t["sec"] + 1e-9 * t["nanosec"] for t in times]
    assert np.allclose(seconds, values[:, 0], atol=1e-7) and seconds[0] == 0.0
    assert (np.diff(seconds) > 0).all()
    assert np.allclose([p["positions"] for p in message["points"]], values[:, 1:8], atol=1e-7)
    assert np.allclose([p["velocities"] for p in message["points"]], values[:, 8:15], atol=1e-7)
    for seconds, q in zip(values[:, 0], values[:, 1:8], strict=True):
        assert np.allclose(q, motion.q[round(seconds / STEP)], atol=1e-7)
    assert set(message["points"][0]) == {
        *("positions", "velocities", "accelerations", "effort", "time_from_start")
    }


def edit(text, line, column, value):
    """Another value in a line, counted from 1, as an editor counts."""
    lines = text.splitlines()
    cells = lines[line - 1].split(",")
    cells[column] = value
    lines[line - 1] = ",".join(cells)
    return "\n".join(lines) + "\n"


def number(text, line, column):
    return float(text.splitlines()[line - 1].split(",")[column])


LINE = 1700  # while the arm moves


@pytest.mark.parametrize(
    ("damage", "told"),
    [
        (lambda t: edit(t, 3, 0, "0.001"), "line 3: 0.001 s"),
        (lambda t: edit(t, LINE, 0, "9.0"), f"line {LINE}: 9 s"),
        (
            lambda t: "".join(t.splitlines(True)[: LINE - 1] + t.splitlines(True)[LINE:]),
            f"{LINE}: ",
        ),
        (lambda t: "".join(t.splitlines(True)[:2] + t.splitlines(True)[3:]), "line 3: 0.001 s"),
        (lambda t: edit(t, LINE, 2, "nan"), f"line {LINE}: joint_2_deg is 'nan'"),
        (lambda t: edit(t, LINE, 21, "fast"), f"line {LINE}: joint_7_deg_s2 is 'fast'"),
        (lambda t: edit(t, LINE, 4, "147.6"), f"line {LINE}: joint_4 at 147.6 deg; valid: ±147.3"),
        (lambda t: edit(t, LINE, 8, "50.5"), f"line {LINE}: joint_1 at 50.5 deg/s; valid: ±50"),
        (
            lambda t: edit(t, LINE, 1, f"{number(t, LINE - 1, 1) + 0.06}"),
            f"line {LINE}: joint_1 at 6",
        ),
        (lambda t: edit(t, LINE, 15, "300"), f"line {LINE}: joint_1 at 300 deg/s²; valid: ±297.94"),
        (lambda t: edit(t, LINE, 8, "-49"), f"line {LINE}: joint_1 at -"),
        (lambda t: edit(t, 3, 8, "2"), "line 3: joint_1 at 2 deg/s; valid: at rest"),
        (lambda t: t[: t.rindex(",")] + "\n", "21 values; valid: 22"),
        (lambda t: t.replace("# speed_limit_deg_s: 50\n", ""), "no '# speed_limit_deg_s"),
        (lambda t: t.replace("deg_s: 50", "deg_s: 500"), "line 1: speed_limit_deg_s is '500'"),
        (lambda t: t.replace("deg_s: 50", "deg_s: 20"), "valid: ±20 deg/s"),
        (lambda t: t.replace("joint_3_deg,", "joint_3_rad,"), "line 2: columns lack joint_3_deg"),
        (lambda t: "\n".join(t.splitlines()[:2]), "line 2: ends there"),
        (lambda t: "", "line 1: no '# speed"),
    ],
)
def test_what_the_arm_would_refuse_is_named_by_line(text, damage, told):
    damaged = damage(text)
    assert damaged != text
    with pytest.raises(ModelError) as error:
        require_precomputed_text(damaged, "p.csv", HOME)
    assert str(error.value).startswith("p.csv: line ")
    assert told in str(error.value)


def test_a_trajectory_from_elsewhere_than_the_arm_is_refused(text):
    require_precomputed_text(text, "p.csv", HOME + np.array([2 * np.pi, 0, 0, 0, 0, 0, 0]))
    with pytest.raises(
        ModelError, match=r"line 3: joint_2 at 14\.8\d* deg; valid: where the arm is"
    ):
        require_precomputed_text(text, "p.csv", HOME + 0.01 * np.eye(7)[1])


@pytest.mark.parametrize("content", [b"\xff\xfe\x00", None])
def test_a_file_that_cannot_be_read_is_named(tmp_path, content):
    if content is not None:
        (tmp_path / "p.csv").write_bytes(content)
    with pytest.raises(ModelError, match=r"p\.csv: "):
        require_precomputed(tmp_path / "p.csv")


@pytest.mark.parametrize("speed", [0.0, -1.0, np.nan, np.inf, "fast"])
def test_a_speed_limit_is_a_speed(speed):
    with pytest.raises(ModelError, match="speed_limit"):
        time_program(HOME, MAX_OPENING, PROGRAM, speed)


def test_a_program_that_jumps_is_refused():
    with pytest.raises(ModelError, match=r"program\[1\]: begins elsewhere"):
        time_program(HOME, MAX_OPENING, (PROGRAM[1], replace(PROGRAM[1])))


def test_our_own_limits_keep_the_margin_from_the_vendors():
    ours = np.degrees([np.inf, 2.24, np.inf, 2.57, np.inf, 2.09, np.inf])
    assert (ours <= POSITION_LIMITS - MARGIN).all()
    assert JOINT_SPEEDS.min() < 70.0
