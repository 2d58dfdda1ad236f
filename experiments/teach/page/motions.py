"""What the view shows: a state, or a motion that plays while everything else goes on.

Only the event loop touches it. All windows look at the same.
"""

import asyncio
from abc import ABC, abstractmethod
from collections import OrderedDict
from collections.abc import Callable
from contextlib import suppress
from time import monotonic
from typing import Any

from diagrams.decisions import held_goal
from diagrams.state_view import FRAME, Posture, Preview, Viewer
from experiments.teach.desk import Desk
from experiments.teach.page.pictures import picture
from experiments.teach.shown import Shown
from experiments.teach.worlds import World
from irl.lesson_events import DONE
from models.errors import ModelError
from models.motion.failures import Infeasible

Plain = dict[str, Any]
Then = Callable[[], None]

_PLANNED = 8  # previews that are kept
_MOVE = 0.25  # of a move on the grid [s]
_TOLD = 0.02  # in which the page is told what changed [s]


def _nothing() -> None:
    pass


class Motions(ABC):
    """Motions on some view.

    Attributes:
        caption: what moves, in words.
        odds: probabilities of the outcomes that the end is held beside; empty unless a toss-up.
    """

    def __init__(self) -> None:
        """Nothing moves."""
        self.caption = self.odds = ""
        self._motion: asyncio.Task | None = None

    @property
    def is_moving(self) -> bool:
        """Whether a motion is under way."""
        return self._motion is not None and not self._motion.done()

    def stop(self) -> None:
        """End the motion where it is."""
        if self._motion is not None:
            self._motion.cancel()
            self._motion = None

    async def wait(self) -> None:
        """Wait until the motion that is under way has ended, if one is."""
        if self._motion is not None:
            await asyncio.wait([self._motion])

    def soon(self, begin: Then) -> None:
        """Begin a motion once the page has been told of whatever changed; that counts as moving."""

        async def wait() -> None:
            await asyncio.sleep(_TOLD)
            self._motion = None
            begin()

        self.stop()
        self._motion = asyncio.get_running_loop().create_task(wait())

    def show(self, state: int) -> None:
        """Show a state, in place of whatever was shown."""
        self.stop()
        self.caption = self.odds = ""
        self._show(state)

    @abstractmethod
    def play(self, state: int, action: int, then: Then = _nothing) -> None:
        """Start a motion; its end is held, beside what may come of it.

        Args:
            state: where it starts.
            action: what is done.
            then: called when it has ended by itself.

        Raises:
            Infeasible: if there is no such motion.
        """

    @abstractmethod
    def shown(self) -> Plain:
        """What a window needs to know of the view."""

    @abstractmethod
    def picture(self, state: int) -> str:
        """A small picture of a state, an SVG element."""

    @abstractmethod
    def held_goal(self, desk: Desk) -> int:
        """The state that the learner takes for the goal; −1 if it takes none."""

    @abstractmethod
    def prepare(self, asked: Shown | None) -> None:
        """Get ready for what may be looked at next."""

    @abstractmethod
    def _show(self, state: int) -> None: ...


