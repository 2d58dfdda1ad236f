import numpy as np
import pytest
from pydrake.common.value import AbstractValue, Value
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem
from pydrake.systems.primitives import ConstantVectorSource

from diagrams.action_executor import Execution
from diagrams.decisions import By, Choice, Correctable, Table
from diagrams.policy_controller import PolicyController, Verdict
from models.motion.failures import ActionFailure
from models.task import spaces
from models.task.discretise import nearest_column

LOST, GOAL, STUCK = 5, 3, 4
POLICY = np.array([0, 1, 2, 0, -1, -1])
DROP = spaces.Action(spaces.Kind.DROP).index


class World(LeafSystem):
    """Four cells in a row: action a in cell s leads to ``jumps[s]`` after half a second.

    For ``away`` seconds more the cube seems to be nowhere.
    """

    def __init__(self, start, jumps, failure=None, away=0.0):
        super().__init__()
        self._jumps, self._failure = jumps, failure
        request = self.DeclareVectorInputPort("request", 2)
        # state, sequence, started, finished
        index = self.DeclareDiscreteState([start, 0.0, 0.0, 1.0])

        def update(context, values):
            state, sequence, started, finished = context.get_discrete_state(index).value()
            wanted, _ = request.Eval(context)
            now = context.get_time()
            if wanted != sequence:
                sequence, started, finished = wanted, now, 0.0
            elif not finished and now > started + 0.5:
                state, finished = (state if failure else jumps[int(state)]), 1.0
            values.set_value(index, [state, sequence, started, finished])

        def execution(context, output):
            _, sequence, started, finished = context.get_discrete_state(index).value()
            output.set_value(
                Execution(int(sequence), 0, started, bool(finished), failure if sequence else None)
            )

        self.DeclarePeriodicDiscreteUpdateEvent(0.01, 0.0, update)

        def task_state(context, output):
            state, sequence, started, finished = context.get_discrete_state(index).value()
            flies = sequence and finished and context.get_time() < started + 0.5 + away
            output[0] = LOST if flies else state

        self.DeclareVectorOutputPort("task.state", 1, task_state)
        self.DeclareAbstractOutputPort(
            "execution", lambda: Value(Execution()), execution, {self.xd_ticket()}
        )


def episode(start, jumps, failure=None, max_actions=6, decision=None, told=None, away=0.0):
    builder = DiagramBuilder()
    world = builder.AddSystem(World(start, jumps, failure, away))
    controller = builder.AddSystem(
        PolicyController(
            decision or Table(POLICY),
            goal_states=np.array([GOAL]),
            lost_state=LOST,
            max_actions=max_actions,
        )
    )
    builder.Connect(world.GetOutputPort("task.state"), controller.GetInputPort("task.state"))
    builder.Connect(world.GetOutputPort("execution"), controller.GetInputPort("execution"))
    builder.Connect(controller.GetOutputPort("request"), world.get_input_port())
    if told is not None:
        source = builder.AddSystem(ConstantVectorSource([told]))
        builder.Connect(source.get_output_port(), controller.GetInputPort("told"))
    diagram = builder.Build()
    simulator = Simulator(diagram)
    simulator.AdvanceTo(12.0)
    return controller.episode(controller.GetMyContextFromRoot(simulator.get_context()))


def test_follows_the_policy_from_state_to_state_until_the_goal():
    found = episode(0, {0: 1, 1: 2, 2: 3})
    assert found.verdict == Verdict.GOAL
    assert [(s.state, s.next_state) for s in found.steps] == [(0, 1), (1, 2), (2, 3)]
    times = [(s.started, s.ended) for s in found.steps]
    assert all(end - start >= 0.9 for start, end in times)


def test_a_start_at_the_goal_needs_nothing():
    assert episode(GOAL, {}).steps == ()


@pytest.mark.parametrize(
    ("jumps", "failure", "verdict", "steps"),
    [
        ({0: LOST}, None, Verdict.LOST, 1),
        ({0: STUCK}, None, Verdict.NO_ACTION, 1),
        ({0: 0}, None, Verdict.OUT_OF_ACTIONS, 6),
        ({0: 1}, ActionFailure.OUT_OF_REACH, Verdict.INFEASIBLE, 1),
    ],
)
def test_dead_ends_have_names(jumps, failure, verdict, steps):
    found = episode(0, jumps, failure)
    assert (found.verdict, len(found.steps)) == (verdict, steps)
    assert found.steps[-1].failure == failure


