"""A cube that is let go turned falls to the nearer face; the course is told as it was."""

import numpy as np
import pytest

from diagrams.trials.record import Outcome, Pair, TrialConfig, TrialRecord
from experiments.kit.command import Output
from experiments.kit.executors import Workers, start_workers
from experiments.kit.kept_rows import KeptRows
from experiments.transitions.trust.releases import ENDS, HAND, plot_sweep, run_sweep, summary
from irl.errors import InputError
from models.task.spaces import GRID_Z, R_WG, Action, Kind, State

PAIR = Pair(State(8, 0, HAND).index, Action(Kind.DROP).index)


def record(turn_deg, drift=0.0):
    turn = np.radians(turn_deg) * R_WG[HAND][:, 1]
    return TrialRecord(Outcome.FREE, turn=tuple(turn.tolist()), drift=drift)


def test_ends_are_counted_by_the_face_and_faults_left_out():
    fault = TrialRecord(Outcome.FAULT)
    told = summary(PAIR, [record(2), record(88), record(91, 0.01), record(-90), fault])
    assert (told["back"], told["over"], told["elsewhere"]) == (1, 2, 1)
    assert (told["trials"], told["faults"]) == (4, 1)
    assert told["over_interval"][0] < 0.5 < told["over_interval"][1]
    assert told["drift_max_m"] == 0.01
    assert summary(PAIR, [fault])["trials"] == 0


QUIET = TrialConfig(position_sd=0.0, yaw_sd=0.0, tilt_sd=0.0)
ANGLES = (15.0, 75.0)


@pytest.fixture(scope="module")
def output(tmp_path_factory):
    return Output(tmp_path_factory.mktemp("releases"), None)


@pytest.fixture(scope="module")
def swept(output):
    with start_workers(1) as workers:
        return run_sweep(QUIET, ANGLES, 1, 0, workers, KeptRows(output, {}))


def test_a_tilted_cube_falls_to_the_nearer_face(swept, tmp_path):
    ends = {(row["height_m"], row["angle_deg"]): row for row in swept}
    assert len(ends) == 4
    for (height, angle), row in ends.items():
        onto = {end: row[end] for end in ENDS}
        assert sum(onto.values()) == row["trials"] == 1, onto
        if height == GRID_Z[0]:  # from the upper layer it may tumble on
            assert onto["back" if angle < 45 else "over"] == 1
    with Output(tmp_path, None).figure("r.png") as figure:
        plot_sweep(figure, swept)
    assert (tmp_path / "r.png").stat().st_size > 10_000


def test_points_that_were_kept_are_not_tried_again(swept, output):
    kept = KeptRows(output, {})
    assert kept.rows == swept
    nobody = Workers(None, lambda: 0)
    assert run_sweep(QUIET, ANGLES, 1, 0, nobody, kept) == swept
    with pytest.raises(InputError, match=r"measured\.json: .* angles \(nothing there, 3 here\)"):
        KeptRows(output, {"angles": 3})
    kept.forget()
    assert KeptRows(output, {"angles": 3}).rows == []
