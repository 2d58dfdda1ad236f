"""What stands beside the question: what was settled, what follows, advice, progress, what was said.

Everything is plain values, as JSON has them; the browser shows every word as text.
"""

from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from experiments.teach.asking import WORTH
from experiments.teach.choosing import RUN
from experiments.teach.desk import Desk
from experiments.teach.review import LISTED, the_odd
from experiments.teach.said import answer_in_words, name_of
from experiments.teach.shown import Given, Shown
from experiments.teach.students import LEARNS
from experiments.teach.worlds import World
from irl.asking import TRAJECTORY
from irl.clusters import AND
from irl.lesson_events import DONE, Acted, Answered, Result, Round, hash_of_states
from irl.policy import Policy
from irl.session import START

Plain = dict[str, Any]

PICTURES = 6
"""Of member states, and of what rules will label too, so many are shown."""
AGAINST = 3
"""Of answers that advice about an action may contradict so many are shown, the last ones."""
_CURVES = {
    "predicted_success": "I expect to reach the goal",
    "reached": "I come to where you ended",
    "predicted_accuracy": "I expect to act as you would",
    "changed": "states where I changed my mind",
}


def some(items: Sequence[Any], count: int = PICTURES) -> list[Any]:
    """A few of many, spread evenly."""
    if len(items) <= count:
        return list(items)
    return [items[i] for i in np.linspace(0, len(items) - 1, count).round().astype(int)]


def progress(desk: Desk) -> Plain:
    """How far the learner is: curves over the answers, and questions an episode."""
    answers = rounds = 0
    upto: dict[int, int] = {}
    curves: dict[str, list[tuple[int, float]]] = {name: [] for name in _CURVES}
    asked: Counter[int] = Counter()
    steps: Counter[int] = Counter()
    for event in desk.lesson.events:
        if isinstance(event, Answered):
            answers += 1
            asked[event.trajectory] += 1
            steps[event.trajectory] += 1
        elif isinstance(event, Acted):
            asked[event.trajectory] += 0
            steps[event.trajectory] += 1
        elif isinstance(event, Round):
            upto[event.k] = answers
        elif isinstance(event, Result):
            rounds += 1
            for name, points in curves.items():
                value = event.told.get(name)
                if isinstance(value, int | float):
                    points.append((upto.get(event.k, answers), float(value)))
    enough = desk.enough
    return {
        "answers": answers,
        "rounds": rounds,
        "learning": desk.rounds.running is not None,
        "curves": [
            {"name": _CURVES[name], "points": points} for name, points in curves.items() if points
        ],
        "episodes": [
            {"asked": asked[run], "steps": steps[run]} for run in sorted(steps) if steps[run] > 1
        ],
        "enough": enough.enough,
        "reason": enough.reason,
        "standsIn": enough.stands_in,
        "error": desk.rounds.error,
        "learner": desk.student.method,
        "learns": LEARNS.get(desk.student.method, ""),
    }


def given(
    desk: Desk, asked: Shown, action: int, came: Given, picture: Callable[[int], str]
) -> Plain:
    """What came of an answer: what the learner would have done, and what follows by rules."""
    world = desk.world
    return {
        "number": came.number,
        "words": f"{world.say_action(action)} — {world.say_state(asked.state)}",
        "agreed": asked.proposed == action,
        "had": "" if asked.proposed is None else world.say_action(asked.proposed),
        "sure": asked.sure,
        "waits": desk.learnt is None and desk.rounds.running is None,
        "rules": bool(desk.student.rules),
        "count": len(came.follows),
        "follows": _pictured(world, came.follows, picture),
    }


def difference(desk: Desk, before: Policy | None, picture: Callable[[int], str]) -> Plain:
    """What learning from an answer changed: in words, and some states with the new choice."""
    world, after = desk.world, desk.policy
    if after is None:
        return {}
    if before is None:
        return {"learnt": "Now I have a first idea of what you want.", "changed": []}
    other = np.flatnonzero(before.action != after.action)
    if not other.size:
        return {"learnt": "Having learnt from it, I do everything as before.", "changed": []}
    words = f"Having learnt from it, I do something else in {other.size:,} of {after.action.size:,}"
    # Rather those that it comes by; elsewhere it may waver between what is equally good.
    reasons = desk.asking.reasons
    near = other if reasons is None else np.intersect1d(other, reasons.on_my_way)
    pairs = [(int(s), int(after.action[s])) for s in near if after.action[s] >= 0]
    return {"learnt": f"{words} states.", "changed": _pictured(world, pairs, picture)}


