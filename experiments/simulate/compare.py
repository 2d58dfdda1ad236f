"""Which of two policies is better: played from the same starts and seeds, until it is clear.

After every pair of episodes a sequential test is looked at that allows it, so that what is clear
soon costs few episodes.
"""

from collections.abc import Iterator
from contextlib import closing
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro
from tqdm import tqdm

from experiments.kit.command import Output
from experiments.kit.executors import MOST_WORKERS
from experiments.kit.kept_rows import KeptRows
from experiments.kit.robot_task import load_robot_task
from experiments.kit.shipped_data import SHIPPED_TASK
from experiments.simulate.counting import Row, count, counts
from experiments.simulate.episodes import Crew, Job, Setting, Task, draw_starts, outcomes
from experiments.simulate.sequential import Duel
from experiments.simulate.story import scenario_text
from irl.choices import Limits, Settings
from irl.policy import load_policy


@dataclass(frozen=True)
class Config(Settings):
    """Play two policies from the same starts, and stop as soon as it is clear which is better."""

    a: tyro.conf.Positional[Path]
    """The first policy's file."""
    b: tyro.conf.Positional[Path]
    """The second policy's file."""
    by: Literal["success", "actions"] = "success"
    """What makes a policy better: reaching the goal where the other does not, or, where both do,
    needing fewer actions."""
    confidence: Annotated[float, Limits(0.5, 0.9999)] = 0.95
    """How sure the answer must be, for it to be clear."""
    task: Path = SHIPPED_TASK
    """The folder that the task data are read from."""
    starts: Annotated[int | Literal["all"], Limits(1, 1_000_000)] = 100
    """From how many starts to play at most, drawn without repetition; or from all."""
    scenario: str = ""
    """What goes otherwise than usual, for both: the name of a shipped scenario, or a YAML file."""
    decision: Literal["forecast", "table"] = "forecast"
    """What chooses an action: a forecast from the cube's true pose, or the policy's table alone."""
    physics: bool = True
    """Whether to simulate, or else to draw what actions lead to from the forecast's outcomes."""
    max_actions: Annotated[int, Limits(1, 10_000)] = 20
    """After how many actions an episode ends."""
    workers: Annotated[int, Limits(1, MOST_WORKERS)] = 1
    """How many processes play; the answer is the same whatever their number."""
    cluster: str = ""
    """The address of a dask scheduler whose workers play instead, such as tcp://host:8786."""
    seed: int = 0
    """The seed of the starts, of the cube's true poses, and of what a scenario draws."""
    out: Path = Path("out/compare")
    """The folder that the results are written to."""


def winner(by: str, a: Row, b: Row) -> int:
    """Who wins a pair of episodes: 1 the first, −1 the second, 0 neither or not to be said."""
    if not (counts(a) and counts(b)):
        return 0
    if by == "success":
        return int(a["success"]) - int(b["success"])
    if not (a["success"] and b["success"]):
        return 0
    fewer = len(b["actions"]) - len(a["actions"])
    return (fewer > 0) - (fewer < 0)


def main(config: Config, output: Output) -> dict[str, Any]:
    """Play pairs until it is clear, and say which policy is better."""
    task = load_robot_task(config.task)
    for policy in (config.a, config.b):
        load_policy(policy, task.task_hash, task.model.mask)
    common = Setting(
        config.a,
        config.task,
        config.decision,
        physics=config.physics,
        max_actions=config.max_actions,
        scenario=scenario_text(config.scenario),
        seed=config.seed,
    )
    settings = (common, replace(common, policy=config.b))
    starts = [int(start) for start in draw_starts(task, config.starts, config.seed)]
    jobs = [Job(n, start, disturbed=bool(config.scenario)) for n, start in enumerate(starts)]
    crew = Crew(config.workers, config.cluster)
    pairs, duels = duel(config, settings, jobs, crew, output)
    result = results(config, pairs, duels, len(jobs))
    print_results(config, result)
    return result


def duel(
    config: Config,
    settings: tuple[Setting, Setting],
    jobs: list[Job],
    crew: Crew,
    output: Output,
) -> tuple[list[tuple[Row, Row]], dict[str, Duel]]:
    """Play pairs in the order of the jobs until it is clear; what was played is kept.

    Returns:
        The pairs that were judged, and how they stand by success and by actions.
    """
    identity = {
        **{side: each.identity() for side, each in zip("ab", settings, strict=True)},
        "jobs": [list(asdict(job).values()) for job in jobs],
    }
    kept = KeptRows(output, identity)
    found = {(row["side"], row["number"]): row for row in kept.rows}
    duels = {"success": Duel(), "actions": Duel()}
    pairs: list[tuple[Row, Row]] = []

    def judge() -> bool:
        """Judge the pairs that are there, in their order; whether it is clear."""
        while duels[config.by].confidence < config.confidence:
            number = len(pairs)
            if not {(0, number), (1, number)} <= found.keys():
                return False
            pairs.append((found[0, number], found[1, number]))
            for by, each in duels.items():
                duels[by] = each.after(winner(by, *pairs[-1]))
        return True

    def left() -> Iterator[Task]:
        for job in jobs:
            for side, each in enumerate(settings):
                if (side, job.number) not in found:
                    yield each, job, False

    with (
        tqdm(desc="pairs", total=len(jobs), unit="pair") as bar,
        closing(outcomes(left(), crew)) as playing,
    ):
        while not judge():
            bar.update(len(pairs) - bar.n)
            task = next(playing, None)
            if task is None:
                break
            (setting, job, _), outcome = task
            # Where both are one file, the first that ends is the first one's.
            side = settings.index(setting)
            side += settings[0] == settings[1] and (side, job.number) in found
            row = {**outcome.row, "side": int(side)}
            if config.physics:
                kept.add(row)
            found[row["side"], job.number] = row
        bar.update(len(pairs) - bar.n)
    kept.forget()
    return pairs, duels


def results(
    config: Config, pairs: list[tuple[Row, Row]], duels: dict[str, Duel], most: int
) -> dict[str, Any]:
    """What goes into ``result.json``."""
    decisive = duels[config.by]
    clear = decisive.confidence >= config.confidence
    return {
        "better": {1: "a", -1: "b"}.get(decisive.ahead) if clear else None,
        "confidence": decisive.confidence,
        "by": config.by,
        "pairs": len(pairs),
        "pairs_at_most": most,
        **{
            name: {
                "ahead": {1: "a", -1: "b", 0: None}[each.ahead],
                "confidence": each.confidence,
                "a": each.wins,
                "b": each.losses,
                "even": each.even,
            }
            for name, each in duels.items()
        },
        "a": count([a for a, _ in pairs]),
        "b": count([b for _, b in pairs]),
    }


def print_results(config: Config, result: dict[str, Any]) -> None:
    """Tell what was found."""
    told = {"success": "reaches the goal more often", "actions": "needs fewer actions"}[config.by]
    if result["better"] is None:
        print(
            f"after {result['pairs']} pairs it is not clear which policy {told}: "
            f"confidence {result['confidence']:.1%}, wanted {config.confidence:.1%}"
        )
    else:
        policy = {"a": config.a, "b": config.b}[result["better"]]
        print(
            f"{policy} {told}, with confidence {result['confidence']:.1%}, "
            f"after {result['pairs']} of at most {result['pairs_at_most']} pairs"
        )
    for by in ("success", "actions"):
        each = result[by]
        print(f"by {by}: {each['a']} pairs for the first, {each['b']} for the second")
