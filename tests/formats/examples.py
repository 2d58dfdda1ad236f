"""One small example of every file format, written by today's code from fixed input.

``python -m tests.formats.examples NAME`` keeps today's example of a format among the test data;
``NAME=LABEL`` does so beside another one of the same version.
"""

import hashlib
import json
import sys
from collections.abc import Callable
from dataclasses import dataclass
from itertools import count
from pathlib import Path

import numpy as np

from diagrams.trials import database
from diagrams.trials.database import Campaign, TrialDatabase
from diagrams.trials.record import Noise, Outcome, Pair, TrialConfig, TrialRecord
from experiments.grasping.learning import CURVE
from experiments.kit.command import Output
from experiments.kit.kept_rows import KeptRows
from experiments.kit.shipped_data import FEASIBILITY, MAP, save_feasibility
from experiments.reachability import workspace_run
from irl import checkpoint, kept_arrays, lesson_rows, policy, task_data
from irl.files import sha256
from irl.formats import write_json
from irl.lesson import Lesson
from irl.lesson_events import Answered
from irl.lesson_exchange import save_advice
from irl.outcomes import REWARD_VERSION, LearntReward, SoftPolicy, save_reward, save_soft_policy
from irl.policy import Policy, save_policy
from irl.task_data import save_task
from models.maps import lite_csv, reachability_csv, workspace_csv
from models.maps.reachability import ReachabilityMap
from models.motion.feasibility import Feasibility
from tests.formats import inputs

KEPT = Path(__file__).resolve().parents[1] / "data" / "formats"
"""A folder a format, in it one a version, in it the files."""
DIGESTS = KEPT / "digests.json"
"""SHA-256 of each example ever kept. Lines are added, and none is changed or taken away."""
BY_CONTENT = "1"
"""The version of a format whose files have none; columns and fields tell what they are."""


@dataclass(frozen=True)
class Format:
    """A file format.

    Attributes:
        version: today's; an example's folder has its name, before a dot if there are several.
        write: from a folder to the example's files in it.
    """

    version: str
    write: Callable[[Path], object]


def _policy(folder: Path) -> None:
    weights = {"0.0.bias": np.array([0.5, -0.25], dtype=np.float32)}
    learnt = Policy.from_q(
        inputs.Q, inputs.MASK, weights=weights, task_hash="7a", algorithm="lp", seed=3
    )
    save_policy(learnt, folder / "policy.safetensors")


def _reward(folder: Path) -> None:
    reward = LearntReward(np.array([0.0, -0.5, 0.25, 1.0]), 0.9, "7a", "lp", 3, 0.125)
    save_reward(reward, folder / "reward.safetensors")


def _soft_policy(folder: Path) -> None:
    probability = np.array([[0.25, 0.75], [0.0, 1.0], [0.5, 0.5], [0.0, 0.0]])
    save_soft_policy(SoftPolicy(probability, "7a", "birl", 3), folder / "soft_policy.safetensors")


def _training(folder: Path) -> None:
    """Stopped at the third of four iterations; the last saving was at the second."""
    try:
        inputs.train_to(3, folder / "training.checkpoint")
    except KeyboardInterrupt:
        return


def _active(folder: Path) -> None:
    inputs.active_state(learnt=True).save(folder / "learning.checkpoint", {"seed": 1})


def _trials(folder: Path) -> None:
    campaign = Campaign(TrialConfig(solver="discrete"), seed=5, description="d", drake="1")
    trials = TrialDatabase(folder / "trials.db", campaign)
    noise = Noise(0.1, 0.0, 0.25, 0.0, 0.0, 0.0, 0.8, 0.1, 0.5)
    turn, displacement = (0.1, 0.2, 0.5), (1e-3, 0.0, -0.03)
    record = TrialRecord(
        Outcome.FREE,
        turn=turn,
        displacement=displacement,
        drift=0.001,
        noise=noise,
        draws=2,
        next_state=48,
    )
    trials.add(Pair(9000, 54), 4, record)
    trials.close()
    for leftover in folder.glob("trials.db-*"):
        leftover.unlink()


