"""What was said of the learner's own proposals, told apart from labels.

A label is the demonstrator's choice among equally good actions. A proposal that was let pass is the
learner's: to take it for a label would call it evidence that the demonstrator has a preference. And
a proposal that was refused says of an action that it is not as good, which no label does.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from irl.demonstrations import Demonstrations


@dataclass(frozen=True, eq=False)
class Verdicts:
    """Proposals, and whether each was let pass.

    Attributes:
        state: int64 ``[n]``, and the ``action`` proposed there.
        action: see there.
        passed: bool ``[n]``, whether the answer was the action that was proposed.
    """

    state: np.ndarray
    action: np.ndarray
    passed: np.ndarray

    @classmethod
    def apart(
        cls, shown: Demonstrations, proposals: Mapping[int, int]
    ) -> tuple[Demonstrations, "Verdicts"]:
        """Labels, and verdicts.

        What is done in place of a refused proposal is a label besides.

        Args:
            shown: all demonstrations.
            proposals: by the number of the run that an answer is, the action proposed.
        """
        runs = np.array(list(proposals), dtype=np.int64)
        answers = np.isin(shown.trajectory, runs) & ~shown.generalised
        proposed = [proposals[run] for run in shown.trajectory[answers].tolist()]
        action = np.array(proposed, dtype=np.int64)
        passed = shown.action[answers] == action
        label = ~answers
        label[answers] = ~passed
        return shown.select(label), cls(shown.state[answers], action, passed)
