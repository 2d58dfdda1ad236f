import time

import msgpack
import numpy as np
import pytest
from pydrake.geometry import Meshcat, MeshcatParams
from pydrake.math import RotationMatrix

from diagrams.execution.timeline import Timeline
from diagrams.state_view import FRAME, Preview, StateView
from experiments.kit.shipped_data import SHIPPED_TASK, load_planner
from irl.task_data import load_task
from models.errors import ModelError
from models.motion.failures import Infeasible
from models.scenes.planning_scene import HOME, PlanningScene
from models.task.spaces import (
    GOAL_STATE,
    LOST,
    N_FREE,
    POSITIONS,
    R_WG,
    R_WO,
    Action,
    Kind,
    State,
    decode_states,
    encode_states,
)

GRASPED = State(8, 0, 10).index  # from above, in the middle


@pytest.fixture(scope="module")
def model():
    return load_task(SHIPPED_TASK).model


@pytest.fixture(scope="module")
def planner():
    return load_planner()


@pytest.fixture(scope="module")
def meshcat():
    return Meshcat(MeshcatParams(host="localhost", show_stats_plot=False))


@pytest.fixture(scope="module")
def view(meshcat, planner, model):
    def outcomes(state, action):
        row = int(np.flatnonzero((model.pair_state == state) & (model.pair_action == action))[0])
        after = model.P[[row]].tocoo()
        order = np.argsort(-after.data)
        return [(int(after.col[i]), float(after.data[i])) for i in order]

    return StateView(meshcat, planner, outcomes)


