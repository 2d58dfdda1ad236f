"""What a few states can see of a transition model: their pairs and successors, compacted.

Likelihood and Bellman terms touch only a small part of the state space. Cutting that part
out once makes an iteration cost as much as the demonstrations, however many states there are.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse

from irl.groups import Groups
from irl.mdp import TransitionModel


@dataclass(frozen=True)
class Neighbourhood:
    """The feasible pairs of ``states``, grouped by state, and the states they may lead to.

    Attributes:
        states: int64 ``[m]``, each with at least one feasible pair.
        rows: int64 ``[n_pairs]``: the pairs' rows in the transition model.
        groups: the pairs by state: group k holds the pairs of ``states[k]``.
        visible: int64 ``[u]``, ascending: every successor (and every further state asked for).
        P: CSR ``[n_pairs, u]``: the transition probabilities, columns as in ``visible``.
        pinned: int64 ``[k]``: positions in ``visible`` whose VR value is known beforehand.
        pinned_value: float64 ``[k]``: those values.
    """

    states: np.ndarray
    rows: np.ndarray
    groups: Groups
    visible: np.ndarray
    P: sparse.csr_matrix
    pinned: np.ndarray
    pinned_value: np.ndarray

    @classmethod
    def of(
        cls,
        model: TransitionModel,
        states: np.ndarray,
        fixed_vr: Mapping[int, float],
        *,
        include_states: bool = False,
        cautious: bool = False,
    ) -> "Neighbourhood":
        """Cut out the neighbourhood of ``states`` (distinct, none without a feasible pair).

        With ``include_states`` the states themselves are visible too, successors or not. A
        ``cautious`` one sees a pseudo-state besides, numbered ``n_states`` and so the last: every
        pair leads there with the weight ``model.surprise``, and its f is −u, u a dislike of
        uncertain outcomes.
        """
        states = np.asarray(states, dtype=np.int64)
        begin = model.first_pair[states]
        groups = Groups.of_widths(model.first_pair[states + 1] - begin)
        rows = np.arange(groups.size) + groups.spread(begin - groups.first)
        P = model.P[rows]
        # Sorting what is seen, not marking it among all states, whose number must not matter.
        asked_for = np.concatenate([P.indices, states if include_states else states[:0]])
        visible, column = np.unique(asked_for, return_inverse=True)
        visible = visible.astype(np.int64)
        compact = sparse.csr_matrix(
            (P.data, column[: P.indices.size].astype(P.indices.dtype), P.indptr),
            shape=(rows.size, visible.size),
        )
        if cautious:
            surprise = sparse.csr_matrix(model.surprise[rows, np.newaxis])
            compact = sparse.hstack([compact, surprise], format="csr")
            visible = np.append(visible, model.n_states)
        fixed = np.array(list(fixed_vr), dtype=np.int64)
        fixed_value = np.array(list(fixed_vr.values()), dtype=np.float64)
        position = np.searchsorted(visible, fixed)
        known = visible[np.minimum(position, visible.size - 1)] == fixed
        return cls(
            states=states,
            rows=rows,
            groups=groups,
            visible=visible,
            P=compact,
            pinned=position[known],
            pinned_value=fixed_value[known],
        )

    @cached_property
    def P_transposed(self) -> sparse.csr_matrix:
        """CSR ``[u, n_pairs]``: carries gradients from pairs back to states."""
        return self.P.T.tocsr()

    def arrays(self) -> tuple[np.ndarray, ...]:
        """Everything it consists of, for a fingerprint."""
        P = (self.P.data, self.P.indices, self.P.indptr)
        return (self.states, self.groups.first, self.visible, *P, self.pinned, self.pinned_value)

    def pin(self, f: np.ndarray) -> np.ndarray:
        """Copy f ``[u]`` as float64, pinned states at their known values."""
        f = np.array(f, dtype=np.float64)
        f[self.pinned] = self.pinned_value
        return f

    def position(self, states: np.ndarray) -> np.ndarray:
        """Where each of the given states, all visible, stands in ``visible``."""
        return np.searchsorted(self.visible, states)
