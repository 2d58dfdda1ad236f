from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from pydrake.geometry import Role

from diagrams.trials.floating import run_trial
from diagrams.trials.record import Pair, TrialConfig
from diagrams.trials.rig import TrialRig
from experiments.bench import trials
from experiments.bench.comparison import Peers
from experiments.bench.grasp_engines import (
    Ends,
    Grasp,
    in_drake,
    in_mujoco,
    touch_with_pads_alone,
)
from experiments.bench.trials import agreement, find_boundary
from experiments.kit.shipped_data import load_feasibility
from models.task.spaces import (
    CUBE_EDGE,
    R_WG,
    R_WO,
    REST_HEIGHT,
    TILTED,
    Action,
    Kind,
    State,
    decode_actions,
)

QUIET = TrialConfig(position_sd=0.0, yaw_sd=0.0, tilt_sd=0.0, friction=(0.8, 0.8), mass=(0.1, 0.1))


def ends(heights, orientations):
    """As if cubes had ended so high above the table, so oriented."""
    n = len(heights)
    p_WO = np.column_stack([np.zeros((n, 2)), REST_HEIGHT + np.array(heights)])
    width, force = np.full(n, CUBE_EDGE), np.full(n, 40.0)
    return Ends(p_WO, R_WO[list(orientations)], width, force, np.full(n, 0.5))


def test_the_sample_is_feasible_and_has_as_many_of_each_kind():
    pairs = trials.draw_sample(3)
    assert pairs == trials.draw_sample(3) != trials.draw_sample(4)
    mask = load_feasibility().mask()
    assert all(mask[pair.state, pair.action] for pair in pairs)
    kinds = Counter(int(decode_actions(pair.action).kind) for pair in pairs)
    assert kinds == dict.fromkeys(map(int, Kind), trials.SAMPLE // len(Kind))


@pytest.mark.parametrize("hand", [*TILTED, 10, 13])
def test_an_offset_is_along_the_pads_width_and_never_towards_the_table(hand):
    shift = replace(Grasp(hand), offset=0.02).p_WG - Grasp(hand).p_WG
    np.testing.assert_allclose(R_WG[hand].T @ shift, [-0.02, 0.0, 0.0], atol=1e-12)
    assert shift[2] > -1e-9


def test_a_cube_that_rose_with_the_hand_was_lifted():
    assert ends([0.0, 0.01, 0.02, 0.03], [0] * 4).lifted.tolist() == [False, False, True, True]


def test_agreement_counts_each_question_and_names_who_differs():
    grasps = [Grasp(10), Grasp(10, 45.0), Grasp(11), Grasp(5)]
    ours = ends([0.03, 0.03, 0.0, 0.03], [0, 1, 0, 8])
    theirs = ends([0.03, 0.03, 0.03, 0.029], [0, 2, 0, 0])
    told = agreement(grasps, ours, theirs)
    assert told["same"] == {"lifted": 3, "face": 3, "orientation": 2}
    assert told["lifted_by_both"] == 3
    assert told["largest_distance_mm"] == pytest.approx(1.0)
    assert told["largest_angle_deg"] == pytest.approx(90.0)
    named = [(d["gripper"], d["cube_yaw_deg"]) for d in told["disagreements"]]
    assert named == [(10, 45), (11, 0), (5, 0)]
    assert told["disagreements"][1]["ours"]["lifted"] is False


def test_bisection_finds_where_each_grasp_starts_to_fail():
    threshold = {10: 0.0123, 5: 0.0391}

    def engine(grasps):
        return ends([0.03 * (g.offset < threshold[g.gripper]) for g in grasps], [0] * len(grasps))

    found, cpu_s = find_boundary(engine, [Grasp(10), Grasp(5)])
    resolution = trials.LARGEST_OFFSET / 2**trials.HALVINGS
    np.testing.assert_allclose(found, list(threshold.values()), atol=resolution / 2 + 1e-12)
    assert cpu_s == 0.5


def test_our_grasp_is_a_trial_without_noise():
    rig, grasp = TrialRig(QUIET), Grasp(10)
    pair = Pair(State(8, 0).index, Action(Kind.GRASP, grasp.gripper).index)
    record = run_trial(rig, QUIET, pair, 0)
    end = in_drake(rig, [grasp])
    np.testing.assert_allclose(end.p_WO[0] - grasp.p_WO, record.displacement, atol=1e-6)
    assert end.lifted[0] and end.orientation[0] == 0
    assert end.pad_force[0] == pytest.approx(40.0, rel=0.02)


def test_with_pads_alone_only_they_and_the_table_meet_the_cube():
    rig = TrialRig(QUIET)
    touch_with_pads_alone(rig)
    inspector = rig.scene_graph.model_inspector()
    (cube,) = inspector.GetGeometries(
        rig.plant.GetBodyFrameIdOrThrow(rig.cube.index()), Role.kProximity
    )
    touch = {
        inspector.GetName(shape).split("::")[-1]
        for shape in (*rig.hand_shapes, *rig.table_shapes)
        if not inspector.CollisionFiltered(cube, shape)
    }
    assert touch == {"left_pad", "right_pad", "table"}


def test_overlap_ends_half_a_pad_beyond_the_cube():
    assert Grasp(10).overlap_limit == pytest.approx(0.031)
    assert Grasp(5).overlap_limit == pytest.approx(0.02 * np.sqrt(2.0) + 0.011)


def test_yaw_is_read_about_the_vertical():
    turned = ends([0.03, 0.03], [0, 2])
    np.testing.assert_allclose(turned.yaw, [0.0, 90.0], atol=1e-9)


@pytest.mark.skipif(not Peers().python.exists(), reason="the peers' environment is not built")
@pytest.mark.parametrize("pads_alone", [False, True], ids=["whole gripper", "pads alone"])
def test_mujoco_lifts_a_cube_between_the_pads_and_none_beside_them(pads_alone):
    beside = Grasp(5, offset=trials.LARGEST_OFFSET)
    grasps = [Grasp(10), Grasp(5), Grasp(10, friction=0.01), beside]
    end = in_mujoco(Peers(), grasps, pads_alone=pads_alone)
    assert end.lifted.tolist() == [True, True, False, False]
    np.testing.assert_allclose(end.pad_force[:2], 40.0, rtol=0.02)
    np.testing.assert_allclose(end.opening[:2], CUBE_EDGE, atol=1.5e-3)
    np.testing.assert_allclose(end.p_WO[3], beside.p_WO, atol=1e-3)
    assert (end.cpu_s > 0).all()
