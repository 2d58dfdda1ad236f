"""A lesson in the terminal: questions in words, answers by number or by a word or two."""

import time
from collections.abc import Sequence

from experiments.teach.desk import Desk
from experiments.teach.said import said
from experiments.teach.shell.commands import QUIT, Command, check, parsed, perform, settle
from experiments.teach.shown import Shown
from experiments.teach.worlds import World
from irl.errors import InputError
from irl.lesson_events import DONE, hash_of_states

HELP = """\
Enter        the marked choice          1 2 3    the learner's favourites
d            done: nothing to do here   a        all that can be done here, with numbers
a17          the action of that number  words    the one action whose words hold these
u            take the last thing back   s, n     put aside, for good or for now
r            a new trajectory
prefer C: N… avoid C: N…                advice for a cluster, such as: avoid grasped: 12 13
clusters     their names                w        why this question
said         what you said, with numbers
edit K: …    the answer of that number was another, such as: edit 7: drop
undo K       takes back what was said under that number
{…}          any line of a script
q            end the lesson"""


def teach(desk: Desk) -> None:
    """Ask until the teacher ends the lesson, by ``q`` or by the end of input."""
    print(f"{desk.world.name}; {desk.student.method} learns\n{HELP}")
    said_enough = False
    while desk.question is not None:
        desk.tick()
        if desk.enough.enough and not said_enough:
            said_enough = True
            print(f"\nI have learnt enough, because {desk.enough.reason}.\nGo on, or end with q.")
        asked = desk.question
        show(desk, asked)
        began = time.monotonic()
        try:
            line = input("> ").strip()
        except EOFError:
            break
        try:
            command = understood(desk, asked, line)
            if command is None:
                continue
            if command.get("do") == QUIT:
                break
            if ("action" in command and "do" not in command) or command.get("do") == "advise":
                command = {**command, "seconds": time.monotonic() - began}
            check(command, "answer")
            print(f"  {perform(desk, command)}")
        except InputError as error:
            print(f"  {error}")
    settle(desk)


def show(desk: Desk, asked: Shown) -> None:
    """Print a question."""
    world = desk.world
    kind = {"audit": "a test", "learn": asked.strategy}.get(asked.purpose, asked.strategy)
    print(f"\n[{len(desk.taught.answers)} answers; {kind}] {asked.words}")
    for k, action in enumerate(asked.top, start=1):
        mark = "▸" if action == asked.proposed else " "
        print(f" {mark} {k}  {world.say_action(action)}")
    if asked.proposed is not None and asked.proposed not in asked.top:
        print(f" ▸    {world.say_action(asked.proposed)}")
    suggestion = desk.suggestion
    if suggestion is not None:
        print(f"  {suggestion.words}")


def understood(desk: Desk, asked: Shown, line: str) -> Command | None:
    """The command that a typed line is; None if it only wanted to see something.

    Raises:
        InputError: if it is none.
    """
    world, plain = desk.world, line.lower()
    if plain in ("a", "w", "clusters", "said", "?", "h"):
        print(_looked_up(desk, asked, plain))
        return None
    simple: dict[str, Command] = {
        "": {"action": "proposed"},
        "d": {"action": "done"},
        "u": {"do": "undo"},
        "s": {"do": "skip"},
        "n": {"do": "another"},
        "r": {"do": "run"},
        "q": {"do": QUIT},
    }
    if plain in simple:
        return simple[plain]
    if plain.startswith("{"):
        return parsed(line, "answer")
    first, _, rest = plain.partition(" ")
    if first in ("prefer", "avoid") and ":" in rest:
        return _advice(desk, first, line.partition(" ")[2])
    number, colon, words = rest.partition(":")
    if first == "edit" and colon and number.strip().isdigit():
        answer = desk.taught.answers.get(int(number))
        if answer is None:
            raise InputError(f"no answer {number.strip()} holds; said lists them", place=line[:40])
        choices = world.model.actions_of(answer.state).tolist()
        return {"do": "edit", "answer": int(number), "action": _action(world, choices, words)}
    if first == "undo" and rest.isdigit():
        return {"do": "undo", "number": int(rest)}
    if plain.isdigit() and 1 <= int(plain) <= len(asked.top):
        return {"action": asked.top[int(plain) - 1]}
    return {"action": _action(world, asked.feasible, plain)}


def _advice(desk: Desk, verb: str, said: str) -> Command:
    """Advice; what was said of the other side of the cluster before stays."""
    name, _, numbers = said.partition(":")
    cluster = name.strip()
    if not all(word.isdigit() for word in numbers.split()):
        raise InputError("numbers of actions wanted after the colon", place=said[:40])
    actions = [*map(int, numbers.split())]
    last = desk.taught.advice_on(hash_of_states(desk.members(cluster)))
    sides = {
        "prefer": [] if last is None else last.preferred,
        "avoid": [] if last is None else last.avoided,
    }
    kept = {side: [a for a in before if a not in actions] for side, before in sides.items()}
    kept[verb] = actions
    return {
        "do": "advise",
        "cluster": cluster,
        "preferred": kept["prefer"],
        "avoided": kept["avoid"],
    }


def _action(world: World, feasible: Sequence[int], said: str) -> int:
    """An action by its number, such as ``a17``, or by words that only it has.

    Raises:
        InputError: if these words are those of none, or of several.
    """
    parts = said.lower().split()
    if len(parts) == 1 and parts[0][0] == "a" and parts[0][1:].isdigit():
        return int(parts[0][1:])
    if parts == ["d"]:
        return DONE
    choices = [*feasible, DONE]
    found = [a for a in choices if all(part in world.say_action(a).lower() for part in parts)]
    if len(found) != 1:
        told = ", ".join(world.say_action(a) for a in found[:4])
        raise InputError(
            f"{len(found)} actions have these words{f': {told}…' if found else ''}",
            place=said[:40],
        )
    return found[0]


def _looked_up(desk: Desk, asked: Shown, what: str) -> str:
    world = desk.world
    if what == "a":
        return "\n".join(f"  a{a:<3} {world.say_action(a)}" for a in asked.feasible)
    if what == "said":
        return "\n".join(
            f"  {each['number']:<5} {each['what']} · {each['where']}" for each in said(desk)
        )
    if what == "clusters":
        return "\n".join(
            f"  {name:<20} {world.cluster_words(name)} ({len(states)})"
            for name, states in world.clusters.items()
        )
    if what == "w":
        why = asked.why
        bars = (("doubt", why.doubt), ("on my way", why.visited), ("new to me", why.new))
        lines = [f"  {name:<10} {'█' * round(20 * share):<20} {share:.0%}" for name, share in bars]
        return "\n".join([f"  {why.words}", *lines])
    return HELP
