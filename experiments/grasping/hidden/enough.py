"""``enough``: lessons that end when the learner says so, and whether it was right.

Each lesson is about another hidden reward (`experiments.grasping.hidden.drawn`). The learner is
right if its policy reaches the goal from the free states with 0.99 and its choices are as good as
the demonstrator's in 0.90 of the states. Simpler rules watch every lesson, and say when they would
have ended it (`experiments.grasping.hidden.simple_rules`); and beside each goes one of a fixed
length (`experiments.grasping.hidden.fixed_budget`).
"""

import os
import time
from dataclasses import dataclass, field
from itertools import count, islice
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np

from experiments.grasping.hidden.costs import LEFT_OUT
from experiments.grasping.hidden.drawn import is_nameless, told_by, with_noise
from experiments.grasping.hidden.fixed_budget import THESIS_ANSWERS, after_answers
from experiments.grasping.hidden.lessons import Setting, asked, shared_setting, shown_runs
from experiments.grasping.hidden.pictures import draw_lessons
from experiments.grasping.hidden.simple_rules import RULES, Watched
from experiments.kit.command import Output
from experiments.kit.executors import MOST_WORKERS, run_jobs, start_workers
from experiments.kit.kept_rows import KeptRows
from experiments.kit.shipped_data import SHIPPED_TASK
from irl.choices import Limits, Settings
from irl.demonstrations import Demonstrations
from irl.posterior.enough import LEARNT, REACHES, SUCCESS, UNSURE, claim, reaches
from irl.posterior.learner import GoalLearner
from models.task.spaces import N_STATES

RIGHT_SUCCESS, RIGHT_ACCURACY = 0.99, 0.90
FIXED = "fixed number"
"""The name of the lesson of a fixed length among the simpler rules."""
COMPARED = ("labels", "right", "success_mdp", "accuracy_optimal_all")
"""What is noted of where a simpler rule would have ended a lesson."""


@dataclass(frozen=True)
class Enough(Settings):
    """Let a learner say when it has learnt enough, and see whether it was right."""

    task: Path = SHIPPED_TASK
    """The folder of the task data."""
    lessons: Annotated[int, Limits(1, 100_000)] = 200
    """How many lessons there are, each about another hidden reward."""
    questions: Annotated[int, Limits(1, 1000)] = 36
    """How many questions may be asked at most, the audit's included."""
    fixed: Annotated[int, Limits(0, N_STATES)] = THESIS_ANSWERS
    """How many answers, about states drawn by chance, a lesson of a fixed length has that is
    compared with; the thesis has 1,296. 0 leaves it out."""
    about: Literal["all", "named", "nameless", "outside"] = "all"
    """Of which rewards: two of twenty have a cost without a name; outside, a goal without one: a
    region, and the learner does not know the first of the factors that it is told by."""
    noise: Annotated[float, Limits(0, 1)] = 0.0
    """The share of wrong labels."""
    workers: Annotated[int, Limits(1, MOST_WORKERS)] = 2
    """How many processes; the results do not depend on it."""
    cluster: str = ""
    """The address of a dask scheduler that runs them instead, such as tcp://host:8786."""
    seed: int = 9
    """The seed of rewards and lessons. Settings were chosen on those of 1000 to 1002, and after a
    look at lessons of 1 and 5 to 8."""
    out: Path = field(default_factory=lambda: Path("out/grasping/enough"))
    """The folder that the results are written to."""


def is_about(number: int, about: str) -> bool:
    """Whether a reward is one of those that lessons are to be about."""
    if about == "outside":
        return bool(told_by(number)) and not is_nameless(number)
    return about == "all" or (about == "nameless") == is_nameless(number)


def one_lesson(config: Enough, number: int) -> dict[str, Any]:
    """Ask until it is enough; what the learner said then, and what was true."""
    began, seed = time.process_time(), config.seed
    untold = told_by(number)[0] if config.about == "outside" else ""
    setting = shared_setting(str(config.task), seed, config.questions, untold)
    reward = with_noise(setting.reward(number), config.noise)
    rng = np.random.default_rng([seed, number, 7])
    shown = shown_runs(setting, reward, 1, rng)
    simple: dict[str, dict[str, Any]] = {}

    def truth(learner: GoalLearner) -> dict[str, Any]:
        given = Demonstrations.concatenate([learner.shown, learner.held_out])
        true = setting.judged(reward, learner.q, given)
        good = true["accuracy_optimal_all"] >= RIGHT_ACCURACY
        return true | {"right": bool(true["success_mdp"] >= RIGHT_SUCCESS and good)}

    def ended(rule: str, learner: GoalLearner) -> None:
        if rule not in simple:
            true = truth(learner)
            simple[rule] = {name: true[name] for name in COMPARED}

    sure, fulfilled, judged, last = 0, 0, None, None
    for answers, learner in enumerate(asked(setting, reward, shown, rng, Watched(ended))):
        if judged is not learner.shown:  # else it learnt nothing
            judged, predicts = learner.shown, reaches(learner)
            sure += predicts
            fulfilled += predicts and truth(learner)["success_mdp"] >= SUCCESS
        last = learner, answers
    assert last is not None
    learner, answers = last
    seconds = time.process_time() - began
    if config.fixed:
        chance = np.random.default_rng([seed, number, 8])
        ended(FIXED, after_answers(setting, reward, shown, config.fixed, chance))
    said, predicted = claim(learner), learner.predicted
    return {
        **reward.told,
        "untold": untold,
        **truth(learner),
        "answers": answers,
        "audited": len(learner.audit.passed),
        "mistaken": learner.mistaken,
        "stopped": said == LEARNT,
        "claim": said,
        "predicted_success": predicted.success,
        "predicted_accuracy": predicted.accuracy,
        "unexplained": learner.unexplained,
        "checks": sure,
        "checks_right": fulfilled,
        "simple": simple,
        "seconds": seconds,
    }