def some_pairs(model, kind, count):
    rng = np.random.default_rng(int(kind))
    of_kind = np.flatnonzero(model.pair_action // 18 == int(kind))
    for row in rng.choice(of_kind, count, replace=False):
        yield int(model.pair_state[row]), int(model.pair_action[row])


def test_a_free_cube_lies_in_its_column_before_an_arm_at_home(view):
    posture = view.posture(State(4, 8).index)
    np.testing.assert_allclose(posture.q, HOME)
    np.testing.assert_allclose(posture.X_WO.translation(), [0.5, 0.1, 0.52])
    np.testing.assert_allclose(posture.X_WO.rotation().matrix(), R_WO[8], atol=1e-12)


def test_a_held_cube_is_between_the_pads_of_an_arm_that_reaches_it(view, model):
    scene = PlanningScene()
    held = model.acting[model.acting >= N_FREE]
    for state in np.random.default_rng(0).choice(held, 40, replace=False):
        _, orientation, hand = (int(x) for x in decode_states(state))
        posture = view.posture(int(state))
        X_WG = scene.forward(posture.q)
        np.testing.assert_allclose(X_WG.rotation().matrix(), R_WG[hand], atol=2e-3)
        offset = X_WG.inverse() @ posture.X_WO.translation()
        assert abs(offset[1]) < 1e-3  # in the middle between the pads
        assert -1e-3 < offset[2] < 6e-3  # as far before the hand as it is grasped
        np.testing.assert_allclose(posture.X_WO.rotation().matrix(), R_WO[orientation], atol=1e-12)


@pytest.mark.parametrize("kind", Kind)
def test_a_preview_is_the_planners_motion_at_twice_the_speed(view, planner, model, kind):
    for state, action in some_pairs(model, kind, 6):
        preview, start = view.preview(state, action), view.posture(state)
        parts = State.from_index(state)
        plan = planner.plan(
            Action.from_index(action),
            parts.position,
            parts.gripper,
            start.q,
            start.width,
            start.X_WO,
        )
        timeline = Timeline(start.q, start.width, plan, planner.velocity_limit)
        assert preview.duration == pytest.approx(timeline.duration / 2, abs=FRAME)
        np.testing.assert_allclose(preview.at(1.0).q, timeline.arm(2.0), atol=1e-9)
        np.testing.assert_allclose(preview.at(1e9).q, timeline.arm(timeline.duration), atol=1e-9)


def test_a_preview_costs_little_of_the_processor(view, model):
    pairs = [pair for kind in Kind for pair in some_pairs(model, kind, 6)]
    view.pose(view.preview(*pairs[0]).at(0.0))  # the planner compiles at first
    spent = []
    for state, action in pairs:
        began = time.process_time()
        preview = view.preview(state, action)
        view.pose(preview.at(0.0))
        spent.append(time.process_time() - began)
    assert np.median(spent) <= 0.1


@pytest.mark.parametrize("kind", Kind)
def test_the_cube_ends_where_the_likeliest_outcome_has_it_and_never_jumps(view, model, kind):
    certain = 0
    for state, action in some_pairs(model, kind, 8):
        preview = view.preview(state, action)
        p = np.array([posture.X_WO.translation() for posture in preview.postures])
        assert np.linalg.norm(np.diff(p, axis=0), axis=1).max() < 0.1
        np.testing.assert_allclose(p[0], view.posture(state).X_WO.translation(), atol=1e-9)
        after, probability = preview.outcomes[0]
        if after == LOST or (kind != Kind.DROP and probability < 0.9):
            continue
        certain += 1
        end = view.posture(after)
        last = preview.postures[-1]
        np.testing.assert_allclose(p[-1], end.X_WO.translation(), atol=5.1e-3)
        turn = RotationMatrix(last.X_WO.rotation().inverse() @ end.X_WO.rotation())
        assert np.degrees(turn.ToAngleAxis().angle()) < 50  # halfway between two names
    assert certain > 2


def test_only_the_fingers_move_while_a_hand_lets_go(view):
    preview = view.preview(GRASPED, Action(Kind.DROP).index)
    assert preview.postures[0].width < 0.06 < preview.postures[-1].width
    widths = np.array([posture.width for posture in preview.postures])
    assert np.abs(np.diff(widths)).max() < 0.01


def test_a_toss_up_says_its_odds_and_nothing_else_does():
    assert Preview(0, 0, ((5, 0.588), (6, 0.412)), ()).odds == "59 % / 41 %"
    assert Preview(0, 0, ((5, 0.6), (6, 0.39), (7, 0.01)), ()).odds == "60 % / 39 %"
    assert Preview(0, 0, ((5, 0.99), (6, 0.01)), ()).odds == ""
    assert Preview(0, 0, (), ()).odds == ""


def test_what_cannot_be_done_says_why(view):
    with pytest.raises(Infeasible, match="not held"):
        view.preview(GOAL_STATE, Action(Kind.DROP).index)
    with pytest.raises(Infeasible, match="held already"):
        view.preview(GRASPED, Action(Kind.GRASP, 3).index)
    with pytest.raises(Infeasible, match="lost"):
        view.preview(LOST, 0)
    unreachable = next(
        int(s)
        for s in encode_states(np.arange(18)[:, None], 0, np.arange(18)).ravel()
        if view._planner.posture(*(int(x) for x in decode_states(s)[::2])) is None
    )
    with pytest.raises(ModelError, match="out of reach"):
        view.show(unreachable)


def test_what_is_shown_is_in_the_view(view, meshcat):
    view.show(GRASPED)
    view.ghosts([GOAL_STATE, LOST, GOAL_STATE])
    for path in ("arm", "gripper", "cube", "table", "ghost_0", "ghost_1"):
        assert meshcat.HasPath(f"/drake/visualizer/{path}")
    for name, p_WO in (
        ("cube", POSITIONS[8]),
        ("ghost_0", [0.5, 0, 0.52]),
        ("ghost_1", [0, 0, -5]),
    ):
        packed = meshcat._GetPackedTransform(f"/drake/visualizer/{name}/cube")
        matrix = msgpack.unpackb(packed)["matrix"]
        np.testing.assert_allclose(matrix[12:15], p_WO, atol=1e-9)
