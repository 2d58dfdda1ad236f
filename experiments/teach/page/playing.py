"""A policy plays in physics; a teacher looks on, stops it, corrects it, and hands back."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from diagrams.decisions import held_goal
from diagrams.state_view import Posture
from experiments.teach.desk import Desk
from experiments.teach.page.link import Link
from experiments.teach.page.motions import RobotMotions
from experiments.teach.page.player import work
from experiments.teach.shown import Shown
from irl.lesson_events import DONE
from irl.session import Question
from models.task.spaces import LOST, N_FREE

DOUBT = 0.5
"""Below this probability that its choice will do, a playing policy asks."""
STARTING, PLAYING, PAUSING, PAUSED, DOUBTS = (
    *("starting", "playing", "pausing", "paused", "in doubt"),
)


class Playing:
    """Plays one episode at a time.

    Attributes:
        phase: one of the above; empty while nothing is played.
        question: what the teacher is asked, while the policy waits.
        told: what came of the last episode, in words.
        moved: is called when the view changed from outside, by a picture.
    """

    def __init__(self, desk: Desk, motions: RobotMotions, changed: Callable[[], None]) -> None:
        """Play policies of a desk, on its view.

        Args:
            desk: the lesson, for policies and corrections.
            motions: what the view shows.
            changed: is called when something but the view did.
        """
        self._desk, self._motions, self._changed = desk, motions, changed
        self._link = Link(work, (), self._hear, self._begun)
        self._step = -1
        self._correction: int | None = None
        self.phase, self.told = "", ""
        self.question: Shown | None = None

    @property
    def link(self) -> Link:
        """The way to the process."""
        return self._link

    def toggle(self) -> None:
        """Play; or pause what plays; or hand back what is paused."""
        if not self.phase:
            self._play()
        elif self.phase == PLAYING:
            self.pause()
        elif self.phase in (PAUSED, DOUBTS):
            self.question, self._correction, self.phase = None, None, PLAYING
            self._link.tell(-1)
        elif self.phase == PAUSING:
            self.phase = PLAYING

    def pause(self) -> None:
        """Stop before the next action."""
        if self.phase == PLAYING:
            self.phase = PAUSING

    def stop(self) -> None:
        """End the episode; while an action is under way, the process is begun anew."""
        if not self.phase:
            return
        if self.question is not None:
            self._link.tell(None)
        elif self._link.pid is not None:
            self._link.restart()
        self._end("stopped")

    def correct(self, token: str, action: int) -> None:
        """Do something else in the state where the policy waits; that is a demonstration."""
        asked = self.question
        if asked is None or token != asked.token:
            return
        number = self._desk.correct(asked.state, action, token, self._correction)
        if number is None:
            return
        self.question = None
        if action == DONE:
            self._link.tell(None)
            self._end("you said that nothing is left to do")
            return
        if self.phase == DOUBTS:
            self.phase, self._correction = PLAYING, None
        else:
            self._correction = number
        self._link.tell(action)

    def _play(self) -> None:
        policy = self._desk.policy
        if policy is None:
            return
        asked = self._desk.question
        start = self._desk.asking.start()
        if asked is not None and asked.state < N_FREE:
            start = asked.state
        self.phase, self.told, self._correction = STARTING, "", None
        if self._link.pid is None:
            self._link.start()
        seed = len(self._desk.lesson.events)
        self._link.tell((start, seed, policy.q, np.array([held_goal(policy)])))

    def _begun(self) -> None:
        """A process that died took its episode with it."""
        if self._link.starts > 1 and self.phase:
            self._end("the simulation ended by itself")

    def _end(self, told: str) -> None:
        self.phase, self.question, self.told = "", None, told
        self._changed()

    def _hear(self, message: tuple[Any, ...]) -> None:
        if not self.phase:
            return  # of an episode that was stopped
        kind, *rest = message
        if kind == "posture":
            q, width, R_WO, p_WO = rest
            if self.phase == STARTING:
                self.phase = PLAYING
                self._changed()
            X_WO = RigidTransform(RotationMatrix(R_WO), p_WO)
            self._motions.frame(Posture(q, width, X_WO))
        elif kind == "decides":
            self._decide(int(rest[0]))
        elif kind == "step":
            _, action, _, failure = rest
            self._motions.caption = failure or self._desk.world.say_action(action)
            self._changed()
        elif kind == "over":
            verdict, success = rest
            self._end("it reached what I take for the goal" if success else f"it ended: {verdict}")
        elif kind == "fault":
            self._end(f"the simulator failed: {rest[0]}")

    def _decide(self, state: int) -> None:
        """The policy is about to choose: let it, or ask."""
        asking, learnt = self._desk.asking, self._desk.learnt
        doubts = state != LOST and learnt is not None and float(learnt.sure[state]) < DOUBT
        if state == LOST or not self._desk.world.model.widths[state]:
            self._link.tell(-1)
            return
        if self.phase == PLAYING and doubts:
            self.phase = DOUBTS
        if self.phase not in (PAUSING, PAUSED, DOUBTS):
            self._link.tell(-1)
            return
        if self.phase == PAUSING:
            self.phase = PAUSED
        shown = asking.shown(0, asking.event(Question(state, "correction", 0.0)))
        words = "You took over. What should I do from here?"
        if self.phase == DOUBTS:
            words = "I am in doubt here. What should I do?"
        self.question = replace(shown, why=replace(shown.why, words=words))
        self._changed()
