"""Files that come into a lesson before it goes on, and those that it leaves."""

from pathlib import Path
from typing import Any

from experiments.kit.command import Output
from experiments.teach.desk import Desk
from irl.lesson import Lesson
from irl.lesson_exchange import demonstrations_of, read_advice, read_demonstrations, save_advice
from irl.lesson_merge import Conflict, merge

DEMONSTRATIONS, ADVICE = "demonstrations.csv", "advice.json"


def take_in(
    desk: Desk, demonstrations: Path | None, advice: Path | None, other: Path | None
) -> list[Conflict]:
    """Take demonstrations, advice and another lesson into this one; list where they contradict.

    Raises:
        InputError: if one cannot be read, is about another task, or holds what cannot be done.
    """
    world, lesson = desk.world, desk.lesson
    if demonstrations is not None:
        desk.take([read_demonstrations(demonstrations, world.model, lesson)])
    if advice is not None:
        task_hash, n_actions = world.subject.task_hash, world.model.n_actions
        desk.take([read_advice(advice, task_hash, world.clusters, n_actions)])
    if other is None:
        return []
    with Lesson(other, writable=False) as there:
        merged = merge(lesson, there, world.clusters)
    desk.take(merged.events)
    print(f"{len(merged.conflicts)} contradictions with {other}; none is decided")
    for conflict in merged.conflicts:
        print(f"  {said(desk, conflict)}")
    return merged.conflicts


def said(desk: Desk, conflict: Conflict) -> str:
    """A contradiction in words."""

    def listed(actions: tuple[int, ...]) -> str:
        return ", ".join(map(desk.world.say_action, actions)) or "not that"

    here, there = listed(conflict.here), listed(conflict.there)
    told = f"{conflict.kind}, {conflict.about}: {here} here, {there} there; {conflict.remedy}"
    return told


def export(desk: Desk, output: Output) -> None:
    """Leave demonstrations and advice of the lesson in the output folder."""
    with output.file(DEMONSTRATIONS) as path:
        demonstrations_of(desk.lesson).save(path)
    with output.file(ADVICE) as path:
        save_advice(desk.lesson, path)


def plain(conflicts: list[Conflict]) -> list[dict[str, Any]]:
    """Contradictions as a result holds them."""
    return [vars(each) for each in conflicts]
