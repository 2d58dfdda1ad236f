"""The fixed input that the examples of the file formats are made from. It never changes."""

from pathlib import Path

import numpy as np
import torch

from irl.active_state import ActiveState, QueryRecord
from irl.advice import Advice
from irl.bellman import BellmanTerm
from irl.checkpoint import Checkpoint
from irl.committee import Committee
from irl.demonstrations import Demonstrations
from irl.function_approx import Learner
from irl.generalisation import Generalisation
from irl.lesson_events import (
    Acted,
    Advised,
    Answered,
    Asked,
    Began,
    Cluster,
    Edit,
    Excluded,
    Imported,
    Outcome,
    Result,
    Round,
    Skipped,
    Undo,
    hash_of_states,
)
from irl.likelihood import LikelihoodProblem
from irl.mdp import TransitionModel
from irl.problem import LearningProblem
from irl.task import TaskData, Transitions
from irl.training import Training, train
from irl.training_config import TrainingConfig
from irl.vr_function import VRFunction
from models.inverse_kinematics.solution import Failure
from models.maps import lite
from models.maps.gripper_poses import Layer
from models.maps.pose_solver import Entry
from models.maps.workspace import FAILURES, Decisions, Grid
from models.maps.workspace_map import WorkspaceMap
from models.scenes.planning_scene import Clearance

# (state, action, next state, probability): 0 → 1 → 2 → 3, left is 0 and right 1; 3 is the end.
CHAIN = [
    (0, 0, 0, 1.0),
    (0, 1, 1, 0.875),
    (0, 1, 0, 0.125),
    (1, 0, 0, 1.0),
    (1, 1, 2, 0.875),
    (1, 1, 1, 0.125),
    (2, 0, 1, 1.0),
    (2, 1, 3, 1.0),
]
STATE, ACTION, AFTER, PROBABILITY = (np.array(column) for column in zip(*CHAIN, strict=True))
MODEL = TransitionModel.from_entries(4, 2, STATE, ACTION, AFTER, PROBABILITY)
MASK = np.array([[True, True], [True, True], [True, True], [False, False]])
Q = np.array([[0.5, 0.75], [-1.0, 2.0], [-np.inf, 3.0], [0.0, 0.0]])
FEATURES = np.array([[0.0, 1.0], [0.25, 0.5], [0.5, 0.25], [1.0, 0.0]], dtype=np.float32)
SHOWN = Demonstrations.from_pairs([(0, 1), (1, 1)])
SHOWN_TO_THE_END = Demonstrations.from_pairs([(0, 1), (1, 1)], end=2)


def task() -> TaskData:
    """The chain, with a little of everything."""
    return TaskData(
        name="chain",
        states=[{"x": f"{0.25 * k}", "note": 'a "quoted", comma'} for k in range(4)],
        actions=[{"kind": "left"}, {"kind": "right"}],
        transitions=Transitions(
            state=STATE.astype(np.int32),
            action=ACTION.astype(np.int32),
            next_state=AFTER.astype(np.int32),
            probability=PROBABILITY,
            count=np.arange(8, dtype=np.int64),
            evidence=np.array([0, 0, 0, 1, 1, 1, 2, 2], dtype=np.uint8),
        ),
        goal_states=np.array([3]),
        start_states=np.array([0, 1]),
        gamma=0.875,
        features={"thesis": FEATURES.astype(np.float64), "rotation": FEATURES},
        clusters={"low": np.array([0, 1]), "all": np.arange(4)},
        preferred=np.array([3]),
        avoided=np.zeros(0, dtype=np.int64),
        generalisation=Generalisation(
            state=np.array([0, 1, 2, 0], dtype=np.int32),
            action=np.array([1, 1, 1, 0], dtype=np.int32),
            group=np.array([0, 0, 0, 1], dtype=np.int32),
            rule=np.array([0, 0, 0, 1], dtype=np.uint8),
            rule_names=["onwards", "back"],
        ),
        demonstrations=SHOWN,
        fixed_vr={2: -1.0},
        provenance={"seed": 7},
    )


def network() -> VRFunction:
    """A network of one hidden layer, with weights that are short binary fractions."""
    weights = {
        "0.0.weight": np.array([[0.5, -0.25], [0.125, 0.75]]),
        "0.0.bias": np.array([0.25, -0.125]),
        "0.1.weight": np.array([[0.5, -0.75]]),
        "0.1.bias": np.array([0.125]),
    }
    return VRFunction.from_arrays({name: w.astype(np.float32) for name, w in weights.items()})


