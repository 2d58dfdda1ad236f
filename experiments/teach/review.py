"""What a lesson looks like afterwards: contradictions, odd answers, coverage, time, and a check.

Answers held out are compared with the policy, as the thesis' validation set is: nobody learnt from
them.
"""

from dataclasses import dataclass
from itertools import chain
from typing import Any

import numpy as np

from experiments.teach.desk import Desk
from experiments.teach.worlds import World
from irl.clusters import intersection
from irl.lesson import Lesson
from irl.lesson_events import AUDIT, HELD_OUT, Answered
from irl.lesson_exchange import demonstrations_of
from irl.lesson_taught import Taught
from irl.metrics import Share
from irl.policy import Policy
from irl.student import StudentConfig

LISTED = 10
"""Odd answers and contradictions that are told, at most."""
ODD = 0.1
"""An answer so much less likely than the likeliest one, by the rest, is at odds with it."""


@dataclass(frozen=True, eq=False)
class Record:
    """A lesson that is only looked at: what a report reads of a desk.

    Attributes:
        world: what was taught.
        lesson: the file.
        student: the learner's settings.
        taught: what was said.
        policy: what was learnt; None if nothing was.
    """

    world: World
    lesson: Lesson
    student: StudentConfig
    taught: Taught
    policy: Policy | None

    def members(self, cluster: str) -> np.ndarray:
        """The states of a cluster, or of an intersection."""
        return intersection(self.world.clusters, cluster)


def report(desk: Desk | Record, *, odd: bool = True) -> dict[str, Any]:
    """Everything that is told of a lesson, as plain values.

    Args:
        desk: the lesson.
        odd: whether to find the answers that are at odds with the rest, for which a learner learns
            all of them anew; else ``at_odds`` is None.
    """
    answers = desk.taught.answers
    return {
        "answers": len(answers),
        "contradictions": contradictions(desk),
        "at_odds": at_odds(desk) if odd else None,
        "coverage": coverage(desk),
        "seconds": times(list(answers.values())),
        "held_out": held_out(desk),
        "tested": tested(list(answers.values())),
    }


def contradictions(desk: Desk | Record) -> list[dict[str, Any]]:
    """States with several answers, and answers that advice is against."""
    by_state: dict[int, dict[int, list[int]]] = {}
    for number, answer in desk.taught.answers.items():
        by_state.setdefault(answer.state, {}).setdefault(answer.action, []).append(number)
    found: list[dict[str, Any]] = [
        {"kind": "answers", "state": state, "actions": actions, "answers": sorted(chain(*given))}
        for state, said in sorted(by_state.items())
        if len(said) > 1
        for actions, given in [(sorted(said), said.values())]
    ]
    for piece in desk.taught.advised:
        inside = set(desk.members(piece.cluster).tolist())
        for number, answer in desk.taught.answers.items():
            if answer.state in inside and answer.action in piece.avoided:
                found.append(
                    {
                        "kind": "advice",
                        "cluster": piece.cluster,
                        "state": answer.state,
                        "actions": [answer.action],
                        "answers": [number],
                    }
                )
    return found


def at_odds(desk: Desk | Record) -> list[dict[str, Any]]:
    """All answers, the oddest first: each one's likelihood by the rest (`irl.lesson_odds`)."""
    # Torch, which a server that leaves learning to another process does without.
    from irl.lesson_odds import at_odds as of_lesson  # noqa: PLC0415

    rng = np.random.default_rng(desk.student.seed)
    return of_lesson(desk.world.subject.problem, desk.lesson.initial, desk.taught, rng)


def the_odd(rows: list[dict[str, Any]] | None) -> list[dict[str, Any]]:
    """Of answers with their odds those that are at odds with the rest."""
    return [row for row in rows or () if row["ratio"] < ODD]


def coverage(desk: Desk | Record) -> dict[str, Any]:
    """How much of what can be got to was shown: states, and values of each factor."""
    world = desk.world
    reached = np.flatnonzero(world.reached & (world.model.widths > 0))
    shown = demonstrations_of(desk.lesson)
    states = np.intersect1d(np.union1d(shown.state, shown.ends[:, 2]), reached)
    factors = {
        name: [int(np.unique(values[states]).size), int(np.unique(values[reached]).size)]
        for name, values in world.subject.problem.factors.items()
    }
    return {
        "states": int(states.size),
        "share": states.size / max(reached.size, 1),
        "factors": factors,
        "trajectories": int(np.unique([*shown.trajectory, *shown.ends[:, 0]]).size),
    }


def times(answers: list[Answered]) -> dict[str, float] | None:
    """Seconds an answer took."""
    taken = [answer.seconds for answer in answers if answer.seconds > 0]
    if not taken:
        return None
    return {
        "median": float(np.median(taken)),
        "p90": float(np.quantile(taken, 0.9)),
        "total": float(np.sum(taken)),
        "previews": int(sum(answer.previews for answer in answers)),
    }


def held_out(desk: Desk | Record) -> dict[str, Any] | None:
    """How often the policy does what was answered, over answers that it never saw."""
    answers = [a for a in desk.taught.answers.values() if a.purpose == HELD_OUT]
    if desk.policy is None or not answers:
        return None
    same = sum(int(desk.policy.action[a.state]) == a.action for a in answers)
    return _share(same, len(answers))


def tested(answers: list[Answered]) -> dict[str, Any] | None:
    """How often the learner's proposal passed, in states that it did not choose, to test it."""
    tests = [answer for answer in answers if answer.purpose == AUDIT]
    if not tests:
        return None
    return _share(sum(a.preselected == a.action for a in tests), len(tests))


def _share(successes: int, trials: int) -> dict[str, Any]:
    share = Share(successes, trials)
    return {"agreed": successes, "answers": trials, "interval": list(share.interval)}


def show_report(world: World, told: dict[str, Any]) -> None:
    """Print a report."""
    for line in in_words(world, told):
        print(line)


def in_words(world: World, told: dict[str, Any]) -> list[str]:
    """A report, line by line."""
    seen = told["coverage"]
    parts = ", ".join(f"{name} {n} of {of}" for name, (n, of) in seen["factors"].items())
    lines = [
        f"{told['answers']} answers in {seen['trajectories']} trajectories; {seen['states']:,} "
        f"states shown, {seen['share']:.2%} of those that can be got to",
        f"of what states have in common: {parts}",
    ]
    if told["seconds"]:
        lines.append(
            "an answer took {median:.1f} s, one in ten above {p90:.1f} s".format(**told["seconds"])
        )
    for name, words in (
        ("held_out", "held out, the policy does"),
        ("tested", "of a test, it said"),
    ):
        if told[name]:
            low, high = told[name]["interval"]
            lines.append(
                f"{told[name]['agreed']} of {told[name]['answers']} answers {words} "
                f"[{low:.0%}, {high:.0%}]"
            )
    for row in told["contradictions"][:LISTED]:
        actions = " / ".join(map(world.say_action, row["actions"]))
        lines.append(f"contradiction ({row['kind']}), {world.say_state(row['state'])}: {actions}")
    odd = the_odd(told["at_odds"])
    if odd:
        lines.append(f"{len(odd)} answers are at odds with the rest; the oddest:")
    lines += [
        f"  answer {row['answer']}: {world.say_state(row['state'])} → "
        f"{world.say_action(row['action'])} ({row['ratio']:.1e} as likely as "
        f"{world.say_action(row['likeliest'])})"
        for row in odd[:LISTED]
    ]
    return lines