def suggested(desk: Desk) -> Plain | None:
    """What had best be asked now."""
    best, asked = desk.suggestion, desk.question
    if best is None:
        return None
    offer = best.worth.offer
    here = asked is not None and offer.state == asked.state
    begins = asked is not None and not asked.step and asked.strategy in (START, RUN)
    return {
        "words": best.words,
        "cluster": offer.cluster,
        "opens": desk.asking.leads and bool(offer.cluster) and best.worth.gain >= WORTH,
        "asked": here or (offer.kind == TRAJECTORY and begins),
    }


def odd(desk: Desk) -> Plain:
    """Answers at odds with the rest, as far as they hold still, the oddest first."""
    world, rounds, answers = desk.world, desk.rounds, desk.taught.answers
    rows = [
        {
            "number": row["answer"],
            "what": world.say_action(row["action"]),
            "where": world.say_state(row["state"]),
            "action": row["action"],
            "rather": world.say_action(row["likeliest"]),
        }
        for row in the_odd(rounds.odd)
        if row["answer"] in answers and answers[row["answer"]].action == row["action"]
    ]
    return {
        "looking": rounds.looking,
        "looked": rounds.odd is not None,
        "judged": len(rounds.odd or ()),
        "old": rounds.odd is not None and rounds.said_since(rounds.looked),
        "count": len(rows),
        "rows": rows[:LISTED],
    }


def options(desk: Desk, number: int) -> Plain:
    """What an earlier answer may be changed to."""
    answer = desk.taught.answers.get(number)
    if answer is None:
        return {"number": number, "options": []}
    world = desk.world
    feasible = (*world.model.actions_of(answer.state).tolist(), DONE)
    return {"number": number, "options": [{"a": a, "w": world.say_action(a)} for a in feasible]}


def clusters(desk: Desk) -> list[Plain]:
    """What advice may be about."""
    world = desk.world
    return [
        {"name": name, "words": world.cluster_words(name), "count": len(states)}
        for name, states in world.clusters.items()
    ]


def group(desk: Desk, names: Sequence[str], picture: Callable[[int], str]) -> Plain:
    """A cluster or an intersection: how many states, some of them, and what was shown there."""
    world, expression = desk.world, AND.join(names)
    states = desk.members(expression)
    inside = np.zeros(world.model.n_states, dtype=bool)
    inside[states] = True
    acting = states[world.model.widths[states] > 0]
    feasible = np.flatnonzero(world.model.mask[acting].any(axis=0))
    shown: dict[int, list[Plain]] = {int(action): [] for action in feasible}
    for number, answer in reversed(desk.taught.answers.items()):
        if inside[answer.state] and answer.action in shown:
            shown[answer.action].append({"number": number, **answer_in_words(world, answer)})
    last = desk.taught.advice_on(hash_of_states(states))
    return {
        "expression": expression,
        "words": name_of(world, expression),
        "count": int(states.size),
        "pictures": [picture(int(s)) for s in some(states.tolist())],
        "actions": [
            {"a": a, "w": world.say_action(a), "shown": len(rows), "answers": rows[:AGAINST]}
            for a, rows in shown.items()
        ],
        "preferred": [int(a) for a in last.preferred] if last else [],
        "avoided": [int(a) for a in last.avoided] if last else [],
    }


def _pictured(
    world: World, pairs: Sequence[tuple[int, int]], picture: Callable[[int], str]
) -> list[Plain]:
    """Pictures of states and what is done in each, some of many."""
    return [
        {
            "pair": [state, action],
            "picture": picture(state),
            "what": world.say_action(action),
            "where": world.say_state(state),
        }
        for state, action in some(pairs)
    ]
