"""One lesson going on: the desk, the view, the processes beside them, and all windows that look on.

Only the event loop is here: it is the only one that writes the lesson. A window says something by a
message under a token of its own, as often as it takes; it counts once.
"""

import asyncio
from collections.abc import Callable
from typing import Any

from experiments.teach.desk import Desk
from experiments.teach.page import panels
from experiments.teach.page.acting import Acting
from experiments.teach.page.board import Board
from experiments.teach.page.hearing import Hearing
from experiments.teach.page.motions import Motions
from experiments.teach.page.playing import Playing
from experiments.teach.review import in_words, report
from experiments.teach.said import said
from experiments.teach.shown import Shown
from irl.lesson_events import DONE
from models.errors import ModelError
from models.motion.failures import Infeasible

Plain = dict[str, Any]

TICK = 0.05
"""Between two looks at what the learner has to say [s]."""


class Room:
    """What all windows share.

    Attributes:
        desk: the lesson.
        motions: what the view shows.
        playing: the policy played in physics; None where there is no robot.
        acting: the robot's acting by itself.
        note: what is told beside the view; empty if nothing is.
        given: what came of the last answer, as windows show it.
        version: rises whenever something that is shown changed.
    """

    def __init__(
        self, desk: Desk, board: Board, motions: Motions, playing: Playing | None = None
    ) -> None:
        """Open it."""
        self.desk, self.board, self.motions, self.playing = desk, board, motions, playing
        self.acting = Acting(desk, motions, self._say, self._look_again)
        self.note, self.version = "", 0
        self.given: Plain = {}
        self._hearing = Hearing(self)
        self._lookers: set[Callable[[], None]] = set()
        self._made: dict[str, tuple[Any, Any]] = {}
        self._snapshot: tuple[int, Plain] = (-1, {})
        self._policy: Any = None
        self._report: list[str] = []

    def hear(self, message: Plain) -> Plain:
        """Do what a window says, see `Hearing.hear`."""
        return self._hearing.hear(message)

    # --- Windows ----------------------------------------------------------------------------

    def look_on(self, look: Callable[[], None]) -> Callable[[], None]:
        """Call ``look`` whenever something changed; gives what ends that."""
        self._lookers.add(look)
        return lambda: self._lookers.discard(look)

    def changed(self) -> None:
        """Tell all windows."""
        self.version += 1
        for look in list(self._lookers):
            look()

    def snapshot(self) -> Plain:
        """All that is shown, in parts; worked out once for all windows."""
        if self._snapshot[0] != self.version:
            self._snapshot = self.version, self._look()
        return self._snapshot[1]

    def _look(self) -> Plain:
        desk, playing, picture = self.desk, self.playing, self.motions.picture
        asked = None if playing is None else playing.question
        question = asked or desk.question
        count, rounds = len(desk.lesson.events), desk.rounds
        comparing = count, rounds.looking, rounds.looked
        k, leads = rounds.learnt and rounds.learnt.k, desk.asking.leads
        once = self._once
        return {
            "question": question
            and once("question", question, lambda: self.board.question(question, picture)),
            "state": {
                "phase": self._phase(),
                "alone": self.acting.allowed,
                "note": self.note or ("" if playing is None else playing.told),
                "canPlay": playing is not None and desk.policy is not None,
                "acks": list(self._hearing.heard)[-20:],
                "correcting": asked is not None,
                "enough": desk.enough.enough,
                "next": None
                if asked
                else once("next", (count, k, leads, question), lambda: panels.suggested(desk)),
                "leads": leads,
                "holdsOut": desk.config.hold_out,
            },
            "view": self.motions.shown(),
            "panels": {
                "given": self.given,
                "said": once("said", count, lambda: said(desk)),
                "odd": once("odd", comparing, lambda: panels.odd(desk)),
                "clusters": once("clusters", 0, lambda: panels.clusters(desk)),
                "example": desk.world.example,
                "ways": desk.world.ways,
                "report": self._report,
            },
            "progress": once("progress", (count, rounds.running, k), lambda: panels.progress(desk)),
        }

    def _once(self, name: str, key: Any, make: Callable[[], Any]) -> Any:
        """A part that is made anew only where what it depends on changed."""
        if name not in self._made or self._made[name][0] != key:
            self._made[name] = key, make()
        return self._made[name][1]

    def _phase(self) -> str:
        if self.playing is not None and self.playing.phase:
            return self.playing.phase
        if self.acting.is_acting:
            return "acting"
        return "moving" if self.motions.is_moving else "asking"

    # --- Motions ----------------------------------------------------------------------------

    @property
    def shown_question(self) -> Shown | None:
        """The question that windows show."""
        asked = None if self.playing is None else self.playing.question
        return asked or self.desk.question

    def show_question(self) -> None:
        """Show the state of the question, unless a policy plays."""
        if self.playing is None or not self.playing.phase:
            asked = self.desk.question
            if asked is not None:
                self.motions.show(asked.state)

    def _say(self, note: str) -> None:
        self.note = note
        self.changed()

    def _look_again(self) -> None:
        self.show_question()
        self.changed()

    def move(self, state: int, action: int) -> None:
        """The robot does what it was told, while the next question stands there already."""

        def then() -> None:
            self.show_question()
            self.acting.begin()
            self.changed()

        def begin() -> None:
            try:
                self.motions.play(state, action, then)
            except (Infeasible, ModelError) as error:
                self.note = f"the robot finds no way to show it: {error}"
                then()
            self.changed()

        if action == DONE:
            then()
            return
        self.motions.soon(begin)  # the question first: to plan takes a while
        self.changed()

    # --- Time -------------------------------------------------------------------------------

    def tick(self) -> None:
        """Take up what the learner has to say; called when it does, and now and then."""
        news = self.desk.tick()
        if self.desk.policy is not self._policy:
            self._settle()
            news = True
        if news:
            self.changed()

    def _settle(self) -> None:
        """Say what the last answer changed, once something was learnt from it."""
        before, self._policy = self._policy, self.desk.policy
        self._report = in_words(self.desk.world, report(self.desk, odd=False))
        if self.given and "learnt" not in self.given:
            changed = panels.difference(self.desk, before, self.motions.picture)
            self.given = self.given | changed  # another one: what was sent is compared with it

    async def keep_ticking(self) -> None:
        """Look at the learner for ever."""
        while True:
            try:
                self.tick()
            except OSError as error:  # such as a full disk: say so, and try again
                self._say(f"the lesson cannot be written: {error}")
            self.motions.prepare(self.desk.question)
            await asyncio.sleep(TICK)

    def close(self) -> None:
        """End motions."""
        self.acting.end()
        self.motions.stop()
