"""What a teacher said and what holds of it, in words: the page and the terminal list it."""

from typing import Any

from experiments.teach.desk import Desk
from experiments.teach.worlds import World
from irl.clusters import AND
from irl.lesson_events import (
    Acted,
    Advised,
    Answered,
    Cluster,
    Event,
    Excluded,
    Imported,
    Skipped,
    Undo,
)
from irl.lesson_standing import stands

Plain = dict[str, Any]

LAST = 40
"""So many of the last things said are shown."""


def said(desk: Desk) -> list[Plain]:
    """The last things said that hold, newest first.

    Each has the ``number`` of its event, ``what`` and ``where``; an answer also its ``action``,
    advice the ``names`` of the clusters that it is about. What is neither may be taken ``back``.
    """
    told: list[Plain] = []
    undone = {event.of for event in desk.lesson.events if isinstance(event, Undo)}
    standing = stands(desk.lesson.events)
    for number in range(len(desk.lesson.events), 0, -1):
        if number in undone:
            continue
        event = standing.get(number, desk.lesson.events[number - 1])
        told += [{"number": number, **words} for words in _words(desk.world, event)]
        if len(told) >= LAST:
            break
    return told[:LAST]


def answer_in_words(world: World, answer: Answered) -> Plain:
    """What was answered, and where."""
    return {
        "what": world.say_action(answer.action),
        "where": world.say_state(answer.state),
        "action": answer.action,
        "note": "" if answer.purpose == "learn" else answer.purpose.replace("_", " "),
    }


def advice_in_words(world: World, advice: Advised) -> Plain:
    """What was advised, and of which states."""
    parts = [("prefer", advice.preferred), ("avoid", advice.avoided)]
    told = [f"{verb} {', '.join(map(world.say_action, some))}" for verb, some in parts if some]
    return {
        "what": "; ".join(told) or "no advice",
        "where": name_of(world, advice.cluster),
        "names": advice.cluster.split(AND),
    }


def name_of(world: World, cluster: str) -> str:
    """A cluster, or an intersection, in words."""
    return ", and ".join(world.cluster_words(part) for part in cluster.split(AND))


def _words(world: World, event: Event) -> list[Plain]:
    rows: list[Plain] = []
    match event:
        case Answered():
            return [answer_in_words(world, event)]
        case Acted():
            what = f"{world.say_action(event.action)} (on my own)"
            return [{"what": what, "where": world.say_state(event.state)}]
        case Advised():
            return [advice_in_words(world, event)]
        case Cluster():
            told = {"what": "a new group of states", "where": name_of(world, event.cluster)}
        case Excluded():
            told = {"what": f"{len(event.pairs)} that do not follow", "where": "from an answer"}
        case Skipped():
            told = {"what": "skipped", "where": world.say_state(event.state)}
        case Imported():
            told = {"what": "taken from a file", "where": event.source}
            advice = [advice_in_words(world, Advised(*piece)) for piece in event.advice]
            rows = [{**piece, "note": event.source} for piece in advice]
        case _:
            return []
    return [*rows, {**told, "back": True}]
