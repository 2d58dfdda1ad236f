"""Decisions of the policy that ``demo --seed 0`` left before there were forecasts."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pydrake.math import RigidTransform, RotationMatrix

from diagrams.decisions import (
    By,
    Choice,
    Correctable,
    Forecast,
    Sight,
    Step,
    Table,
    held_goal,
)
from diagrams.policy_controller import Verdict
from experiments.kit.robot_task import load_robot_task
from experiments.kit.shipped_data import SHIPPED_TASK
from experiments.simulate.episodes import draw_starts
from experiments.simulate.kinematic import imagine
from irl.policy import Policy
from models.errors import ModelError
from models.motion.failures import ActionFailure
from models.task.spaces import (
    GOAL_STATE,
    LOST,
    N_ACTIONS,
    N_STATES,
    POSITIONS,
    R_WG,
    Action,
    Kind,
    State,
    decode_states,
)
from models.task.tracking import InHand

ACTIONS = Path(__file__).parents[2] / "data" / "demo_actions.npz"
GOAL = np.array([GOAL_STATE])
DROP = Action(Kind.DROP).index


@pytest.fixture(scope="module")
def task():
    return load_robot_task(SHIPPED_TASK)


@pytest.fixture(scope="module")
def policy(task):
    """Its action in each state, and no preference among the others."""
    action = np.load(ACTIONS)["action"].astype(np.int64)
    return policy_of(action, task.model.mask)


def policy_of(action, mask):
    q = np.where(mask, 0.0, -np.inf).astype(np.float32)
    some = np.flatnonzero(action >= 0)
    q[some, action[some]] = 1.0
    return Policy(action, q)


def seen(state, R=None, p=(0.55, 0.0, 0.52), told=-1):
    rotation = RotationMatrix() if R is None else RotationMatrix(R)
    return Sight(state, RigidTransform(rotation, p), told=told)


def imagine_all(decision, starts, seed):
    return [
        imagine(decision, int(start), {GOAL_STATE}, np.random.default_rng([seed, number]))
        for number, start in enumerate(starts)
    ]


def step(state, action, failure=None):
    return Step(state, action, state, 0.0, 1.0, failure)


@pytest.mark.parametrize("number", [12, 37, 65, 81])
def test_starts_that_once_went_in_circles_or_were_lost_arrive(task, policy, number):
    starts = draw_starts(task, 100, 7)
    rng = np.random.default_rng([7, number])
    played = imagine(Forecast(policy, GOAL), int(starts[number]), {GOAL_STATE}, rng)
    assert played.verdict == Verdict.GOAL
    assert len(played.steps) <= 10


def test_where_the_table_circles_the_forecast_arrives_and_nowhere_does_it_do_worse(task, policy):
    starts = draw_starts(task, 100, 7)
    table, forecast = (
        imagine_all(decision, starts, 7) for decision in (Table(policy), Forecast(policy, GOAL))
    )
    arrived = np.array([[e.verdict == Verdict.GOAL for e in each] for each in (table, forecast)])
    # This policy was learnt where hardly a cube that is dropped from the upper layer tumbles.
    assert 78 <= arrived[0].sum() < 90
    assert arrived[1].all()
    circles = [e for e, good in zip(table, arrived[0], strict=True) if not good]
    assert {e.verdict for e in circles} == {Verdict.OUT_OF_ACTIONS, Verdict.LOST}
    # Where the policy drops no cube from there, and arrives, it is left alone.
    far = [
        any(s.action == DROP and decode_states(s.state).position % 2 for s in e.steps)
        for e in table
    ]
    own = [e for e, good, up in zip(forecast, arrived[0], far, strict=True) if good and not up]
    assert len(own) > 50
    assert {s.chosen_by for e in own for s in e.steps} == {By.POLICY}


def test_episodes_without_physics_follow_the_seed(policy):
    starts = np.array([5, 100, 200])
    first, again, other = (imagine_all(Forecast(policy, GOAL), starts, seed) for seed in (0, 0, 1))
    assert first == again
    assert [e.start for e in other] == [5, 100, 200]


def test_the_forecast_takes_the_first_action_by_value_after_which_the_policy_arrives():
    mask = np.zeros((N_STATES + 1, N_ACTIONS), dtype=bool)
    action = np.full(N_STATES + 1, -1)
    start = State(2, 4).index  # half a turn off, in the goal's cell
    mask[start, 10:18] = True
    action[start] = 10
    # The policy only knows how to drop, and what hand 12 holds: turned half, then dropped.
    held = State(2, 4, 12).index
    mask[held, Action(Kind.ROTATE, 16).index] = True
    action[held] = Action(Kind.ROTATE, 16).index
    mask[State(2, 0, 16).index, DROP] = True
    action[State(2, 0, 16).index] = DROP
    policy = policy_of(action, mask)
    R = np.diag([-1.0, -1.0, 1.0])
    sight = seen(start, R, (0.5, 0.0, 0.52))
    forecast = Forecast(policy, GOAL)
    assert forecast.choose(sight, ()) == Choice(12, By.FORECAST)
    # What could not be carried out is not asked for again; then whatever was not yet tried.
    failed = [step(start, 12, ActionFailure.OUT_OF_REACH)]
    assert forecast.choose(sight, failed) == Choice(10, By.UNTRIED)
    # What was taken twice and brought the cube back here is doubted.
    assert forecast.choose(sight, [step(start, 12)]) == Choice(12, By.FORECAST)
    assert forecast.choose(sight, [step(start, 12)] * 2) == Choice(10, By.UNTRIED)
    every = [step(start, a, ActionFailure.NO_PATH) for a in range(10, 18)]
    assert forecast.choose(sight, every) is None
    # What was ended on the way may be tried again; nobody blames an action for a push.
    for failure in (ActionFailure.GRIP_LOST, ActionFailure.OBSTRUCTED, ActionFailure.OVERTIME):
        assert forecast.choose(sight, [step(start, 12, failure)]) == Choice(12, By.FORECAST)
        assert forecast.choose(sight, [step(start, 12, failure)] * 2).action != 12
    pushed = [step(start, 12, ActionFailure.DISPLACED)] * 3
    assert forecast.choose(sight, pushed) == Choice(12, By.FORECAST)
    # Nor for what was in its way, once a free way led here.
    stopped = [step(start, 12, ActionFailure.OBSTRUCTED)] * 2
    came = replace(step(held, DROP), next_state=start)
    assert forecast.choose(sight, [*stopped, came]) == Choice(12, By.FORECAST)
    for no_news in (replace(came, failure=ActionFailure.OBSTRUCTED), replace(came, state=start)):
        assert forecast.choose(sight, [*stopped, no_news]).action != 12
    assert forecast.choose(sight, [came, *stopped]).action != 12


@pytest.mark.parametrize(
    ("p", "cell"),
    [
        ((0.4729, 0.0, 0.52), 2),
        ((0.43, -0.16, 0.52), 0),
        ((0.68, 0.19, 0.522), 16),
        ((0.473, 0.0, 0.02), None),
        ((0.76, 0.0, 0.52), None),
        ((0.55, -0.21, 0.52), None),
    ],
)
def test_a_cube_beside_the_grid_is_lost_to_the_table_only(policy, p, cell):
    """Lost to a forecast is what has left the table top, x from 0.35 to 0.75 m, y to ±0.2 m."""
    beside, forecast = seen(LOST, p=p), Forecast(policy, GOAL)
    assert Table(policy).state(beside) == LOST
    assert forecast.state(beside) == (LOST if cell is None else State(cell, 0).index)
    assert (forecast.choose(beside, ()) is None) == (cell is None)


def test_a_cube_on_top_of_another_is_lost_to_the_forecast(policy):
    goal = State.from_index(GOAL_STATE).position
    forecast, p = Forecast(policy, GOAL), POSITIONS[goal][:2]
    for z, state in ((0.523, GOAL_STATE), (0.56, LOST)):
        assert forecast.state(seen(GOAL_STATE, p=(*p, z))) == state
    held = State(goal, 0, 10).index
    assert forecast.state(seen(held, p=(*p, 0.56))) == held


def test_a_cube_beside_the_goals_cell_is_grasped_once_more(policy):
    x, y, _ = POSITIONS[State.from_index(GOAL_STATE).position]
    sight = seen(LOST, p=(x - 0.03, y, 0.52))
    forecast = Forecast(policy, GOAL)
    assert forecast.state(sight) == GOAL_STATE
    choice = forecast.choose(sight, ())
    assert Action.from_index(choice.action).kind == Kind.GRASP


def test_the_table_has_what_it_values_next_once_an_action_could_not_be_planned(policy):
    state = State(14, 0).index
    own, table = int(policy.action[state]), Table(policy)
    assert table.choose(Sight(state), ()) == Choice(own, By.POLICY)
    second = table.choose(Sight(state), [step(state, own, ActionFailure.NO_PATH)])
    assert second.by == By.UNTRIED and second.action != own
    assert np.isfinite(policy.q[state, second.action])
    possible = np.flatnonzero(np.isfinite(policy.q[state]))
    every = [step(state, int(a), ActionFailure.NO_ROOM) for a in possible]
    assert table.choose(Sight(state), every) is None
    assert table.choose(Sight(state), every[1:]).action == possible[0]
    # What went wrong on the way is done again; a table without values has nothing else.
    assert table.choose(Sight(state), [step(state, own, ActionFailure.GRIP_LOST)]).action == own
    bare = Table(policy.action)
    assert bare.choose(Sight(state), [step(state, own, ActionFailure.NO_PATH)]) is None


def test_a_person_is_obeyed_where_there_is_one(policy):
    decision = Correctable(Forecast(policy, GOAL))
    state = State(14, 0).index
    assert decision.choose(seen(state, told=7), ()) == Choice(7, By.PERSON)
    assert decision.choose(seen(state, p=(0.6, 0.0, 0.52)), ()).by != By.PERSON


def test_the_goal_that_a_learner_holds_is_where_its_best_action_leads(task, policy):
    q = policy.q.copy()
    q[State(5, 3, 10).index, DROP] = 2.0
    assert held_goal(Policy(policy.action, q)) == State(4, 3).index
    q[State(2, 7).index, Action(Kind.GRASP, 10).index] = 3.0
    held = State.from_index(held_goal(Policy(policy.action, q)))
    assert (held.position, held.gripper) == (2, 10)
    q[:] = -np.inf
    with pytest.raises(ModelError, match="no action"):
        held_goal(Policy(policy.action, q))


def test_what_a_forecast_cannot_work_with_is_refused(policy):
    with pytest.raises(ModelError, match="goals: 15984"):
        Forecast(policy, LOST)
    with pytest.raises(ModelError, match="policy: q"):
        Forecast(Policy(policy.action, policy.q[:, :9]), GOAL)
    with pytest.raises(ModelError, match=r"object\.pose"):
        Forecast(policy, GOAL).choose(Sight(0), ())


def test_what_there_was_no_room_for_is_not_asked_for_by_another_hand():
    """The policy turns the hand to 16 and drops the cube, from either of two hands."""
    turn, back = (Action(Kind.ROTATE, hand).index for hand in (16, 12))
    one, other, turned = (State(2, 0, hand).index for hand in (12, 10, 16))
    mask = np.zeros((N_STATES + 1, N_ACTIONS), dtype=bool)
    action = np.full(N_STATES + 1, -1)
    action[[one, other, turned]] = turn, turn, DROP
    mask[other, [turn, back]] = mask[one, turn] = mask[turned, DROP] = True
    decide = Forecast(policy_of(action, mask), GOAL)
    hanging = replace(
        seen(other, R_WG[10] @ R_WG[16].T), in_hand=InHand(R_WG[16].T, np.zeros(3), 3)
    )
    assert decide.choose(hanging, ()) == Choice(turn, By.POLICY)
    failed = step(one, turn, ActionFailure.NO_ROOM)
    assert decide.choose(hanging, [failed]) == Choice(back, By.UNTRIED)
    # A path from here there may be all the same.
    no_path = step(one, turn, ActionFailure.NO_PATH)
    assert decide.choose(hanging, [no_path]) == Choice(turn, By.POLICY)
    # Once it was let go it is in the hand in another way.
    free = step(State(2, 0).index, Action(Kind.GRASP, 10).index)
    assert decide.choose(hanging, [failed, free]) == Choice(turn, By.POLICY)
