"""How many actions and questions differ between processors and threads, on the shipped task.

``python -m tests.decisions.networks`` learns in a process for each and prints the table.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from experiments.kit.shipped_data import SHIPPED_TASK
from irl.active import ActiveConfig, active_fa_mlirl
from irl.collection import initial_demonstrations
from irl.demonstrators import OracleDemonstrator
from irl.experts import OracleExpert
from irl.metrics import success_mdp
from irl.npz import read_npz, write_npz
from irl.policy import Policy
from irl.problem import LearningProblem
from irl.task_data import load_task
from irl.teacher import Teacher
from irl.training_config import TrainingConfig

RUNS = [("avx512", 1), ("avx2", 1), ("default", 1), ("avx512", 2)]
TRAINING = TrainingConfig(iterations=1000, bellman_weight=10, bellman_delta=0.05)
REFINING = TrainingConfig(iterations=100, step=3e-4, bellman_weight=10, bellman_delta=0.05)


def learn(path: Path) -> None:
    """Learn as the demo does, for a shorter time; keep actions, questions and the success."""
    rng = np.random.default_rng(0)
    task = load_task(SHIPPED_TASK)
    mind = OracleDemonstrator(task.model, task.goal_states, task.gamma, surprise=0.5)
    teacher = Teacher(mind, OracleExpert(mind, task.start_states))
    shown = initial_demonstrations(teacher, task.start_states, 981, rng)
    config = ActiveConfig(
        TRAINING, REFINING, budget=10, hidden=(64, 32), state_query="visitation_entropy"
    )
    problem = LearningProblem.of(task, "rotation")
    learnt = active_fa_mlirl(problem, shown, teacher, config, rng=rng)
    action = Policy.from_q(learnt.q, task.model.mask).action
    success = success_mdp(task.model, action, task.goal_states, task.start_states)
    asked = np.array([record.state for record in learnt.history])
    write_npz(path, {"action": action, "asked": asked, "success": np.array(success)})


def main() -> None:
    """Learn everywhere, and compare with the first."""
    kept = []
    for capability, threads in RUNS:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "decided.npz"
            here = {"ATEN_CPU_CAPABILITY": capability, "OMP_NUM_THREADS": str(threads)}
            command = [sys.executable, "-m", "tests.decisions.networks", str(path)]
            subprocess.run(command, env=os.environ | here, check=True)
            kept.append(read_npz(path))
        first, last = kept[0], kept[-1]
        actions, asked = ((first[n] != last[n]).sum() for n in ("action", "asked"))
        print(
            f"{capability} {threads}: {actions} of {len(last['action'])} actions, {asked} of "
            f"{len(last['asked'])} questions, success {last['success']:.4f}",
            flush=True,
        )


if __name__ == "__main__":
    if sys.argv[1:]:
        learn(Path(sys.argv[1]))
    else:
        main()
