import numpy as np
import pytest
from pydrake.common.value import Value
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem

from diagrams.action_executor import Execution
from diagrams.policy_controller import PolicyController, Verdict

LOST, GOAL, STUCK = 5, 3, 4
POLICY = np.array([0, 1, 2, 0, -1, -1])


class World(LeafSystem):
    """Four cells in a row: action a in cell s leads to ``jumps[s]`` after half a second."""

    def __init__(self, start, jumps, failure=""):
        super().__init__()
        self._jumps, self._failure = jumps, failure
        request = self.DeclareVectorInputPort("request", 2)
        # state, sequence, started, finished
        index = self.DeclareDiscreteState([start, 0.0, 0.0, 1.0])

        def update(context, values):
            state, sequence, started, finished = context.get_discrete_state(index).value()
            wanted = request.Eval(context)[0]
            now = context.get_time()
            if wanted != sequence:
                sequence, started, finished = wanted, now, 0.0
            elif not finished and now > started + 0.5:
                state, finished = (state if failure else jumps[int(state)]), 1.0
            values.set_value(index, [state, sequence, started, finished])

        def execution(context, output):
            _, sequence, started, finished = context.get_discrete_state(index).value()
            output.set_value(
                Execution(int(sequence), 0, started, bool(finished), failure if sequence else "")
            )

        self.DeclarePeriodicDiscreteUpdateEvent(0.01, 0.0, update)
        self.DeclareVectorOutputPort(
            "task.state",
            1,
            lambda c, out: out.SetFromVector(c.get_discrete_state(index).value()[:1]),
        )
        self.DeclareAbstractOutputPort(
            "execution", lambda: Value(Execution()), execution, {self.xd_ticket()}
        )


def episode(start, jumps, failure="", max_actions=6):
    builder = DiagramBuilder()
    world = builder.AddSystem(World(start, jumps, failure))
    controller = builder.AddSystem(
        PolicyController(
            POLICY, goal_states=np.array([GOAL]), lost_state=LOST, max_actions=max_actions
        )
    )
    builder.Connect(world.GetOutputPort("task.state"), controller.GetInputPort("task.state"))
    builder.Connect(world.GetOutputPort("execution"), controller.GetInputPort("execution"))
    builder.Connect(controller.GetOutputPort("request"), world.get_input_port())
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
        ({0: LOST}, "", Verdict.LOST, 1),
        ({0: STUCK}, "", Verdict.NO_ACTION, 1),
        ({0: 0}, "", Verdict.OUT_OF_ACTIONS, 6),
        ({0: 1}, "out of reach", Verdict.INFEASIBLE, 1),
    ],
)
def test_dead_ends_have_names(jumps, failure, verdict, steps):
    found = episode(0, jumps, failure)
    assert (found.verdict, len(found.steps)) == (verdict, steps)
    assert found.steps[-1].failure == failure
