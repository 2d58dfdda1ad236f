"""Who teaches: a demonstrator, an expert, and what follows from a demonstration by itself."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from irl.demonstrations import Demonstrations
from irl.demonstrators import Demonstrator
from irl.experts import Expert
from irl.generalisation import Generalisation, generalise


@dataclass(frozen=True, eq=False)
class Teacher:
    """All that answers the learner's questions.

    Attributes:
        demonstrator: answers questions about states, with trajectories.
        expert: answers questions about clusters; None if nobody advises.
        generalisation: which pairs follow from a demonstrated one (§5.10.1).
        rules: names of the generalisation's rules to apply; all if None.
        rules_at_end: names of those to apply to a run's last pair; as ``rules`` if None.

    Raises:
        InputError: if there is no rule of one of those names.
    """

    demonstrator: Demonstrator
    expert: Expert | None = None
    generalisation: Generalisation = field(default_factory=Generalisation.none)
    rules: Sequence[str] | None = None
    rules_at_end: Sequence[str] | None = None

    def __post_init__(self) -> None:
        """Check the rules' names, before the first question rather than after it."""
        self.generalisation.rule_indices(self.rules)
        self.generalisation.rule_indices(self.rules_at_end)

    def generalise(self, shown: Demonstrations) -> Demonstrations:
        """``shown`` and what follows from it."""
        if self.rules_at_end is None:
            return generalise(shown, self.generalisation, self.rules)
        return generalise(shown, self.generalisation, self.rules, self.rules_at_end)
