"""Which kind of question is worth most of the teacher's time: its gain and its price."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from experiments.teach.shown import Reasons
from experiments.teach.worlds import World
from irl.asking import (
    ADVICE,
    STATE,
    STEP,
    TRAJECTORY,
    Offer,
    Worth,
    choose,
    measured_seconds,
)
from irl.lesson import Lesson
from irl.lesson_events import Asked
from irl.lesson_taught import Taught
from irl.session import START

RUN = "run"
"""Strategy of a question that begins a trajectory, after the first."""
_FEW = 0.05  # bits below which nobody wants to know how many
SUGGESTED = {
    STEP: "to go on from here",
    STATE: "one state by itself",
    TRAJECTORY: "a new trajectory from a start",
    ADVICE: "advice where {}",
}


@dataclass(frozen=True)
class Suggestion:
    """What had best be asked next, and that in words."""

    worth: Worth
    words: str

    @property
    def kind(self) -> str:
        """A name in `irl.asking.KINDS`."""
        return self.worth.offer.kind

    @property
    def cluster(self) -> str:
        """What advice is wanted about; empty if it is none that is wanted."""
        return self.worth.offer.cluster


@dataclass(frozen=True)
class Choosing:
    """Prices what may be asked in a lesson, by what it took this teacher so far.

    Attributes:
        world: what is taught.
        lesson: the file, which is only read.
        taught: what was said so far.
    """

    world: World
    lesson: Lesson
    taught: Taught

    def best(
        self,
        reasons: Reasons,
        states: Sequence[int],
        *,
        step: int | None = None,
        advice: bool = True,
    ) -> Suggestion | None:
        """What tells most for each second of the teacher; None if nothing tells anything.

        A new trajectory is always among what is compared.

        Args:
            reasons: what is known of gains, after a round.
            states: that could be asked about by themselves.
            step: the state where the episode goes on, if one does.
            advice: whether advice may be wanted, about clusters without any.
        """
        offers = []
        if step is not None:
            offers.append(Offer(STEP, reasons.gain(np.array([step])), state=step))
        offers += [Offer(STATE, reasons.gain(np.array([s])), state=s) for s in states]
        offers.append(Offer(TRAJECTORY, reasons.gain(reasons.on_my_way), self._usual_length()))
        if advice:
            advised = {each.cluster for each in self.taught.advised}
            offers += [
                Offer(ADVICE, reasons.gain(members), cluster=name)
                for name, members in self.world.clusters.items()
                if name not in advised
            ]
        worth = choose(offers, measured_seconds(self._times()), reasons.left)
        return None if worth is None else Suggestion(worth, self._said(worth))

    def _said(self, worth: Worth) -> str:
        offer = worth.offer
        where = self.world.cluster_words(offer.cluster) if offer.cluster else ""
        what = SUGGESTED[offer.kind].format(where)
        bits = worth.gain / np.log(2)
        told = f"{bits:.2g}" if bits >= _FEW else f"less than {_FEW}"
        return f"What tells me most for your time: {what} ({told} bits in {worth.seconds:.0f} s)."

    def _times(self) -> list[tuple[str, float]]:
        """Kind and seconds of all that was said and holds."""
        whole = {
            event.trajectory
            for event in self.lesson.events
            if isinstance(event, Asked) and event.step == 0 and event.strategy in (START, RUN)
        }
        times = [
            (STEP if a.step else TRAJECTORY if a.trajectory in whole else STATE, a.seconds)
            for a in self.taught.answers.values()
        ]
        return times + [(ADVICE, each.seconds) for each in self.taught.advised]

    def _usual_length(self) -> int:
        """Answers that a trajectory takes: the median of those with more than one."""
        runs = Counter(a.trajectory for a in self.taught.answers.values())
        return int(np.median([n for n in runs.values() if n > 1] or [1]))
