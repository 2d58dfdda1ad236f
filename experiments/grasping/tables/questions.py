"""``questions``: what asking well is worth, by strategy, compared with asking at random."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, lru_cache, partial
from itertools import product
from pathlib import Path
from typing import Annotated, Any

from experiments.grasping.tables.learners import OURS, Learner
from experiments.grasping.tables.lesson import Lesson, shared_teacher
from experiments.grasping.tables.options import Measurement, spread
from experiments.grasping.tables.pictures import draw_gains
from experiments.kit.command import Output
from experiments.kit.jobs import rows_of
from experiments.kit.kept_rows import KeptRows
from irl.active import Result
from irl.choices import Limits, Members
from irl.queries import COMMITTEE_STRATEGIES, STATE_STRATEGIES
from irl.training_config import TrainingConfig
from models.task.spaces import N_STATES

_CLIMB = TrainingConfig(iterations=300, step=3e-3)
ASKING: Mapping[str, Learner] = {
    "likelihood": OURS.with_learning(features="rotation").with_active(
        initial=_CLIMB,
        refine=replace(_CLIMB, iterations=60),
        policy_update="greedy",
        batch=1,
    ),
    "default": OURS,
}
"""Who asks: a network that climbs the likelihood and nothing else, one question at a time; and the
demo's, which asks ten at a time."""
RANDOM = "random"
COMPARED = ("accuracy_optimal_all", "success_mdp", "success_mdp_all", "accuracy_strict")


@dataclass(frozen=True)
class Questions(Measurement):
    """Compare the ways to choose a question with asking at random, seed by seed."""

    seeds: Annotated[int, Limits(1, 100_000)] = 24
    """How many seeds there are."""
    learners: Annotated[tuple[str, ...], Members(tuple(ASKING))] = tuple(ASKING)
    """Who asks: likelihood, a network on the likelihood alone, one question at a time, and default,
    the demo's learner, ten."""
    strategies: Annotated[tuple[str, ...], Members(tuple(STATE_STRATEGIES))] = tuple(
        STATE_STRATEGIES
    )
    """Which strategies are compared; random is always among them."""
    labels: Annotated[int, Limits(1, N_STATES)] = 60
    """How many states are demonstrated before the first question."""
    most: Annotated[int, Limits(1, N_STATES)] = 160
    """How many states are demonstrated after the last."""
    out: Path = field(default_factory=lambda: Path("out/grasping/questions"))
    """The folder that the results are written to."""


def run_questions(config: Questions, output: Output) -> dict[str, Any]:
    """Ask with every learner, strategy and seed that is still missing, and compare."""
    teacher = shared_teacher(str(config.task))
    identity = {"task": teacher.task.task_hash, "labels": config.labels, "most": config.most}
    strategies = tuple(dict.fromkeys((RANDOM, *config.strategies)))
    jobs = list(product(config.learners, config.all_seeds, strategies))
    kept = KeptRows(output, identity)
    rows = rows_of(
        jobs,
        partial(asked, str(config.task), config.labels, config.most),
        kept,
        workers=config.workers,
        cluster=config.cluster,
    )
    result: dict[str, Any] = {
        "rows": [
            compared(rows, learner, strategy)
            for learner in config.learners
            for strategy in strategies
        ],
        "seeds": list(config.all_seeds),
        "labels": [config.labels, config.most],
        "each": rows,
    }
    show(result["rows"])
    with output.figure("gains.png") as figure:
        draw_gains(figure, result["rows"])
    kept.forget()
    return result


def asked(folder: str, labels: int, most: int, job: tuple[str, int, str]) -> dict[str, Any]:
    """What a learner knows after its questions; beforehand it is the same for all strategies."""
    learner, seed, strategy = job
    lesson, shown = begun(folder, labels, learner, seed)
    # The members of a committee have a first training of their own.
    learnt = lesson.learn(most, strategy, None if strategy in COMMITTEE_STRATEGIES else shown())
    start = lesson.curve[0]
    return {
        "learner": learner,
        "strategy": strategy,
        "seed": seed,
        "before": {"accuracy_optimal_all": start.accuracy_optimal_all, "success": start.success},
        **lesson.row(learnt),
    }


@lru_cache(maxsize=1)
def begun(folder: str, labels: int, learner: str, seed: int) -> tuple[Lesson, Callable[[], Result]]:
    """A lesson before its first question, and what the first training led to, trained for once."""
    # Answers count one by one: rules would settle a hundred states with a dozen of them.
    way = ASKING[learner].with_learning(demonstrations=labels, least_purity=1.0)
    lesson = Lesson.begin(shared_teacher(folder), way, seed)
    return lesson, cache(lambda: lesson.learn(0))


def compared(rows: Sequence[dict[str, Any]], learner: str, strategy: str) -> dict[str, Any]:
    """One strategy's figures, and its gains over random questions on the same seeds.

    Each is [mean, low, high], the interval by bootstrap over seeds.
    """
    own, chance = (
        {r["seed"]: r for r in rows if (r["learner"], r["strategy"]) == (learner, name)}
        for name in (strategy, RANDOM)
    )
    return {
        "learner": learner,
        "strategy": strategy,
        "answers": spread([row["answers"] for row in own.values()]),
        **{name: spread([row[name] for row in own.values()]) for name in COMPARED},
        "against_random": {
            name: spread([row[name] - chance[seed][name] for seed, row in own.items()])
            for name in COMPARED
        },
    }


def show(rows: Sequence[dict[str, Any]]) -> None:
    """Print the figures, and gains in points."""
    print(f"{'learner':12}{'strategy':22}{'accuracy':>9}{'gain':>22}{'success':>9}{'gain':>22}")
    for row in rows:
        line = f"{row['learner']:12}{row['strategy']:22}"
        for name in ("accuracy_optimal_all", "success_mdp"):
            gain, low, high = (100 * value for value in row["against_random"][name])
            line += f"{row[name][0]:9.1%}{gain:+8.1f} [{low:+.1f}, {high:+.1f}]".ljust(31)
        print(line)
