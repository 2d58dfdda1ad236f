"""The same swings by the whole arm."""

import numpy as np
import pytest

from diagrams.station import TIME_STEP
from experiments.hold.arm import SwingingArm, compare, record
from experiments.hold.cases import Case
from experiments.hold.rig import Load


def test_the_arms_hand_holds_as_the_hand_on_slides_with_its_step_and_with_half_of_it():
    row = compare(Case("sideways-across", 1.0, Load(0.5, 0.5, 40.0)), 0.002)
    assert row["limited_samples"] == [0, 0]
    assert row["slides_slip_mm"] < 0.1
    for name in ("displacement_mm", "halved_displacement_mm"):
        assert row[name] == pytest.approx(row["slides_slip_mm"], abs=0.05)


def test_a_swing_that_the_arms_torque_does_not_suffice_for_is_waited_for():
    """Stretched out level, half a kilogram in the hand, joint 2 cannot go up as fast as allowed."""
    case = Case("up-down-across", 1.0, Load(0.5, 0.5, 40.0))
    way, limited = SwingingArm(40.0, TIME_STEP).swing(case.motion, case.load)
    assert limited > 100
    assert np.linalg.norm(way[-1]) < 1e-4


def test_a_recording_shows_the_cube(tmp_path):
    ticks = []
    page = tmp_path / "recording.html"
    record([Case("up-down-across", 0.3, Load(0.1, 0.9, 40.0))], page, lambda: ticks.append(1))
    assert len(ticks) == 1
    assert "cube" in page.read_text(encoding="utf-8")