class RobotMotions(Motions):
    """The robot's, on a `Viewer`."""

    def __init__(self, viewer: Viewer, world: World) -> None:
        """Show on a viewer."""
        super().__init__()
        self._viewer, self._world = viewer, world
        self._planned: OrderedDict[tuple[int, int], Preview] = OrderedDict()

    def play(self, state: int, action: int, then: Then = _nothing) -> None:
        """Start a motion, at twice the robot's speed."""
        preview = self._plan(state, action)
        self.stop()
        self.caption, self.odds = self._world.say_action(action), preview.odds
        self._viewer.ghosts(())
        self._motion = asyncio.get_running_loop().create_task(self._play(preview, then))

    def frame(self, posture: Posture) -> None:
        """Show one picture of what somebody else moves."""
        if self.is_moving:
            self.stop()
        self._viewer.pose(posture)

    def shown(self) -> Plain:
        """What moves, and the odds."""
        return {"kind": "robot", "caption": self.caption, "odds": self.odds}

    def picture(self, state: int) -> str:
        """Cube, hand and columns."""
        return picture(state)

    def held_goal(self, desk: Desk) -> int:
        """Where the drop leads that is valued most."""
        if desk.policy is None:
            return -1
        try:
            return held_goal(desk.policy)
        except ModelError:
            return -1

    def prepare(self, asked: Shown | None) -> None:
        """Plan what the policy would do."""
        if asked is None or self.is_moving:
            return
        favourite = asked.proposed if asked.proposed is not None else DONE
        for action in dict.fromkeys((favourite, *asked.top)):
            if action != DONE and (asked.state, action) not in self._planned:
                with suppress(Infeasible, ModelError):
                    self._plan(asked.state, action)
                return  # one at a time: the page goes first

    def _plan(self, state: int, action: int) -> Preview:
        key = (state, action)
        if key not in self._planned:
            self._planned[key] = self._viewer.preview(state, action)
        self._planned.move_to_end(key)
        while len(self._planned) > _PLANNED:
            self._planned.popitem(last=False)
        return self._planned[key]

    def _show(self, state: int) -> None:
        with suppress(ModelError):  # one that the arm cannot get to is told in words alone
            self._viewer.show(state)

    async def _play(self, preview: Preview, then: Then) -> None:
        began = monotonic() - FRAME  # what it begins with need not be drawn once more
        while (now := monotonic() - began) < preview.duration:
            self._viewer.pose(preview.at(now))
            await asyncio.sleep(FRAME)
        self._viewer.pose(preview.at(preview.duration))
        self._viewer.ghosts([state for state, _ in preview.outcomes])
        self._motion = None
        then()


class GridMotions(Motions):
    """A mark that moves on a grid, which the window draws."""

    def __init__(self, world: World, changed: Then) -> None:
        """Show a world of cells; ``changed`` is called when the mark moved."""
        super().__init__()
        self._world, self._changed = world, changed
        self._at, self._ghost = -1, -1
        self._desk: Desk | None = None
        self._n = round(world.model.n_states**0.5)

    def look_at(self, desk: Desk) -> None:
        """Draw what a desk's learner knows."""
        self._desk = desk

    def play(self, state: int, action: int, then: Then = _nothing) -> None:
        """Move the mark, and hold it there."""
        self.stop()
        self._at, self._ghost = state, self._after(state, action)
        self._motion = asyncio.get_running_loop().create_task(self._play(then))
        self._changed()

    def shown(self) -> Plain:
        """The cells: the mark, what was shown, and the policy."""
        desk = self._desk
        policy = None if desk is None else desk.policy
        answers = [] if desk is None else desk.taught.answers.values()
        return {
            "kind": "grid",
            "n": self._n,
            "at": self._at,
            "ghost": self._ghost,
            "policy": None if policy is None else policy.action.tolist(),
            "sure": None
            if desk is None or desk.learnt is None
            else [round(float(p), 2) for p in desk.learnt.sure],
            "shown": {str(answer.state): answer.action for answer in answers},
            "caption": "",
            "odds": "",
        }

    def picture(self, state: int) -> str:
        """The grid with one cell marked."""
        n = self._n
        y, x = divmod(state, n)
        return (
            f'<svg viewBox="0 0 {n} {n}" class="state-picture grid-picture">'
            f'<rect width="{n}" height="{n}" fill="#efe4cd"/>'
            f'<rect x="{x}" y="{n - 1 - y}" width="1" height="1" fill="#2961d1"/></svg>'
        )

    def held_goal(self, desk: Desk) -> int:
        """None: on the grid the learner says where it would stop."""
        return -1

    def prepare(self, asked: Shown | None) -> None:
        """There is nothing to get ready."""

    def _show(self, state: int) -> None:
        self._at, self._ghost = state, -1

    def _after(self, state: int, action: int) -> int:
        if action == DONE:
            return state
        model = self._world.model
        row = model.P[[int(model.pair_index(state, action))]]
        return int(row.indices[row.data.argmax()])

    async def _play(self, then: Then) -> None:
        await asyncio.sleep(_MOVE / 2)
        self._at, self._ghost = self._ghost, -1
        self._changed()
        await asyncio.sleep(_MOVE)
        self._motion = None
        then()
