"""Small models with known answers, and random ones to check against other methods."""

import numpy as np
import pytest

from irl.demonstrations import Demonstrations
from irl.generalisation import Generalisation
from irl.mdp import TransitionModel
from irl.task import TaskData, Transitions

# (state, action, next state, probability): 0 → 1 → 2 → 3, moving right works 9 times in 10 from
# 0 and 1 and always from 2; left always works; 3 is absorbing, with nothing to do.
CHAIN = [
    (0, 0, 0, 1.0),
    (0, 1, 1, 0.9),
    (0, 1, 0, 0.1),
    (1, 0, 0, 1.0),
    (1, 1, 2, 0.9),
    (1, 1, 1, 0.1),
    (2, 0, 1, 1.0),
    (2, 1, 3, 1.0),
]


@pytest.fixture
def chain() -> TransitionModel:
    """A chain of 4 states with the actions 0, left, and 1, right."""
    state, action, after, p = (np.array(column) for column in zip(*CHAIN, strict=True))
    return TransitionModel.from_entries(4, 2, state, action, after, p)


@pytest.fixture
def random_model():
    """Build a random sparse model: ``random_model(rng, n_states, n_actions)``."""

    def build(rng: np.random.Generator, n_states: int = 30, n_actions: int = 4) -> TransitionModel:
        feasible = rng.random((n_states, n_actions)) < 0.6
        feasible[:, 0] |= ~feasible.any(axis=1)
        feasible[-1] = False
        entries = []
        for s, a in zip(*np.nonzero(feasible), strict=True):
            successors = rng.choice(n_states, size=rng.integers(1, 4), replace=False)
            for s_next, p in zip(successors, rng.dirichlet(np.ones(successors.size)), strict=True):
                entries.append((s, a, s_next, p))
        state, action, after, p = (np.array(column) for column in zip(*entries, strict=True))
        return TransitionModel.from_entries(n_states, n_actions, state, action, after, p)

    return build


@pytest.fixture
def small_task() -> TaskData:
    """The chain as a task, with a little of everything."""
    state, action, after, p = (np.array(column) for column in zip(*CHAIN, strict=True))
    return TaskData(
        name="chain",
        states=[{"x": f"{0.1 * k}", "note": 'a "quoted", comma'} for k in range(4)],
        actions=[{"kind": "left"}, {"kind": "right"}],
        transitions=Transitions(
            state=state.astype(np.int32),
            action=action.astype(np.int32),
            next_state=after.astype(np.int32),
            probability=p,
            count=np.arange(8, dtype=np.int64),
            evidence=np.array([0, 0, 0, 1, 1, 1, 2, 2], dtype=np.uint8),
        ),
        goal_states=np.array([3]),
        start_states=np.array([0, 1]),
        gamma=0.9,
        features={
            "thesis": np.linspace(0, 1, 8).reshape(4, 2),
            "rotation": np.eye(4, 3, dtype=np.float32),
        },
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
        demonstrations=Demonstrations.from_pairs([(0, 1), (1, 1)]),
        fixed_vr={2: -1.0},
        provenance={"seed": 7},
    )
