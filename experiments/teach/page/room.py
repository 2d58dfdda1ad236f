"""One lesson going on: the desk, the view, the processes beside them, and all windows that look on.

Only the event loop is here: it is the only one that writes the lesson. A window says something by a
message under a token of its own, as often as it takes; it counts once.
"""

import asyncio
from collections import deque
from collections.abc import Callable
from typing import Any

from experiments.teach.desk import Desk
from experiments.teach.page import panels
from experiments.teach.page.acting import Acting
from experiments.teach.page.board import Board
from experiments.teach.page.motions import Motions
from experiments.teach.page.playing import Playing
from irl.errors import InputError
from irl.lesson_events import DONE
from models.errors import ModelError
from models.motion.failures import Infeasible

Plain = dict[str, Any]

TICK = 0.05
"""Between two looks at what the learner has to say [s]."""
_DAY = 86400.0
_KEPT = 200  # tokens of messages that were heard


class Room:
    """What all windows share.

    Attributes:
        desk: the lesson.
        motions: what the view shows.
        playing: the policy played in physics; None where there is no robot.
        acting: the robot's acting by itself.
        version: rises whenever something that is shown changed.
    """

    def __init__(
        self, desk: Desk, board: Board, motions: Motions, playing: Playing | None = None
    ) -> None:
        """Open it."""
        self.desk, self.board, self.motions, self.playing = desk, board, motions, playing
        self.acting = Acting(desk, motions, self._say, self._look_again)
        self.version = 0
        self._lookers: set[Callable[[], None]] = set()
        self._heard: deque[str] = deque(maxlen=_KEPT)
        self._given: Plain = {}
        self._note = ""
        self._previews = 0
        self._progressed: tuple[Any, Plain] = (None, {})
        self._snapshot: tuple[int, Plain] = (-1, {})
        self._policy: Any = None

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
        desk, playing = self.desk, self.playing
        asked = None if playing is None else playing.question
        question, suggestion = asked or desk.question, desk.suggestion
        return {
            "question": None
            if question is None
            else self.board.question(question, self.motions.picture),
            "state": {
                "phase": self._phase(),
                "alone": self.acting.allowed,
                "note": self._note or ("" if playing is None else playing.told),
                "canPlay": playing is not None and desk.policy is not None,
                "acks": list(self._heard)[-20:],
                "correcting": asked is not None,
                "next": "" if suggestion is None or asked else suggestion.words,
            },
            "view": self.motions.shown(),
            "panels": {
                "given": self._given,
                "said": panels.said(desk),
                "clusters": panels.clusters(desk),
            },
            "progress": self._progress(),
        }

    def _progress(self) -> Plain:
        learnt = self.desk.learnt
        key = (len(self.desk.lesson.events), self.desk.rounds.running, learnt and learnt.k)
        if key != self._progressed[0]:
            self._progressed = key, panels.progress(self.desk)
        return self._progressed[1]

    def _phase(self) -> str:
        if self.playing is not None and self.playing.phase:
            return self.playing.phase
        if self.acting.is_acting:
            return "acting"
        return "moving" if self.motions.is_moving else "asking"

    # --- Messages ---------------------------------------------------------------------------

    def hear(self, message: Plain) -> Plain:
        """Do what a window says; what comes of it for that window alone.

        A message that was heard before does nothing. One that cannot be done leaves a note.
        """
        token, kind = str(message.get("id", "")), str(message.get("kind", ""))
        do = getattr(self, f"_do_{kind}", None)
        if do is None or not token or len(token) > 64:
            return {}
        if token in self._heard:
            self.changed()
            return {}
        self._note = ""
        try:
            reply = do(message, token) or {}
        except (InputError, ModelError, Infeasible) as error:
            reply, self._note = {}, str(error)
        except (KeyError, TypeError, ValueError):
            reply, self._note = {}, "that was no message of this page"
        self._heard.append(token)
        self.changed()
        return reply

    def _do_answer(self, message: Plain, token: str) -> None:
        self.acting.end()
        action, question = int(message["action"]), str(message["question"])
        playing = self.playing
        if playing is not None and playing.question is not None:
            playing.correct(question, action)
            return
        asked = self.desk.question
        seconds, previews = _seconds(message), self._previews
        given = self.desk.answer(question, action, seconds=seconds, previews=previews)
        if not given.accepted or asked is None:
            return
        self._previews = 0
        world = self.desk.world
        what, where = world.say_action(action), world.say_state(asked.state)
        self._given = {
            "number": given.number,
            "words": f"{what} — {where}",
            "agreed": asked.proposed == action,
            "had": "" if asked.proposed is None else world.say_action(asked.proposed),
            "sure": asked.sure,
            "count": len(given.follows),
            "follows": panels.follows(world, given.follows, self.motions.picture),
        }
        self._move(asked.state, action)

    def _do_preview(self, message: Plain, token: str) -> None:
        self.acting.end()
        asked = self._shown_question()
        action = int(message["action"])
        if asked is None:
            return
        if action == DONE:
            self.motions.show(asked.state)
            return
        self._previews += 1
        self.motions.play(asked.state, action, self.changed)

    def _do_undo(self, message: Plain, token: str) -> None:
        self.acting.end()
        if self.desk.undo(token) is None:
            self._note = "there is nothing to take back"
        self._given = {}
        self._show_question()

    def _do_edit(self, message: Plain, token: str) -> None:
        self.desk.edit(int(message["number"]), int(message["action"]), token)

    def _do_options(self, message: Plain, token: str) -> Plain:
        return {"edited": panels.options(self.desk, int(message["number"]))}

    def _do_skip(self, message: Plain, token: str) -> None:
        self.acting.end()
        self.desk.skip(str(message["question"]))
        self._show_question()

    def _do_another(self, message: Plain, token: str) -> None:
        self.acting.end()
        self.desk.another(str(message["question"]))
        self._show_question()

    def _do_begin(self, message: Plain, token: str) -> None:
        self.acting.end()
        self.desk.begin_run()
        self._show_question()

    def _do_alone(self, message: Plain, token: str) -> None:
        self.acting.allowed = bool(message["on"])
        if not self.acting.allowed:
            self.acting.end()

    def _do_on(self, message: Plain, token: str) -> None:
        """Go on to the goal without asking."""
        if self.desk.policy is None:
            self._note = "I have learnt nothing yet that I could go on by"
            return
        self.acting.begin(told=True)

    def _do_exclude(self, message: Plain, token: str) -> None:
        pairs = [(int(s), int(a)) for s, a in message["pairs"]]
        if self._given.get("number") == int(message["number"]) and pairs:
            self.desk.exclude(int(message["number"]), pairs, token)
            self._given = {**self._given, "follows": [], "excluded": len(pairs)}

    def _do_group(self, message: Plain, token: str) -> Plain:
        names = [str(name) for name in message["names"]][:6]
        return {"group": panels.group(self.desk, names, self.motions.picture) if names else None}

    def _do_advise(self, message: Plain, token: str) -> None:
        cluster, good, bad = str(message["cluster"]), message["preferred"], message["avoided"]
        given = self.desk.advise(cluster, good, bad, token, seconds=_seconds(message))
        if given.accepted:
            against = len(given.contradicted)
            self._note = f"Advice about {given.states:,} states" + (
                f"; {against} of your answers say otherwise" if against else ""
            )

    def _do_play(self, message: Plain, token: str) -> None:
        if self.playing is not None:
            self.acting.end()
            self.playing.toggle()

    def _do_pause(self, message: Plain, token: str) -> None:
        if self.playing is not None:
            self.playing.pause()

    def _do_stop(self, message: Plain, token: str) -> None:
        self.acting.end()
        if self.playing is not None:
            self.playing.stop()
        self._show_question()

    # --- Motions ----------------------------------------------------------------------------

    def _shown_question(self) -> Any:
        asked = None if self.playing is None else self.playing.question
        return asked or self.desk.question

    def _show_question(self) -> None:
        if self.playing is None or not self.playing.phase:
            asked = self.desk.question
            if asked is not None:
                self.motions.show(asked.state)

    def _say(self, note: str) -> None:
        self._note = note
        self.changed()

    def _look_again(self) -> None:
        self._show_question()
        self.changed()

    def _move(self, state: int, action: int) -> None:
        """The robot does what it was told, while the next question stands there already."""

        def then() -> None:
            self._show_question()
            self.acting.begin()
            self.changed()

        self.changed()  # the question first
        if action == DONE:
            then()
            return
        try:
            self.motions.play(state, action, then)
        except (Infeasible, ModelError) as error:
            self._note = f"the robot finds no way to show it: {error}"
            then()

    # --- Time -------------------------------------------------------------------------------

    def tick(self) -> None:
        """Take up what the learner has to say; called when it does, and now and then."""
        if self.desk.tick():
            if self.desk.policy is not self._policy:
                self._settle()
            self.changed()

    def _settle(self) -> None:
        """Say what the last answer changed, once something was learnt from it."""
        before, self._policy = self._policy, self.desk.policy
        if self._given and "learnt" not in self._given and before is not None:
            self._given = self._given | {"learnt": panels.difference(before, self._policy)}

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


def _seconds(message: Plain) -> float:
    seconds = float(message.get("seconds", 0.0))
    # A clock that was set meanwhile, or no number at all, tells nothing.
    return seconds if 0.0 <= seconds <= _DAY else 0.0
