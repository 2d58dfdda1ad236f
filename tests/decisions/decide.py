"""Decides everything that a run decides, small, and prints a hash of each: run by the tests.

``python -m tests.decisions.decide PART …`` prints ``name bits decisions``, one line each. *Bits*
are all bits of the numbers; *decisions* what is done because of them.
"""

import hashlib
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from diagrams.trials.counts import transition_entries
from diagrams.trials.database import TrialDatabase
from experiments.kit.shipped_data import SHIPPED_TASK, SHIPPED_TRIALS, load_feasibility
from experiments.own_task import workshop
from experiments.transitions.export import task_data
from irl.active import ActiveConfig, active_fa_mlirl
from irl.baselines.birl import SamplingConfig
from irl.collection import demonstrate
from irl.demonstrators import OracleDemonstrator
from irl.experts import OracleExpert
from irl.methods import METHODS, learn
from irl.planning import value_iteration
from irl.policy import Policy, save_policy
from irl.problem import LearningProblem
from irl.task_data import TaskData, load_task, save_task
from irl.teacher import Teacher
from irl.training_config import TrainingConfig
from models.gen3 import closed_form
from models.maps.workspace import Grid, WorkspaceSolver
from models.task.trial_classes import trial_classes

Decided = Iterator[tuple[str, bytes, bytes]]
TRAINING = TrainingConfig(iterations=200, step=0.01)
OPTIONS = {
    "fa_mlirl": {"training": TRAINING},
    "deep_max_ent": {"iterations": 30},
    "birl": {"sampling": SamplingConfig(chains=2, burn_in=100, samples=50, thin=2)},
}


def _workshop() -> tuple[TaskData, OracleDemonstrator]:
    task = workshop()
    return task, OracleDemonstrator(task.model, task.goal_states, task.gamma)


def methods() -> Decided:
    """Every method on a small task."""
    task, teacher = _workshop()
    rng = np.random.default_rng(0)
    shown = demonstrate(teacher, rng.choice(task.start_states, 8), rng)
    yield "demonstrations", shown.state.tobytes(), shown.action.tobytes()
    problem = LearningProblem.of(task, "levels")
    for name in METHODS:
        options = OPTIONS.get(name, {})
        q = learn(name, problem, shown, rng=np.random.default_rng(0), **options).q
        yield name, q.tobytes(), Policy.from_q(q, task.model.mask).action.tobytes()


def active() -> Decided:
    """Algorithm 4.1: the policy's file, and what was asked."""
    task, teacher = _workshop()
    rng = np.random.default_rng(0)
    shown = demonstrate(teacher, rng.choice(task.start_states, 2), rng)
    config = ActiveConfig(TRAINING, TRAINING, budget=4, hidden=(16, 16))
    asks = Teacher(teacher, OracleExpert(teacher, task.start_states))
    result = active_fa_mlirl(LearningProblem.of(task, "levels"), shown, asks, config, rng=rng)
    policy = Policy.from_q(result.q, task.model.mask, weights=result.network.arrays())
    with tempfile.TemporaryDirectory() as folder:
        save_policy(policy, Path(folder) / "p")
        file = (Path(folder) / "p").read_bytes()
    asked = [(record.state, record.cluster) for record in result.history]
    yield "active_fa_mlirl", file, repr((asked, policy.action.tolist())).encode()


def planning() -> Decided:
    """Plans of the small task, and the demonstrator's choices in the shipped one."""
    task, _ = _workshop()
    reward = np.isin(np.arange(task.n_states), task.goal_states).astype(float)
    value, q = value_iteration(task.model, reward, task.gamma)
    action = Policy.from_q(q, task.model.mask).action
    yield "planning", value.tobytes() + q.tobytes(), action.tobytes()
    shipped = load_task(SHIPPED_TASK)
    oracle = OracleDemonstrator(shipped.model, shipped.goal_states, shipped.gamma, surprise=0.5)
    yield "oracle", oracle.state_reward.tobytes(), np.asarray(oracle.optimal_actions).tobytes()


def export() -> Decided:
    """What the shipped trials are counted and exported as."""
    trials = TrialDatabase(SHIPPED_TRIALS)
    mask = load_feasibility().mask()
    entries = transition_entries(mask, list(trials.trials()), trial_classes())
    yield "counts", entries.probability.tobytes(), entries.count.tobytes()
    with tempfile.TemporaryDirectory() as folder:
        name = save_task(task_data(trials, entries), Path(folder) / "task").encode()
    yield "task data", name, name


def kinematics() -> Decided:
    """The closed form and the workspace map's decisions."""
    rng = np.random.default_rng(0)
    R = np.linalg.qr(rng.normal(size=(200, 3, 3)))[0]
    R *= np.linalg.det(R)[:, None, None]
    p = rng.uniform(-0.5, 0.5, (200, 3))
    q = closed_form.solve_batch(R, p, np.linspace(-1, 1, 5))
    yield "closed form", q.tobytes(), np.isnan(q).tobytes()
    found = WorkspaceSolver().decide(*Grid().poses(100_000, 100_200))
    yield "workspace", found.q.tobytes() + found.clearance.tobytes(), found.reason.tobytes()


PARTS = {part.__name__: part for part in (methods, active, planning, export, kinematics)}

if __name__ == "__main__":
    for part in sys.argv[1:] or PARTS:
        for name, *contents in PARTS[part]():
            print(name.replace(" ", "_"), *(hashlib.sha256(c).hexdigest()[:16] for c in contents))
