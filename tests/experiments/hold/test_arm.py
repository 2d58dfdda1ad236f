"""The same swings by the whole arm."""

import pytest

from experiments.hold.arm import compare, record
from experiments.hold.cases import Case
from experiments.hold.rig import Load


def test_the_arms_hand_holds_as_the_hand_on_slides_but_for_what_its_step_adds():
    row = compare(Case("up-down-across", 1.0, Load(0.5, 0.5, 40.0)), 0.002)
    assert row["limited_samples"] == [0, 0]
    # The step's own share halves with the step; without it there is no slip worth the name.
    ratio = row["halved_displacement_mm"] / row["displacement_mm"]
    assert ratio == pytest.approx(0.5, abs=0.05)
    assert row["without_step_mm"] < 0.1
    assert row["slides_slip_mm"] < 0.1


def test_a_recording_shows_the_cube(tmp_path):
    ticks = []
    page = tmp_path / "recording.html"
    record([Case("up-down-across", 0.3, Load(0.1, 0.9, 40.0))], page, lambda: ticks.append(1))
    assert len(ticks) == 1
    assert "cube" in page.read_text(encoding="utf-8")
