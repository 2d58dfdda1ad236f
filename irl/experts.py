"""Who answers the learner's questions about clusters: experts.

The oracle advises what is optimal under a hidden reward; the learner sees only its answers.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from irl.choices import check_range
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

    def _counted(self, states: np.ndarray) -> np.ndarray:
        return np.asarray(states)[self._eligible[states]]

    def optimal_in(self, states: np.ndarray) -> np.ndarray:
        """Co-optimal actions of those states that count; bool ``[n, n_actions]``."""
        return self.demonstrator.optimal_actions[self._counted(states)]

    def advise(self, cluster: str, states: np.ndarray) -> ClusterAdvice:
        """Preferred and avoided actions for a cluster; none of either if no state counts."""
        feasible = self.demonstrator.model.mask[self._counted(states)].sum(axis=0)
        optimal = self.optimal_in(states).sum(axis=0)
        used = feasible > 0
        share = optimal / np.maximum(feasible, 1)
        return ClusterAdvice(
            preferred=frozenset(np.flatnonzero(used & (share >= self.prefer_share)).tolist()),
            avoided=frozenset(np.flatnonzero(used & (share <= self.avoid_share)).tolist()),
        )


@dataclass(frozen=True, eq=False)
class MistakenExpert:
    """An oracle's expert some of whose answers are wrong, after Kunapuli et al. (2013).

    A wrong answer wants avoided what is right somewhere in the cluster, each such action with
    probability 1/2; it prefers one action that the expert would have avoided, and says nothing
    else.

    Attributes:
        expert: who would be right.
        wrong: probability that an answer is wrong.
        rng: draws which are, and what they say.
    """

    expert: OracleExpert
    wrong: float
    rng: np.random.Generator

    def __post_init__(self) -> None:
        """Check the probability.

        Raises:
            InputError: if ``wrong`` is outside [0, 1].
        """
        check_range("expert: wrong", self.wrong, 0, 1)

    def advise(self, cluster: str, states: np.ndarray) -> ClusterAdvice:
        """As `OracleExpert`, or wrong."""
        answer, rng = self.expert.advise(cluster, states), self.rng
        if rng.random() >= self.wrong:
            return answer
        right = np.flatnonzero(self.expert.optimal_in(states).any(axis=0))
        avoided = sorted(answer.avoided)
        return ClusterAdvice(
            preferred=frozenset({int(rng.choice(avoided))} if avoided else ()),
            avoided=frozenset(right[rng.random(right.size) < 1 / 2].tolist()),
        )
