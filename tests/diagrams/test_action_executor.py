import numpy as np
import pytest
from pydrake.common.value import AbstractValue
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator

from diagrams.action_executor import ActionExecutor
from diagrams.execution.timeline import Timeline
from models.errors import ModelError
from models.motion.failures import ActionFailure, Infeasible
from models.motion.moves import Grip, Move
from models.scenes.planning_scene import HOME
from models.task.spaces import Action, Kind, State

LIMIT = np.ones(7)
ASIDE = HOME + 0.1
DROP = Action(Kind.DROP).index


class Planner:
    """Moves aside and opens, whatever is asked; cannot translate."""

    velocity_limit = LIMIT

    def __init__(self):
        self.asked = []

    def plan(self, action, position, gripper, q, width, X_WO):
        self.asked.append((action.index, position, gripper, q.copy(), width))
        if action.kind == Kind.TRANSLATE:
            raise Infeasible(ActionFailure.OUT_OF_REACH, "too far")
        return (Move(np.array([q, ASIDE])), Grip(0.05, 0.5))


HELD = State(3, 0, 10)


def rig(state=HELD):
    planner = Planner()
    executor = ActionExecutor(planner, width=0.0)
    simulator = Simulator(executor)
    context = simulator.get_mutable_context()
    executor.GetInputPort("task.state").FixValue(context, [state.index])
    executor.GetInputPort("object.pose").FixValue(context, AbstractValue.Make(RigidTransform()))
    executor.GetInputPort("request").FixValue(context, [0, -1])
    return planner, executor, simulator, context


def read(executor, context, name):
    return executor.GetOutputPort(name).Eval(context)


def test_a_timeline_plays_its_parts_in_order_and_ends_at_rest():
    timeline = Timeline(HOME, 0.085, (Grip(0.0, 1.0), Move(np.array([HOME, ASIDE]))), LIMIT)
    assert timeline.width(0.5) == 0.0
    assert timeline.arm(0.5) == pytest.approx(HOME)
    assert timeline.arm(1.0) == pytest.approx(HOME)
    middle = timeline.arm((1.0 + timeline.duration) / 2)
    assert middle == pytest.approx((HOME + ASIDE) / 2, abs=1e-6)
    assert timeline.arm(timeline.duration + 5.0) == pytest.approx(ASIDE)
    steps = np.array([timeline.arm(t) for t in np.linspace(1.0, timeline.duration, 200)])
    speed = np.abs(np.diff(steps, axis=0)).max() / ((timeline.duration - 1.0) / 199)
    assert speed <= LIMIT[0]


def test_nothing_moves_before_the_first_request():
    planner, executor, simulator, context = rig()
    simulator.AdvanceTo(0.1)
    assert planner.asked == []
    assert read(executor, context, "arm.position_command") == pytest.approx(HOME)
    assert read(executor, context, "execution").finished


def test_a_request_is_planned_once_from_where_the_robot_is_and_played_to_its_end():
    planner, executor, simulator, context = rig()
    executor.GetInputPort("request").FixValue(context, [1, DROP])
    simulator.AdvanceTo(0.1)
    assert not read(executor, context, "execution").finished
    simulator.AdvanceTo(5.0)
    ((action, position, gripper, q, width),) = planner.asked
    assert (action, position, gripper, width) == (DROP, 3, 10, 0.0)
    assert q == pytest.approx(HOME)
    execution = read(executor, context, "execution")
    assert (execution.sequence, execution.finished, execution.failure) == (1, True, None)
    assert read(executor, context, "arm.position_command") == pytest.approx(ASIDE)
    assert read(executor, context, "gripper.position_command") == pytest.approx([0.05])
    executor.GetInputPort("request").FixValue(context, [2, DROP])
    simulator.AdvanceTo(5.1)
    assert planner.asked[1][3] == pytest.approx(ASIDE)
    assert planner.asked[1][4] == 0.05


def test_what_cannot_be_planned_moves_nothing_and_says_why():
    _, executor, simulator, context = rig()
    executor.GetInputPort("request").FixValue(context, [1, Action(Kind.TRANSLATE, 0).index])
    simulator.AdvanceTo(0.5)
    execution = read(executor, context, "execution")
    assert (execution.finished, execution.failure) == (True, ActionFailure.OUT_OF_REACH)
    assert execution.reason == "too far"
    assert read(executor, context, "arm.position_command") == pytest.approx(HOME)


def test_a_free_cube_has_no_gripper():
    planner, executor, simulator, context = rig(State(2, 0))
    executor.GetInputPort("request").FixValue(context, [1, 10])
    simulator.AdvanceTo(0.1)
    assert planner.asked[0][:3] == (10, 2, None)


@pytest.mark.parametrize(
    ("request_", "message"),
    [
        ([0, DROP], r"sequence 0; valid: from 1 on, or \[0, -1\]"),
        ([-1, DROP], "sequence -1; valid: from 1 on"),
        ([1, 3.7], "valid: whole numbers"),
        ([1.5, DROP], "valid: whole numbers"),
        ([1, np.nan], "valid: whole numbers"),
        ([1, 99], "action index"),
        ([1, -1], "action index"),
    ],
)
def test_a_request_that_is_none_is_refused(request_, message):
    _, executor, simulator, context = rig()
    executor.GetInputPort("request").FixValue(context, request_)
    with pytest.raises(ModelError, match=message):
        simulator.AdvanceTo(0.1)


@pytest.mark.parametrize("when", [0.1, 5.0])
def test_another_action_needs_a_number_of_its_own_while_one_is_under_way_and_after(when):
    _, executor, simulator, context = rig()
    executor.GetInputPort("request").FixValue(context, [3, DROP])
    simulator.AdvanceTo(when)
    executor.GetInputPort("request").FixValue(context, [3, 0])
    with pytest.raises(ModelError, match=f"sequence 3 was action {DROP}; valid: a new number"):
        simulator.AdvanceTo(when + 0.1)


@pytest.mark.parametrize("start", [{"q": HOME[:6]}, {"q": HOME * np.nan}, {"width": np.nan}])
def test_a_start_that_is_none_is_refused(start):
    with pytest.raises(ModelError, match=r"q|width"):
        ActionExecutor(Planner(), **start)
    executor = ActionExecutor(Planner())
    with pytest.raises(ModelError, match=r"q|width"):
        executor.start_at(executor.CreateDefaultContext(), **{"q": HOME, "width": 0.0, **start})


def test_going_home_at_home_is_played():
    """The rest of a motion, a rounding long, is a motion."""
    timeline = Timeline(HOME, 0.085, (Move(np.array([HOME, HOME + 1e-12])),), LIMIT)
    assert 0.0 < timeline.duration < 0.02
    np.testing.assert_allclose(timeline.arm(timeline.duration), HOME, atol=1e-11)
