"""The robot acts alone while it is sure, and asks in doubt."""

import asyncio
from collections.abc import Callable

from experiments.teach.asking import EPISODE, SURE
from experiments.teach.desk import Desk
from experiments.teach.page.motions import Motions
from experiments.teach.shown import Shown
from irl.lesson_events import AUDIT, DONE
from models.errors import ModelError
from models.motion.failures import Infeasible

_MOST = 40  # actions in one go
_PAUSE = 0.8  # at what it takes for the goal [s]


class Acting:
    """Goes on with an episode by itself, in the model, with its motions in the view.

    Attributes:
        allowed: whether it may, without being told to.
    """

    def __init__(
        self,
        desk: Desk,
        motions: Motions,
        say: Callable[[str], None],
        over: Callable[[], None],
    ) -> None:
        """Act in the episodes of a desk.

        Args:
            desk: the lesson.
            motions: what the view shows.
            say: is told what it does, in words.
            over: is called when it does nothing more.
        """
        self._desk, self._motions, self._say, self._over = desk, motions, say, over
        self._task: asyncio.Task | None = None
        self.allowed = True

    @property
    def is_acting(self) -> bool:
        """Whether it is acting."""
        return self._task is not None and not self._task.done()

    def begin(self, *, told: bool = False) -> bool:
        """Act on, if it may or was ``told`` to; whether it does."""
        self.end()
        asked = self._desk.question
        if asked is None or not (told or self._goes_without_saying(asked)):
            return False
        self._task = asyncio.get_running_loop().create_task(self._act(told))
        return True

    def end(self) -> None:
        """Stop."""
        if self._task is not None:
            self._task.cancel()
            self._task = None

    def _goes_without_saying(self, asked: Shown) -> bool:
        return bool(
            self.allowed
            and asked.strategy == EPISODE
            and asked.purpose != AUDIT
            and asked.proposed is not None
            and asked.sure >= SURE
        )

    async def _act(self, told: bool) -> None:
        """Until in doubt, unless it was told to, or at the goal."""
        goal = self._motions.held_goal(self._desk)
        for _ in range(_MOST):
            asked = self._desk.question
            if asked is None or not (told or self._goes_without_saying(asked)):
                break
            if asked.state == goal or asked.proposed in (None, DONE):
                self._say("I think that is it, so I stopped here")
                await asyncio.sleep(_PAUSE)
                self._desk.another(asked.token)
                break
            action = int(asked.proposed)
            try:
                self._motions.play(asked.state, action)
            except (Infeasible, ModelError) as error:
                self._say(f"I find no way: {error}")
                break
            self._say(f"on my own: {self._desk.world.say_action(action)}")
            await self._motions.wait()
            if not self._desk.act(asked.token).accepted:
                break
        self._task = None
        self._over()
