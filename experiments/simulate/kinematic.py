"""Episodes without physics: what comes of an action is drawn from the forecast's own outcomes.

They say what a decision is worth if the forecast is right, for thousands of episodes in minutes;
whether it is right, episodes in physics say.
"""

from collections.abc import Container
from dataclasses import dataclass, field, replace
from time import process_time

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from diagrams.decisions import Decision, Sight, Step
from diagrams.policy_controller import Verdict
from diagrams.policy_run import start_pose
from models.task.discretise import off_table
from models.task.forecast import Scenes, free_scene, outcomes
from models.task.spaces import LOST, POSITIONS, R_WG
from models.task.tracking import InHand


@dataclass(frozen=True)
class Imagined:
    """One episode without physics.

    Attributes:
        start: index of the state the cube was placed in.
        steps: the actions taken.
        verdict: how it ended.
        decision_s: processor time that each decision took [s].
    """

    start: int
    steps: tuple[Step, ...]
    verdict: Verdict
    decision_s: tuple[float, ...] = field(compare=False)


def imagine(
    decision: Decision,
    start: int,
    goals: Container[int],
    rng: np.random.Generator,
    *,
    disturbance: float = 0.0,
    max_actions: int = 20,
) -> Imagined:
    """Play one episode.

    Args:
        decision: chooses each action.
        start: index of a free state.
        goals: indices of the states that end it well.
        rng: draws the cube's true pose, and then what comes of each action.
        disturbance: as `start_pose` takes it [m].
        max_actions: after which it ends.
    """
    X_WO = start_pose(start, rng, disturbance)
    scene = free_scene(start, X_WO.rotation().matrix(), X_WO.translation())
    steps: list[Step] = []
    taken: list[float] = []
    while True:
        sight = _sight(scene)
        state = decision.state(sight)
        if steps:
            steps[-1] = replace(steps[-1], next_state=state)
        arrived = state in goals and state == sight.state
        verdict = Verdict.GOAL if arrived else Verdict.LOST if state == LOST else None
        if verdict is None and len(steps) >= max_actions:
            verdict = Verdict.OUT_OF_ACTIONS
        if verdict is None:
            began = process_time()
            choice = decision.choose(sight, steps)
            taken.append(process_time() - began)
            verdict = Verdict.NO_ACTION if choice is None else None
        if verdict is not None:
            return Imagined(start, tuple(steps), verdict, tuple(taken))
        assert choice is not None
        now = float(len(steps))
        steps.append(Step(state, choice.action, LOST, now, now + 1.0, None, choice.by))
        after = outcomes(scene, np.array([choice.action]))
        drawn = int(rng.choice(after.probability.size, p=after.probability))
        scene = after.scenes.select(np.array([drawn]))


def _sight(scene: Scenes) -> Sight:
    """What a perfect look at a scene sees; a free cube off the grid is lost to the thesis."""
    state, hand = int(scene.state[0]), int(scene.hand[0])
    X_WO = RigidTransform(RotationMatrix(scene.R_WO[0]), scene.p_WO[0])
    if hand < 0:
        return Sight(LOST if off_table(scene.p_WO[0]) else state, X_WO)
    R_GW = R_WG[hand].T
    offset = scene.p_WO[0] - POSITIONS[int(scene.position[0])]
    return Sight(state, X_WO, InHand(R_GW @ scene.R_WO[0], R_GW @ offset, 1))
