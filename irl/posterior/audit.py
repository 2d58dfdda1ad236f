"""Trials held out: the learner says what it would do in states that it did not choose.

A posterior that holds no hypothesis like the truth may be sure, and wrong: a cost without a name is
explained by costs that have one wherever the learner chose to ask, and where several actions look
equally good, no label contradicts that they are. So in states that it did not choose
(`irl.posterior.audit_states`) it says what it would do, and is told whether that will do or what
would. It learns from none of the answers before the audit is over. Being corrected twice in one
state, for the first may be a slip, contradicts it.
"""

from dataclasses import dataclass, field

LENGTHS = 13, 15, 18
"""States without a contradiction that confirm a learner: one that was never contradicted, one that
was once and has learnt from it, and one that was more often."""
_TWICE = 2


@dataclass
class Audit:
    """What held-out answers have said so far.

    Attributes:
        wanted: states without a contradiction that confirm.
        passed: for each state whether each answer let the learner's proposal pass; one answer, or
            two if the first did not.
    """

    wanted: int = LENGTHS[0]
    passed: dict[int, list[bool]] = field(default_factory=dict)

    @classmethod
    def after(cls, mistaken: int) -> "Audit":
        """One that begins after so many that contradicted."""
        return cls(LENGTHS[min(mistaken, len(LENGTHS) - 1)])

    def compare(self, state: int, passed: bool) -> None:
        """Take up one answer."""
        self.passed.setdefault(state, []).append(passed)

    @property
    def again(self) -> int | None:
        """A state whose only answer contradicts, to be asked again; None if there is none."""
        once = [s for s, passed in self.passed.items() if passed == [False]]
        return once[0] if once else None

    @property
    def contradicted(self) -> bool:
        """Whether both of two answers in a state contradict: the learner has not understood."""
        return any(len(p) >= _TWICE and not any(p) for p in self.passed.values())

    @property
    def confirmed(self) -> bool:
        """Whether the learner has understood.

        One that is right in four states of five comes through with probability 0.05, and in 99 of a
        hundred with 0.88.
        """
        return len(self.passed) >= self.wanted and self.again is None and not self.contradicted