@pytest.mark.parametrize(
    ("away", "verdict"), [(0.7, Verdict.GOAL), (2.2, Verdict.GOAL), (3.0, Verdict.LOST)]
)
def test_a_cube_in_the_air_is_waited_for(away, verdict):
    found = episode(0, {0: GOAL}, away=away)
    assert found.verdict == verdict
    assert found.steps[0].ended - found.steps[0].started > min(away, 2.5) + 0.4


def test_steps_tell_what_chose_them_and_a_person_overrules_the_table():
    jumps = {0: 1, 1: 2, 2: GOAL}
    assert {step.chosen_by for step in episode(0, jumps).steps} == {By.POLICY}
    asked = episode(0, jumps, decision=Correctable(Table(POLICY)), told=2.0)
    assert {step.chosen_by for step in asked.steps} == {By.PERSON}
    nobody = episode(0, jumps, decision=Correctable(Table(POLICY)), told=-1.0)
    assert {step.chosen_by for step in nobody.steps} == {By.POLICY}
    # The table alone does not listen.
    assert {step.chosen_by for step in episode(0, jumps, told=2.0).steps} == {By.POLICY}


class Beside:
    """Calls what is lost by the name of the goal it is near to."""

    goes_by_poses = False

    def state(self, sight):
        return GOAL if sight.state == LOST else sight.state

    def choose(self, sight, steps):
        return Choice(2, By.FORECAST)


def test_what_only_has_the_goals_name_is_yet_to_be_placed():
    found = episode(0, {0: LOST, LOST: GOAL}, decision=Beside())
    assert found.verdict == Verdict.GOAL
    assert [(s.state, s.next_state) for s in found.steps] == [(0, GOAL), (GOAL, GOAL)]


class Second:
    """Has another action wherever one could not be carried out, until all have failed."""

    goes_by_poses = False

    def state(self, sight):
        return sight.state

    def choose(self, sight, steps):
        return Choice(len(steps), By.UNTRIED) if len(steps) < 3 else None


def test_a_decision_may_go_on_after_an_action_that_could_not_be_carried_out():
    found = episode(0, {0: 0}, ActionFailure.OUT_OF_REACH, decision=Second())
    assert (found.verdict, len(found.steps)) == (Verdict.INFEASIBLE, 3)


def test_what_could_not_even_be_planned_does_not_count_as_an_action():
    """The third action in a row, where one is allowed."""
    found = episode(0, {0: 0}, ActionFailure.NO_ROOM, max_actions=1, decision=Second())
    assert (found.verdict, len(found.steps)) == (Verdict.INFEASIBLE, 3)
    ended = episode(0, {0: 0}, ActionFailure.GRIP_LOST, max_actions=1, decision=Second())
    assert (ended.verdict, len(ended.steps)) == (Verdict.OUT_OF_ACTIONS, 1)


class Hand(LeafSystem):
    """A hand over the table's middle, and a cube that is raised beside it until it opens.

    Args:
        beside: how far off the cube is [m].
        falls: whether it then falls to the table.
        leans: for how long the cube is askew [s].
        noise: standard deviation of its measured place along x [m].
    """

    def __init__(self, beside, falls, leans=0.0, noise=0.0):
        super().__init__()
        self.raised, self.state = 0.012, spaces.LOST
        request = self.DeclareVectorInputPort("request", 2)
        asked = self.DeclareDiscreteState([0.0, -1.0])
        self.DeclarePeriodicDiscreteUpdateEvent(
            0.01, 0.0, lambda context, values: values.set_value(asked, request.Eval(context))
        )

        def cube(context, output):
            opened = context.get_discrete_state(asked).value()[0] > 0
            raised = 0.0 if opened and falls else self.raised
            rng = np.random.default_rng(round(10 * context.get_time()))
            x = 0.55 + beside + rng.normal(0.0, noise)
            p_WO = [x, 0.0, spaces.REST_HEIGHT + raised]
            tilt = 0.1 if context.get_time() < leans else 0.0
            output.set_value(RigidTransform(RotationMatrix.MakeXRotation(tilt), p_WO))

        def hand(_, output):
            R_WG = spaces.R_WG[spaces.VERTICAL[0]]
            output.set_value(RigidTransform(RotationMatrix(R_WG), [0.55, 0.0, 0.54]))

        def execution(context, output):
            sequence, action = context.get_discrete_state(asked).value()
            output.set_value(Execution(int(sequence), int(action)))

        for name, calc in (("object.pose", cube), ("tcp.pose", hand)):
            self.DeclareAbstractOutputPort(name, lambda: AbstractValue.Make(RigidTransform()), calc)
        self.DeclareAbstractOutputPort("execution", lambda: Value(Execution()), execution)
        self.DeclareVectorOutputPort(
            "task.state", 1, lambda _, output: output.SetFromVector([self.state])
        )


