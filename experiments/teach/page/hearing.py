"""What a window may say, and what is done about it: each message once, by its token."""

from collections import deque
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from experiments.teach.page import panels
from irl.asking import STATE, TRAJECTORY
from irl.errors import InputError
from irl.lesson_events import DONE
from models.errors import ModelError
from models.motion.failures import Infeasible

if TYPE_CHECKING:
    from experiments.teach.page.room import Room

Plain = dict[str, Any]

_DAY = 86400.0
_KEPT = 200  # tokens of messages that were heard


class Hearing:
    """Does in a room what windows say.

    A message has a kind, a token of its own, and what its kind needs: each ``_do_KIND`` takes it
    and gives what only that window wants to know.

    Attributes:
        heard: tokens of the last messages.
    """

    def __init__(self, room: "Room") -> None:
        """Listen in a room."""
        self._room = room
        self._previews = 0
        self.heard: deque[str] = deque(maxlen=_KEPT)

    def hear(self, message: Plain) -> Plain:
        """Do what a window says; what comes of it for that window alone.

        A message that was heard before does nothing. One that cannot be done leaves a note.
        """
        room = self._room
        token, kind = str(message.get("id", "")), str(message.get("kind", ""))
        do = getattr(self, f"_do_{kind}", None)
        if do is None or not token or len(token) > 64:
            return {}
        if token in self.heard:
            room.changed()
            return {}
        room.note = ""
        try:
            reply = do(message, token) or {}
        except (InputError, ModelError, Infeasible) as error:
            reply, room.note = {}, str(error)
        except (KeyError, TypeError, ValueError):
            reply, room.note = {}, "that was no message of this page"
        self.heard.append(token)
        room.changed()
        return reply

    # --- Answers ----------------------------------------------------------------------------

    def _do_answer(self, message: Plain, token: str) -> None:
        room = self._room
        room.acting.end()
        action, question = int(message["action"]), str(message["question"])
        if room.playing is not None and room.playing.question is not None:
            room.playing.correct(question, action)
            return
        asked = room.desk.question
        seconds, previews = _seconds(message), self._previews
        given = room.desk.answer(question, action, seconds=seconds, previews=previews)
        if not given.accepted or asked is None:
            return
        self._previews = 0
        room.given = panels.given(room.desk, asked, action, given, room.motions.picture)
        room.move(asked.state, action)

    def _do_preview(self, message: Plain, token: str) -> None:
        room, action = self._room, int(message["action"])
        room.acting.end()
        asked = room.shown_question
        if asked is None:
            return
        if action == DONE:
            room.motions.show(asked.state)
            return
        self._previews += 1
        room.motions.play(asked.state, action, room.changed)

    def _do_undo(self, message: Plain, token: str) -> None:
        room = self._room
        room.acting.end()
        number = message.get("number")
        if room.desk.undo(token, None if number is None else int(number)) is None:
            room.note = "there is nothing to take back"
        room.given = {}
        room.show_question()

    def _do_edit(self, message: Plain, token: str) -> None:
        self._room.desk.edit(int(message["number"]), int(message["action"]), token)

    def _do_options(self, message: Plain, token: str) -> Plain:
        return {"edited": panels.options(self._room.desk, int(message["number"]))}

    def _do_odd(self, message: Plain, token: str) -> None:
        """Look for answers at odds with the rest."""
        self._room.desk.rounds.look()

    def _do_exclude(self, message: Plain, token: str) -> None:
        room, number = self._room, int(message["number"])
        pairs = [(int(s), int(a)) for s, a in message["pairs"]]
        if room.given.get("number") == number and pairs:
            room.desk.exclude(number, pairs, token)
            room.given = {**room.given, "follows": [], "excluded": len(pairs)}

    # --- What is asked ----------------------------------------------------------------------

    def _do_skip(self, message: Plain, token: str) -> None:
        self._room.desk.skip(str(message["question"]))
        self._ask()

    def _do_another(self, message: Plain, token: str) -> None:
        self._room.desk.another(str(message["question"]))
        self._ask()

    def _do_begin(self, message: Plain, token: str) -> None:
        self._room.desk.begin_run()
        self._ask()

    def _do_ask(self, message: Plain, token: str) -> None:
        """About a state that the teacher picked."""
        self._room.desk.ask(int(message["state"]))
        self._ask()

    def _do_suggested(self, message: Plain, token: str) -> None:
        """What would tell most; advice is for the window to open."""
        desk = self._room.desk
        best = desk.suggestion
        if best is None:
            return
        if best.kind == TRAJECTORY:
            desk.begin_run()
        elif best.kind == STATE and best.worth.offer.state is not None:
            desk.ask(best.worth.offer.state)
        self._ask()

    def _do_lead(self, message: Plain, token: str) -> None:
        """Whether the learner chooses the kind of question."""
        self._room.desk.asking.leads = bool(message["on"])

    def _do_hold_out(self, message: Plain, token: str) -> None:
        """Whether every tenth answer is kept from the learner."""
        desk = self._room.desk
        desk.config = replace(desk.config, hold_out=bool(message["on"]))

    def _ask(self) -> None:
        self._room.acting.end()
        self._room.show_question()

    # --- Advice -----------------------------------------------------------------------------

    def _do_group(self, message: Plain, token: str) -> Plain:
        room = self._room
        names = [str(name) for name in message["names"]][:6]
        return {"group": panels.group(room.desk, names, room.motions.picture) if names else None}

    def _do_advise(self, message: Plain, token: str) -> None:
        room = self._room
        cluster, good, bad = str(message["cluster"]), message["preferred"], message["avoided"]
        given = room.desk.advise(cluster, good, bad, token, seconds=_seconds(message))
        if given.accepted:
            against = len(given.contradicted)
            room.note = f"Advice about {given.states:,} states" + (
                f"; {against} of your answers say{'s' if against == 1 else ''} otherwise"
                if against
                else ""
            )

    # --- Acting and playing -----------------------------------------------------------------

    def _do_alone(self, message: Plain, token: str) -> None:
        acting = self._room.acting
        acting.allowed = bool(message["on"])
        if not acting.allowed and acting.is_acting:
            self._ask()

    def _do_on(self, message: Plain, token: str) -> None:
        """Go on to the goal without asking."""
        room = self._room
        if room.desk.policy is None:
            room.note = "I have learnt nothing yet that I could go on by"
            return
        room.acting.begin(told=True)

    def _do_play(self, message: Plain, token: str) -> None:
        room = self._room
        if room.playing is not None:
            room.acting.end()
            room.playing.toggle()

    def _do_pause(self, message: Plain, token: str) -> None:
        if self._room.playing is not None:
            self._room.playing.pause()

    def _do_stop(self, message: Plain, token: str) -> None:
        if self._room.playing is not None:
            self._room.playing.stop()
        self._ask()


def _seconds(message: Plain) -> float:
    seconds = float(message.get("seconds", 0.0))
    # A clock that was set meanwhile, or no number at all, tells nothing.
    return seconds if 0.0 <= seconds <= _DAY else 0.0