def _lesson(folder: Path) -> None:
    clock = count(100.0).__next__
    with Lesson.begin(folder / "lesson.db", inputs.LESSON[0], clock=clock) as lesson:
        for event in inputs.LESSON[1:]:
            lesson.append(event, token="t0" if isinstance(event, Answered) else None)
        save_advice(lesson, folder / "advice.json")


def _kept_rows(folder: Path) -> None:
    KeptRows(Output(folder, None), {"seed": 1, "states": [25]}).add({"states": 25, "seconds": 0.5})


def _curve(folder: Path) -> None:
    point = {"query": 0, "demonstrated": 981, "success": 0.5, "accuracy_optimal_all": 0.25}
    write_json(folder / CURVE, {"points": [point, point | {"query": 1, "success": 1.0}]})


def _map(folder: Path) -> None:
    reachability_csv.write_map(ReachabilityMap(inputs.map_entries(), seed=5), folder / MAP)


def _feasibility(folder: Path) -> None:
    shapes = {"grasp": (1, 2), "translate": (2, 1, 2), "rotate": (2, 1, 1), "drop": (2, 1)}
    arrays = {name: np.arange(np.prod(n)).reshape(n) % 2 == 0 for name, n in shapes.items()}
    _map(folder)
    held = np.ones((2, 1), dtype=bool)
    save_feasibility(Feasibility(**arrays, held=held), folder / MAP, folder / FEASIBILITY)


def _workspace_chunk(folder: Path) -> None:
    plan = workspace_run.Plan(inputs.workspace_map().grid)
    workspace_run._open(plan, folder)
    (folder / "run.json").write_text(
        (folder / "run.json").read_text().replace(plan.record()["model_files"], "of the example")
    )


FORMATS = {
    "task_data": Format(
        str(task_data.SCHEMA_VERSION), lambda f: save_task(inputs.task(), f / "task")
    ),
    "demonstrations": Format(
        BY_CONTENT, lambda f: inputs.SHOWN_TO_THE_END.save(f / "demonstrations.csv")
    ),
    "policy": Format(str(policy.SCHEMA_VERSION), _policy),
    "reward": Format(REWARD_VERSION, _reward),
    "soft_policy": Format(kept_arrays.SCHEMA_VERSION, _soft_policy),
    "training": Format(str(checkpoint.SCHEMA_VERSION), _training),
    "active_learning": Format(str(checkpoint.SCHEMA_VERSION), _active),
    "trial_database": Format(str(database.SCHEMA_VERSION), _trials),
    "lesson": Format(str(lesson_rows.SCHEMA_VERSION), _lesson),
    "kept_rows": Format(BY_CONTENT, _kept_rows),
    "learning_curve": Format(BY_CONTENT, _curve),
    "reachability_map": Format(BY_CONTENT, _map),
    "feasibility": Format(BY_CONTENT, _feasibility),
    "lite_map": Format(
        BY_CONTENT, lambda f: lite_csv.write_map(inputs.lite_entries(), 5, f / "map.csv")
    ),
    "workspace_map": Format(
        BY_CONTENT,
        lambda f: workspace_run.write_map(inputs.workspace_map(), 0.01, f / workspace_run.FILE),
    ),
    "workspace_table": Format(
        BY_CONTENT,
        lambda f: workspace_csv.write_map(inputs.workspace_map(), 0.01, f / "map.csv"),
    ),
    "workspace_plan": Format(BY_CONTENT, _workspace_chunk),
}


def digest(folder: Path) -> str:
    """SHA-256 over the names and bytes of all files below a folder."""
    parts = [
        f"{path.relative_to(folder).as_posix()} {sha256(path)}"
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    ]
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()


def keep(name: str, label: str = "") -> Path:
    """Write today's example of a format to its folder, which must not be there yet.

    Args:
        name: of the format.
        label: what tells it from another example of the same version.
    """
    version = FORMATS[name].version
    folder = KEPT / name / (f"{version}.{label}" if label else version)
    folder.mkdir(parents=True)
    FORMATS[name].write(folder)
    known = json.loads(DIGESTS.read_text(encoding="utf-8")) if DIGESTS.exists() else {}
    known[folder.relative_to(KEPT).as_posix()] = digest(folder)
    write_json(DIGESTS, dict(sorted(known.items())))
    return folder


if __name__ == "__main__":
    for argument in sys.argv[1:]:
        print(keep(*argument.split("=", 1)))
