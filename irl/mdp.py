"""The transition model: a sparse Markov decision process without its reward.

Only feasible pairs (s, a) have rows, so what the robot cannot do is absent rather than
worth zero: softmax, entropy and argmax run over each state's own actions.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse

from irl.choices import check_range
from irl.errors import InputError
from irl.groups import Groups, alike
from irl.integers import reals, unmasked
from irl.pairs import pair_key, split_key


@dataclass(frozen=True)
class TransitionModel:
    """P(s' | s, a) over feasible pairs, the pairs sorted by state, then action.

    Attributes:
        n_states: number of states.
        n_actions: number of actions.
        pair_state: int32 ``[n_pairs]``.
        pair_action: int32 ``[n_pairs]``.
        P: CSR matrix ``[n_pairs, n_states]``; each row sums to 1.
    """

    n_states: int
    n_actions: int
    pair_state: np.ndarray
    pair_action: np.ndarray
    P: sparse.csr_matrix

    @classmethod
    def from_entries(
        cls,
        n_states: int,
        n_actions: int,
        state: np.ndarray,
        action: np.ndarray,
        next_state: np.ndarray,
        probability: np.ndarray,
    ) -> "TransitionModel":
        """Build from parallel arrays, one entry per (s, a, s'), in any order.

        Raises:
            InputError: if shapes differ, an index is out of range, a probability is not
                finite and positive, an entry occurs twice, or a pair's probabilities do not
                sum to 1 within 1e-9.
        """
        place = "transitions"
        arrays = {
            "state": unmasked(state, f"{place}: field 'state'"),
            "action": unmasked(action, f"{place}: field 'action'"),
            "next_state": unmasked(next_state, f"{place}: field 'next_state'"),
            "probability": reals(probability, f"{place}: field 'probability'"),
        }
        shapes = {name: array.shape for name, array in arrays.items()}
        if len(set(shapes.values())) != 1 or arrays["state"].ndim != 1:
            raise InputError(
                f"one-dimensional arrays of one length wanted, got {shapes}", place=place
            )
        for name, limit in (("state", n_states), ("action", n_actions), ("next_state", n_states)):
            array = arrays[name]
            if not np.issubdtype(array.dtype, np.integer):
                raise InputError(
                    f"field '{name}' must hold integers, is {array.dtype}", place=place
                )
            if array.size and (array.min() < 0 or array.max() >= limit):
                raise InputError(f"field '{name}' must lie in 0…{limit - 1}", place=place)
        p = arrays["probability"]
        if not (np.isfinite(p).all() and (p > 0).all()):
            raise InputError("field 'probability' must be finite and above 0", place=place)
        next_state = arrays["next_state"]
        pair = pair_key(arrays["state"], arrays["action"], n_actions)
        entry = pair * n_states + next_state
        # Entries mostly come in order already, and looking costs far less than sorting.
        if not (entry[1:] > entry[:-1]).all():
            order = np.argsort(entry, kind="stable")
            entry, pair, next_state, p = entry[order], pair[order], next_state[order], p[order]
            if (entry[1:] == entry[:-1]).any():
                raise InputError("an entry (state, action, next_state) occurs twice", place=place)
        entries = Groups.of_sorted(pair)
        first = entries.first
        pair_state, pair_action = split_key(pair[first], n_actions)
        P = sparse.csr_matrix(
            (p, next_state, np.append(first, pair.size)), shape=(first.size, n_states), copy=True
        )
        defect = np.abs(entries.sum(p) - 1.0)
        if defect.size and defect.max() > 1e-9:
            worst = int(defect.argmax())
            raise InputError(
                "field 'probability' must sum to 1 for every pair; "
                f"state {pair_state[worst]}, action {pair_action[worst]} "
                f"is off by {defect[worst]:.3g}",
                place=place,
            )
        return cls(
            n_states=n_states,
            n_actions=n_actions,
            pair_state=pair_state.astype(np.int32),
            pair_action=pair_action.astype(np.int32),
            P=P,
        )

    @classmethod
    def from_dense(
        cls, P: np.ndarray, mask: np.ndarray | None = None, tolerance: float = 1e-6
    ) -> "TransitionModel":
        """Build from a table P[s, a, s'], as textbooks and other libraries have it.

        Entries of 0 are dropped. A row without any is a pair that cannot be done. Rows of float32,
        or of probabilities as files print them, sum to 1 only nearly: they are divided by their
        sum.

        Args:
            P: ``[n_states, n_actions, n_states]``, any numbers; from 0 to 1.
            mask: bool ``[n_states, n_actions]``, the pairs that can be done, all others being left
                out whatever their rows say; by default those with a row that is not all 0.
            tolerance: how far a row's sum may be from 1, up to 0.1.

        Raises:
            InputError: if a shape is another, an entry is not a probability, a row's sum is off
                by more than ``tolerance``, or a pair of ``mask`` has no successor; names the pair.
        """
        check_range("tolerance", tolerance, 0, 0.1)
        table = unmasked(P, "transitions")
        square = table.ndim == 3 and table.shape[0] == table.shape[2]
        if not square or table.dtype.kind not in "fiu":
            raise InputError(
                f"numbers P[s, a, s'] of shape [n_states, n_actions, n_states] wanted, got "
                f"{table.dtype} {list(table.shape)}",
                place="transitions",
            )
        table = table.astype(np.float64)
        n_states, n_actions, _ = table.shape
        for s, a, t in np.argwhere(~((table >= 0) & (table <= 1 + tolerance)))[:1]:
            raise InputError(
                f"P[{s}, {a}, {t}] is {table[s, a, t]}, not a probability", place="transitions"
            )
        total = table.sum(axis=2)
        feasible = total > 0 if mask is None else unmasked(mask, "mask")
        if feasible.shape != total.shape or feasible.dtype != np.bool_:
            raise InputError(
                f"bool [{n_states}, {n_actions}] wanted, got {feasible.dtype} "
                f"{list(feasible.shape)}",
                place="mask",
            )
        for s, a in np.argwhere(feasible & ~(np.abs(total - 1) <= tolerance))[:1]:
            raise InputError(
                f"P[{s}, {a}] sums to {total[s, a]:.9g}, not to 1 within {tolerance:g}",
                place="transitions",
            )
        state, action, next_state = np.nonzero(table * feasible[:, :, None])
        probability = table[state, action, next_state] / total[state, action]
        return cls.from_entries(n_states, n_actions, state, action, next_state, probability)

    @property
    def n_pairs(self) -> int:
        """Number of feasible pairs."""
        return self.pair_state.size

    @cached_property
    def first_pair(self) -> np.ndarray:
        """State s has the pairs ``first_pair[s]:first_pair[s + 1]``; int64 ``[n_states + 1]``."""
        return np.searchsorted(self.pair_state, np.arange(self.n_states + 1))

    @cached_property
    def widths(self) -> np.ndarray:
        """Number of feasible actions of every state, int64 ``[n_states]``."""
        return np.diff(self.first_pair)

    @cached_property
    def acting(self) -> np.ndarray:
        """Indices of the states that have a feasible action, int64 ``[m]``, ascending."""
        return np.flatnonzero(self.widths)

    @cached_property
    def surprise(self) -> np.ndarray:
        """Probability that a pair's likeliest outcome does not come; float64 ``[n_pairs]``."""
        return 1.0 - self.P.max(axis=1).toarray().ravel()

    @cached_property
    def outcomes(self) -> tuple[np.ndarray, np.ndarray]:
        """The first pair of every distinct distribution, int64, and which one each pair leads to.

        There may be many fewer distributions than pairs: from wherever a cube is carried to a
        place, it lies there.
        """
        mark = np.random.default_rng(0).random((2, self.n_states))
        return alike(self.P @ mark[0] + 1j * (self.P @ mark[1]))

    @cached_property
    def groups(self) -> Groups:
        """The pairs by state: group k holds the pairs of the state ``acting[k]``."""
        return Groups(self.first_pair[self.acting], self.n_pairs)

    @cached_property
    def mask(self) -> np.ndarray:
        """Which pairs are feasible; bool ``[n_states, n_actions]``."""
        mask = np.zeros((self.n_states, self.n_actions), dtype=bool)
        mask[self.pair_state, self.pair_action] = True
        return mask

    @cached_property
    def _pair_table(self) -> np.ndarray:
        """Row of each pair in ``P``, −1 where infeasible; int32 ``[n_states, n_actions]``."""
        return self.table(np.arange(self.n_pairs, dtype=np.int32), fill=-1)

    def pair_index(self, state: np.ndarray | int, action: np.ndarray | int) -> np.ndarray:
        """Row of each pair in ``P``, −1 where the pair is infeasible; shapes broadcast.

        Any integer that is not an action, such as a policy's −1, is infeasible everywhere.
        """
        state, action = np.asarray(state), np.asarray(action)
        known = (action >= 0) & (action < self.n_actions)
        return np.where(known, self._pair_table[state, np.where(known, action, 0)], -1)

    def actions_of(self, state: int) -> np.ndarray:
        """The feasible actions of one state, ascending; int32 ``[n]``."""
        return self.pair_action[self.first_pair[state] : self.first_pair[state + 1]]

    def sample(self, state: int, action: int, rng: np.random.Generator) -> int:
        """Draw s' from P(s' | s, a).

        Raises:
            InputError: if the pair is infeasible.
        """
        row = int(self.pair_index(state, action))
        if row < 0:
            raise InputError(
                f"action {action} is not feasible in state {state}",
                valid=self.actions_of(state).tolist() or ["none"],
            )
        entries = slice(self.P.indptr[row], self.P.indptr[row + 1])
        return int(rng.choice(self.P.indices[entries], p=self.P.data[entries]))

    def reachable(self, starts: np.ndarray) -> np.ndarray:
        """Where some sequence of actions can lead, starts included; bool ``[n_states]``."""
        reached = np.zeros(self.n_states, dtype=bool)
        reached[starts] = True
        back = self.P.T
        while True:
            # One action further from everything reached so far.
            further = reached | (back @ reached[self.pair_state].astype(float) > 0)
            if further.sum() == reached.sum():
                return reached
            reached = further

    def table(self, per_pair: np.ndarray, fill: float = -np.inf) -> np.ndarray:
        """Spread values ``[n_pairs]`` over ``[n_states, n_actions]``, ``fill`` where infeasible."""
        table = np.full((self.n_states, self.n_actions), fill, dtype=np.asarray(per_pair).dtype)
        table[self.pair_state, self.pair_action] = per_pair
        return table

    def q_values(self, f: np.ndarray, caution: float = 0.0) -> np.ndarray:
        """Q(s, a) = Σ_s' P_sa(s') f(s') (3.17); ``[n_states, n_actions]``, −∞ where infeasible.

        With ``caution`` u, −u times ``surprise`` besides: what no function of states can say.
        """
        q = self.P @ f
        return self.table(q - caution * self.surprise if caution else q)
