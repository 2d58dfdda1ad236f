"""Who answers the learner's questions about clusters: experts.

The oracle advises what is optimal under a hidden reward; the learner sees only its answers.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from irl.demonstrators import OracleDemonstrator
from irl.errors import InputError


@dataclass(frozen=True)
class ClusterAdvice:
    """Action preferences for a cluster of states; an action is in one set at most (3.8).

    Attributes:
        preferred: actions to benefit.
        avoided: actions to exclude.
        cluster: the cluster that this is about, if not the one asked for: its name, or an
            intersection such as ``"a ∩ b"`` (§5.11).
    """

    preferred: frozenset[int] = frozenset()
    avoided: frozenset[int] = frozenset()
    cluster: str | None = None

    def __post_init__(self) -> None:
        """Check (3.8).

        Raises:
            InputError: if an action is both preferred and avoided.
        """
        both = sorted(self.preferred & self.avoided)
        if both:
            raise InputError(f"advice: actions {both} are both preferred and avoided; choose one")


class Expert(Protocol):
    """Knows what to do, or not to do, throughout a cluster."""

    def advise(self, cluster: str, states: np.ndarray) -> ClusterAdvice:
        """Advice for the cluster of that name, holding the states of those indices."""
        ...


@dataclass(frozen=True, eq=False)
class OracleExpert:
    """Advises what is optimal by an oracle's plan over a cluster.

    Every state counts alike, of those that can be reached and where a run goes on. An action is
    judged on the states where it is feasible.

    Attributes:
        demonstrator: whose co-optimal actions are the measure.
        starts: indices of the states runs start in.
        prefer_share: an action co-optimal in at least this share of its states is preferred.
        avoid_share: an action co-optimal in at most this share of its states is avoided. Since
            avoiding excludes, anything above 0 may exclude a state's only good action.
    """

    demonstrator: OracleDemonstrator
    starts: np.ndarray
    prefer_share: float = 0.8
    avoid_share: float = 0.0

    def __post_init__(self) -> None:
        """Check the shares.

        Raises:
            InputError: unless 0 ≤ ``avoid_share`` < ``prefer_share`` ≤ 1.
        """
        if not 0 <= self.avoid_share < self.prefer_share <= 1:
            raise InputError(
                "expert: 0 ≤ avoid_share < prefer_share ≤ 1 wanted, got "
                f"{self.avoid_share} and {self.prefer_share}"
            )

    @cached_property
    def _eligible(self) -> np.ndarray:
        return self.demonstrator.model.reachable(self.starts) & ~self.demonstrator.terminal

    def advise(self, cluster: str, states: np.ndarray) -> ClusterAdvice:
        """Preferred and avoided actions for a cluster; none of either if no state counts."""
        counted = np.asarray(states)[self._eligible[states]]
        feasible = self.demonstrator.model.mask[counted].sum(axis=0)
        optimal = self.demonstrator.optimal_actions[counted].sum(axis=0)
        used = feasible > 0
        share = optimal / np.maximum(feasible, 1)
        return ClusterAdvice(
            preferred=frozenset(np.flatnonzero(used & (share >= self.prefer_share)).tolist()),
            avoided=frozenset(np.flatnonzero(used & (share <= self.avoid_share)).tolist()),
        )
