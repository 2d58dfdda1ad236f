"""How likely the demonstrations are under a VR function: thesis (3.19), as a mean.

Every label counts, as often as it was given, of each state those of the highest rank: see
`irl.labels`.

The demonstrator is taken to choose action a in state s with probability proportional to
exp(β Q(s, a)), Q from (3.17), among the *feasible* actions. Only the successors of
demonstrated states enter, so f is asked for nowhere else.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse

from irl.checkpoint import fingerprint
from irl.demonstrations import Demonstrations
from irl.errors import InputError
from irl.integers import integers
from irl.mdp import TransitionModel
from irl.neighbourhood import Neighbourhood


@dataclass(frozen=True)
class LikelihoodProblem:
    """A set of demonstrations, prepared for many evaluations.

    Attributes:
        seen: the feasible pairs and successors of the demonstrated states.
        label_share: float64 ``[n_pairs]``: share of the demonstrations' weight on each pair.
        state_share: float64 ``[m]``: the same per demonstrated state; both sum to 1.
        total: that weight, the number of labels if each counts the same.
    """

    seen: Neighbourhood
    label_share: np.ndarray
    state_share: np.ndarray
    total: float

    @classmethod
    def of(
        cls,
        model: TransitionModel,
        demonstrations: Demonstrations,
        state_weight: np.ndarray | None = None,
        fixed_vr: Mapping[int, float] | None = None,
        *,
        cautious: bool = False,
    ) -> "LikelihoodProblem":
        """Prepare demonstrations, in any order: each label counts, as ``Demonstrations.counted``.

        Args:
            model: the transition model.
            demonstrations: labelled pairs.
            state_weight: ``[n_states]``, positive: how much more a state's labels count; all alike
                if absent.
            fixed_vr: as for ``build``.
            cautious: likewise.

        Raises:
            InputError: as ``build``.
        """
        labels = demonstrations.counted
        weight = labels.count.astype(np.float64)
        if state_weight is not None:
            weight *= state_weight[labels.state]
        return cls.build(model, labels.state, labels.action, weight, fixed_vr, cautious=cautious)

    @classmethod
    def build(
        cls,
        model: TransitionModel,
        state: np.ndarray,
        action: np.ndarray,
        weight: np.ndarray | None = None,
        fixed_vr: Mapping[int, float] | None = None,
        *,
        cautious: bool = False,
    ) -> "LikelihoodProblem":
        """Prepare pairs (``state[i]``, ``action[i]``), each ``[n]``, repeats allowed.

        Args:
            model: the transition model.
            state: demonstrated states.
            action: what was done there.
            weight: how much each counts, positive; all equal if absent.
            fixed_vr: state → VR value, for states where f is known and not to be learnt.
            cautious: whether the last of ``states`` is the pseudo-state of `irl.neighbourhood`.

        Raises:
            InputError: if there is no demonstration, lengths differ, an index is out of
                range, a weight is not positive, or a pair is infeasible in ``model``.
        """
        state = integers(state, "demonstrations: field 'state'", below=model.n_states)
        action = integers(action, "demonstrations: field 'action'", below=model.n_actions)
        weight = np.ones(state.size) if weight is None else np.asarray(weight, dtype=np.float64)
        if not (state.ndim == 1 and state.shape == action.shape == weight.shape):
            raise InputError(
                "demonstrations: state, action and weight must be of one length, "
                f"got shapes {state.shape}, {action.shape}, {weight.shape}"
            )
        if state.size == 0:
            raise InputError("demonstrations: at least one (state, action) pair is needed")
        if not (np.isfinite(weight).all() and (weight > 0).all()):
            raise InputError("demonstrations: field 'weight' must be finite and above 0")
        row = model.pair_index(state, action)
        if (row < 0).any():
            s, a = state[row < 0][0], action[row < 0][0]
            raise InputError(
                f"state {s}, action {a} is infeasible",
                place="demonstrations",
                valid=model.actions_of(s).tolist() or ["none"],
            )
        seen = Neighbourhood.of(model, np.unique(state), fixed_vr or {}, cautious=cautious)
        label = np.bincount(np.searchsorted(seen.rows, row), weight, minlength=seen.rows.size)
        total = label.sum()
        share = label / total
        return cls(seen, share, seen.groups.sum(share), float(total))

    def of_pairs(self) -> "LikelihoodProblem":
        """The same in the values of pairs: Q of the rows ``states`` is wanted in place of f."""
        rows, none = self.seen.rows, np.zeros(0, dtype=np.int64)
        one = sparse.identity(rows.size, format="csr")
        seen = replace(self.seen, visible=rows, P=one, pinned=none, pinned_value=np.zeros(0))
        return replace(self, seen=seen)

    @property
    def states(self) -> np.ndarray:
        """int64 ``[u]``: the states whose f is needed, in the order it is wanted."""
        return self.seen.visible

    def fingerprint(self) -> str:
        """SHA-256 that tells this problem from any other."""
        return fingerprint(*self.seen.arrays(), self.label_share)

    def value_and_gradient(
        self, f: np.ndarray, beta: float | np.ndarray
    ) -> tuple[float, np.ndarray, float]:
        """Mean log-likelihood (3.19), its gradient in f and its derivative in β.

        Args:
            f: VR values of ``states``, ``[u]``; pinned entries are ignored.
            beta: inverse temperature, above 0.

        Returns:
            The mean (≤ 0), float64 ``[u]`` (0 at pinned entries), and the derivative in β.
        """
        seen = self.seen
        q = seen.P @ seen.pin(f)
        z = beta * q
        peak = seen.groups.maximum(z)
        e = np.exp(z - seen.groups.spread(peak))
        total = seen.groups.sum(e)
        # Sums, not @: on long vectors BLAS would call up threads, slowly, and change the last bits.
        value = (self.label_share * z).sum() - (self.state_share * (np.log(total) + peak)).sum()
        e *= seen.groups.spread(self.state_share / total)
        surplus = self.label_share - e  # what was demonstrated, less what the model expects
        df = seen.P_transposed @ (beta * surplus)
        df[seen.pinned] = 0.0
        return float(value), df, float((surplus * q).sum())