def run_enough(config: Enough, output: Output) -> dict[str, Any]:
    """Give every lesson that is still missing, and count."""
    setting = Setting(config.task, config.seed, config.questions)
    os.environ["OPENBLAS_NUM_THREADS"] = os.environ["OMP_NUM_THREADS"] = "1"
    identity = {
        "task": setting.task.task_hash,
        "seed": config.seed,
        "questions": config.questions,
        "noise": config.noise,
        "fixed": config.fixed,
        "outside": config.about == "outside",
    }
    numbers = list(islice((k for k in count() if is_about(k, config.about)), config.lessons))
    kept = KeptRows(output, identity)
    done = {row["reward"]: row for row in kept.rows}
    missing = iter([k for k in numbers if k not in done])
    with start_workers(config.workers, config.cluster) as workers:
        for number, row in run_jobs(
            workers,
            lambda: next(missing, None),
            lambda number: workers.executor.submit(one_lesson, config, number),
        ):
            kept.add(row)
            done[number] = row
    rows = [done[k] for k in numbers]
    result = {"seconds": [row.pop("seconds") for row in rows]} | counted(rows, config.questions)
    print(
        f"a lesson took {np.mean(result['seconds']):.1f} s of one core on average, at most "
        f"{max(result['seconds']):.1f} s"
    )
    with output.figure("lessons.png") as figure:
        draw_lessons(figure, rows, RIGHT_ACCURACY)
    kept.forget()
    return result


def counted(rows: list[dict[str, Any]], questions: int) -> dict[str, Any]:
    """The figures of all lessons, those with a cost without a name apart from the others."""
    told: dict[str, Any] = {"lessons": len(rows), "rows": rows}
    groups = {
        "": rows,
        "named_": [row for row in rows if LEFT_OUT not in row["costs"]],
        "nameless_": [row for row in rows if LEFT_OUT in row["costs"]],
    }
    for group, some in groups.items():
        if not some:
            continue
        ended = [row for row in some if row["stopped"]]
        told[f"{group}lessons"] = len(some)
        told[f"{group}stopped"] = len(ended)
        told[f"{group}right_share"] = (
            sum(row["right"] for row in ended) / len(ended) if ended else None
        )
        told[f"{group}reaches"] = sum(row["claim"] == REACHES for row in some)
        told[f"{group}unsure"] = sum(row["claim"] == UNSURE for row in some)
        contradicted = [row for row in some if row["mistaken"]]
        told[f"{group}contradicted"] = len(contradicted)
        told[f"{group}contradicted_reaches"] = sum(r["claim"] == REACHES for r in contradicted)
        told[f"{group}labels_mean"] = float(np.mean([row["labels"] for row in some]))
        told[f"{group}stopped_labels_mean"] = (
            float(np.mean([row["labels"] for row in ended])) if ended else None
        )
        print(
            f"{group.strip('_') or 'all':10}{len(some):5d} lessons, "
            f"{told[f'{group}labels_mean']:.1f} labels on average; {len(ended)} stopped"
            f"{_at(told[f'{group}stopped_labels_mean'])}, "
            f"{sum(row['right'] for row in ended)} of them right; "
            f"{told[f'{group}reaches']} only reach the goal, {told[f'{group}unsure']} are unsure"
        )
    told["checks"] = sum(row["checks"] for row in rows)
    told["checks_right"] = sum(row["checks_right"] for row in rows)
    print(f"of {told['checks']} checks that predict success, {told['checks_right']} are right")
    told["simple_rules"] = [_of_rule(rule, rows) for rule in (*RULES, FIXED)]
    told["answers_saved"] = float(np.mean([questions - row["answers"] for row in rows]))
    return told


def _at(labels: float | None) -> str:
    return "" if labels is None else f" at {labels:.1f}"


def _of_rule(rule: str, rows: list[dict[str, Any]]) -> dict[str, Any]:
    """How a simpler rule would have done, in the lessons that it would have ended."""
    ended = [row["simple"][rule] for row in rows if rule in row["simple"]]
    wrong = sum(not each["right"] for each in ended)
    told = {"rule": rule, "stopped": len(ended), "wrong": wrong}
    for name in ("labels", "success_mdp", "accuracy_optimal_all"):
        told[f"{name}_mean"] = float(np.mean([each[name] for each in ended])) if ended else None
    print(f"{rule}: would have ended {len(ended)}, {wrong} of them wrongly")
    return told