def train_to(last: int, path: Path) -> tuple[VRFunction, Training]:
    """Train for four iterations, saved after every second, but end at ``last`` like a kill."""

    def stop(done: int, _: float) -> None:
        if done == last < 4:
            raise KeyboardInterrupt

    trained = network()
    config = TrainingConfig(
        iterations=4, step=0.01, beta=4.0, learn_beta=True, bellman_weight=0.5, bellman_batch=2
    )
    done = train(
        trained,
        LikelihoodProblem.build(MODEL, SHOWN.state, SHOWN.action),
        FEATURES,
        config,
        np.random.default_rng(1),
        callback=stop,
        bellman=BellmanTerm(MODEL, 0.875, batch=2),
        checkpoint=Checkpoint(path, every=2),
    )
    return trained, done


def active_state(*, learnt: bool) -> ActiveState:
    """Algorithm 4.1 with a committee of one, as it begins or after two answers."""
    problem = LearningProblem(MODEL, FEATURES, gamma=0.875)
    rng = np.random.default_rng(2)
    committee = Committee(problem, 1, (2,), np.random.default_rng(3))
    state = ActiveState(
        learner=Learner(problem, network()),
        committee=committee,
        labels=SHOWN,
        advice=Advice(np.zeros((0, 2), dtype=np.int64), np.zeros((0, 2), dtype=np.int64)),
        clusters={"low": np.array([0, 1]), "all": np.arange(4)},
        rng=rng,
    )
    member = committee.members[0]
    member.network.parameters.copy_(torch.arange(9) / 8)
    member.weight = np.array([0.5, 1.5, 0.25, 1.0])
    if learnt:
        state.labels = Demonstrations.from_pairs([(0, 1), (1, 1), (2, 1)])
        state.advice = Advice(np.array([[0, 1]]), np.array([[2, 0]]))
        state.learner.beta, member.beta = 8.0, 16.0
        state.asked = [2]
        state.speak_of("low")
        state.history = [QueryRecord(2, "low", 3, 8.0)]
        rng.random(3)
    return state


def map_entries() -> list[Entry]:
    """A posture, a pose without one, and one whose clearance is all around."""
    q = np.array([0.5, -0.25, 3.0, 1.0, -0.0, 5.0, 1 / 3])
    near = Clearance(0.1 + 0.2, ("arm::bracelet_link", "table::table"))
    return [
        Entry(Layer.CELL, np.array([0.55, -0.1, 0.6]), 7, q, near, None, 3),
        Entry(Layer.GRASP, np.array([0.5, 0.0, 0.52]), 0, None, None, Failure.NOT_FOUND, 30),
        Entry(
            Layer.VIA, np.array([0.5, 0.0, 0.75]), 12, np.zeros(7), Clearance(0.05, None), None, 0
        ),
    ]


def lite_entries() -> list[lite.Entry]:
    """A posture, a pose that collides, one out of reach."""
    p, q = np.array([0.55, -0.1, 0.6]), np.array([0.5, -0.25, 3.0, 1.0, -0.0, 1 / 3])
    table = Clearance(-0.01, ("table::table", "arm::forearm_link"))
    return [
        lite.Entry(p, 7, lite.POLYNOMIAL, q, Clearance(0.1 + 0.2, None), None, 8, 2),
        lite.Entry(p + 0.25, 3, lite.NONE, None, table, Failure.COLLISION, 8, 2),
        lite.Entry(2 * p, 0, lite.NONE, None, None, Failure.OUT_OF_REACH, 0, 0),
    ]


def workspace_map() -> WorkspaceMap:
    """One voxel: the first orientation reachable, then every failure in turn."""
    grid = Grid((0.3, 0.1, 0.5), (0.3, 0.1, 0.5), 0.1)
    reason = (1 + np.arange(grid.total) % len(FAILURES)).astype(np.uint8)
    reason[0] = 0
    q = np.array([[0.5, -0.25, 3.0, 1.0, 0.0, 5.0, 0.125]], dtype=np.float32)
    return WorkspaceMap(grid, Decisions(reason, q, np.array([0.0125], dtype=np.float32)))


LESSON = [
    Began(
        "7a" * 32,
        {"method": "planning", "seed": 3, "rules": ["drop"], "options": {"strategy": "random"}},
        {"numpy": "2.0"},
        [[0, 0, 3, 1, "demonstrator"]],
        [[0, 1, 2]],
    ),
    Round(0, 1, True),
    Result(0, "5b" * 32, {"enough": False, "changed": None}),
    Asked(2, "random", 0.25, 0, 1, 0, 1, "learn", "t0"),
    Answered(2, 1, 1, 0, 1, 2.5, 3, "learn"),
    Outcome(5, 3),
    Acted(3, 0, 1, 1, 2),
    Cluster("low ∩ all", hash_of_states([0, 1])),
    Advised("low ∩ all", hash_of_states([0, 1]), [1], [0]),
    Excluded(5, [[0, 1]]),
    Skipped(3),
    Edit(5, {"action": 0}),
    Undo(11),
    Imported("more.csv", [[9, 0, 0, 1, "human"]], [], [["low", "", [], [1]]], [[1, 1]]),
]
"""One event of every kind."""