class Lying:
    """Knows a cube that lies on the table, and wants nothing."""

    goes_by_poses = True

    def state(self, sight):
        return spaces.LOST if nearest_column(sight.X_WO.translation()) < 0 else sight.state

    def choose(self, sight, steps):
        return None


def beside_a_hand(hand, goals):
    """What a controller made of it after a while."""
    builder = DiagramBuilder()
    hand = builder.AddSystem(hand)
    controller = builder.AddSystem(
        PolicyController(Lying(), goal_states=np.array(goals), lost_state=spaces.LOST)
    )
    for name in ("task.state", "object.pose", "tcp.pose", "execution"):
        builder.Connect(hand.GetOutputPort(name), controller.GetInputPort(name))
    builder.Connect(controller.GetOutputPort("request"), hand.get_input_port())
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(8.0)
    return controller.episode(controller.GetMyContextFromRoot(simulator.get_context()))


@pytest.mark.parametrize(
    ("beside", "falls", "verdict", "steps"),
    [
        (0.03, True, Verdict.NO_ACTION, 1),
        (0.03, False, Verdict.LOST, 1),
        (0.08, False, Verdict.LOST, 0),
    ],
)
def test_fingers_let_go_once_of_a_cube_that_may_be_clamped(beside, falls, verdict, steps):
    found = beside_a_hand(Hand(beside, falls), [])
    assert (found.verdict, len(found.steps)) == (verdict, steps)
    for step in found.steps:
        held = spaces.State.from_index(step.state)
        assert (step.action, step.chosen_by) == (DROP, By.RELEASE)
        assert held.gripper == spaces.VERTICAL[0]


@pytest.mark.parametrize(
    ("leans", "verdict"), [(0.0, Verdict.GOAL), (1.2, Verdict.GOAL), (9.0, Verdict.NO_ACTION)]
)
def test_a_cube_that_leans_is_at_no_goal_until_it_lies(leans, verdict):
    below = Hand(0.0, True, leans)
    below.raised = 0.0
    middle = int(nearest_column(np.array([0.55, 0.0, spaces.REST_HEIGHT])))
    assert beside_a_hand(below, [spaces.State(middle, 0).index]).verdict == verdict


def test_a_cube_that_is_to_be_held_may_be_askew():
    askew = Hand(0.0, True, leans=9.0)
    middle = int(nearest_column(np.array([0.55, 0.0, spaces.REST_HEIGHT])))
    held = spaces.State(middle, 0, spaces.VERTICAL[0])
    askew.raised, askew.state = 0.0, held.index
    assert beside_a_hand(askew, [held.index]).verdict == Verdict.GOAL


@pytest.mark.parametrize(
    ("beside", "noise", "verdict"),
    [
        (0.0, 0.003, Verdict.GOAL),
        (0.0245, 0.0, Verdict.GOAL),
        # Half a millimetre from the cell's edge, and seen to within 3: it may be beyond.
        (0.0245, 0.003, Verdict.NO_ACTION),
    ],
)
def test_a_cube_has_arrived_where_its_measured_poses_leave_no_doubt(beside, noise, verdict):
    below = Hand(beside, True, noise=noise)
    below.raised = 0.0
    middle = int(nearest_column(np.array([0.55, 0.0, spaces.REST_HEIGHT])))
    assert beside_a_hand(below, [spaces.State(middle, 0).index]).verdict == verdict
