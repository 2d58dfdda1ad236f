"""A question as the page shows it: moves as a map of each layer, turns by kind, and why not.

Everything is plain values, as JSON has them; the browser shows every word as text.
"""

from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np

from experiments.kit.shipped_data import load_feasibility
from experiments.teach.shown import Shown
from experiments.teach.worlds import World
from irl.lesson_events import AUDIT, DONE, HELD_OUT
from models.task.spaces import (
    GRID_X,
    GRID_Y,
    HORIZONTAL,
    LOST,
    POSITIONS,
    R_WG,
    TILTED,
    VERTICAL,
    Action,
    Kind,
    State,
)
from models.task.words import describe_gripper

Plain = dict[str, Any]

EDGES = (("robot",), ("right", "front", "left"))
"""Above and below a map: where the robot is, and what the words of states call the other sides."""
PURPOSES = {
    AUDIT: "a test: would this be right?",
    HELD_OUT: "held out, to judge by",
}


class Board:
    """Lays out what can be done in a state of a world."""

    def __init__(self, world: World, why_not: Callable[[int, int], str]) -> None:
        """Lay out a world's actions.

        Args:
            world: what is taught.
            why_not: why an action cannot be done in a state, in a few words.
        """
        self._world, self._why_not = world, why_not

    def question(self, asked: Shown, picture: Callable[[int], str]) -> Plain:
        """All that is shown of a question."""
        words = asked.words.split("; ")
        why = asked.why
        return {
            "token": asked.token,
            "state": asked.state,
            "words": words,
            "picture": picture(asked.state),
            "purpose": PURPOSES.get(asked.purpose, ""),
            "step": asked.step,
            "why": {
                "words": why.words,
                "bars": [
                    {"name": "how unsure I am", "share": why.doubt},
                    {"name": "how often I come by", "share": why.visited},
                    {"name": "how new it is to me", "share": why.new},
                ],
            },
            "favourite": asked.proposed,
            "top": [{"a": a, "w": self._world.say_action(a)} for a in asked.top],
            "groups": self.groups(asked.state, set(asked.feasible)),
        }

    def groups(self, state: int, feasible: set[int]) -> list[Plain]:
        """The actions by kind, with the reason where one cannot be done."""

        def option(action: int, short: str) -> Plain:
            ok = action == DONE or action in feasible
            return {
                "a": action,
                "t": short,
                "w": self._world.say_action(action),
                "no": "" if ok else self._why_not(state, action),
            }

        done: Plain = {"name": "", "rows": [[option(DONE, "nothing to do here")]]}
        if self._world.model.n_actions == len(_ARROWS):
            arrows = [[None, _UP, None], [_LEFT, None, _RIGHT], [None, _DOWN, None]]
            rows = [[a if a is None else option(a, _ARROWS[a]) for a in row] for row in arrows]
            return [{"name": "move", "rows": rows, "map": True}, done]
        held = state != LOST and State.from_index(state).is_grasp
        here = -1 if state == LOST else State.from_index(state).position
        maps = [_map(layer, here, option) for layer in (0, 1)]
        hands = [_hands(Kind.GRASP, option), _hands(Kind.ROTATE, option)]
        drop = option(Action(Kind.DROP).index, "let go")
        done["rows"][0].insert(0, drop)
        # What suits the state comes first and open; the other kind is there, and says why not.
        hands = hands[::-1] if held else hands
        hands[1]["folded"] = True
        return [*maps, *hands, done]


_RIGHT, _UP, _LEFT, _DOWN = range(4)
_ARROWS = ("→", "↑", "←", "↓")


def _map(layer: int, here: int, option: Callable[[int, str], Plain]) -> Plain:
    """Nine cells as one sees them from in front of the robot: its back is far, its left right."""
    rows = []
    for x in GRID_X:
        row = []
        for y in GRID_Y:
            (cell,) = np.flatnonzero(
                (POSITIONS[:, 0] == x) & (POSITIONS[:, 1] == y) & (np.arange(18) % 2 == layer)
            )
            each = option(Action(Kind.TRANSLATE, int(cell)).index, "")
            row.append(each | {"here": int(cell) == here})
        rows.append(row)
    name = f"carry: {('lower', 'upper')[layer]} layer"
    return {"name": name, "rows": rows, "map": True, "edges": EDGES}


def _hands(kind: Kind, option: Callable[[int, str], Plain]) -> Plain:
    """Hands from above, tilted and level, each from the robot's right to its left."""
    rows = []
    for some in (VERTICAL, TILTED, HORIZONTAL):
        order = list(some) if some is VERTICAL else sorted(some, key=lambda g: R_WG[g][1, 2])
        row = []
        for gripper in order:
            said = describe_gripper(gripper)
            angle = said.rpartition("turned ")[2]
            short = angle if some is VERTICAL else said.rpartition(", ")[2]
            row.append(option(Action(kind, gripper).index, short))
        rows.append(row)
    name = "grasp" if kind == Kind.GRASP else "turn the hand"
    return {"name": name, "rows": rows, "labels": ["from above", "tilted", "level"]}


class RobotReasons:
    """Why the robot cannot do something, as far as its feasible actions tell."""

    @cached_property
    def _feasibility(self) -> Any:
        return load_feasibility()

    def __call__(self, state: int, action: int) -> str:
        """In a few words."""
        if state == LOST:
            return "the cube is lost"
        parts, asked = State.from_index(state), Action.from_index(action)
        if parts.gripper is None and asked.kind != Kind.GRASP:
            return "the hand is empty"
        if parts.gripper is not None and asked.kind == Kind.GRASP:
            return "the hand holds the cube already"
        if asked.target is None:
            return "there is no room to open the fingers"
        held = self._feasibility.held
        if parts.gripper is None:
            if not held[parts.position, asked.target]:
                return "the arm does not reach there with the hand so"
            return "the hand would touch something"
        if asked.kind == Kind.TRANSLATE:
            there = (asked.target, parts.gripper)
        else:
            there = (parts.position, asked.target)
        if there == (parts.position, parts.gripper):
            return "it is there already"
        if not held[there]:
            return "the arm does not reach there with the hand so"
        return "there is no way without touching something"


def grid_reasons(state: int, action: int) -> str:
    """Why a move on the grid cannot be made."""
    del state, action
    return "the grid ends there"
