"""A task in memory: the values, checked against each other; ``irl.task_data`` is for users.

Errors name the file a field comes from in the task data directory, which ``irl.task_data`` reads
and writes.
"""

from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import Any

import numpy as np

from irl.demonstrations import Demonstrations
from irl.errors import InputError
from irl.generalisation import Generalisation
from irl.integers import integers
from irl.mdp import TransitionModel

EVIDENCE = ("measured", "kernel", "estimated")


@dataclass(frozen=True, eq=False)
class Transitions:
    """One entry per (s, a, s') with what is known of it, as parallel arrays ``[n]``.

    Attributes:
        state: int32.
        action: int32.
        next_state: int32.
        probability: float64; those of a pair sum to 1, an absent pair is infeasible.
        count: int64, trials behind the entry.
        evidence: uint8, an index into ``EVIDENCE``.
    """

    state: np.ndarray
    action: np.ndarray
    next_state: np.ndarray
    probability: np.ndarray
    count: np.ndarray
    evidence: np.ndarray

    @classmethod
    def estimated(
        cls, state: np.ndarray, action: np.ndarray, next_state: np.ndarray, probability: np.ndarray
    ) -> "Transitions":
        """Entries that no trial stands behind, of any integer and float types, each ``[n]``.

        Raises:
            InputError: if indices are not integers that int32 holds, or lengths differ.
        """
        state, action, next_state = (
            integers(values, f"transitions.npz: field '{name}'", dtype=np.int32)
            for name, values in (("state", state), ("action", action), ("next_state", next_state))
        )
        n = state.size
        return cls(
            state,
            action,
            next_state,
            np.asarray(probability, np.float64),
            count=np.zeros(n, dtype=np.int64),
            evidence=np.full(n, EVIDENCE.index("estimated"), dtype=np.uint8),
        )

    def __post_init__(self) -> None:
        """Check types, lengths, ``count`` and ``evidence``; the rest needs the task's size.

        Raises:
            InputError: naming the field.
        """
        types = (np.int32, np.int32, np.int32, np.float64, np.int64, np.uint8)
        for column, dtype in zip(fields(self), types, strict=True):
            _check_array(
                f"transitions.npz: field '{column.name}'",
                getattr(self, column.name),
                (dtype,),
                (np.size(self.state),),
            )
        if self.count.min(initial=0) < 0:
            raise InputError("transitions.npz: field 'count' must be at least 0")
        if self.evidence.max(initial=0) >= len(EVIDENCE):
            valid = ", ".join(f"{k} {name}" for k, name in enumerate(EVIDENCE))
            raise InputError(
                f"transitions.npz: field 'evidence' holds {self.evidence.max()}; valid: {valid}"
            )


@dataclass(frozen=True, eq=False)
class TaskData:
    """A task as the learner meets it, checked as a whole.

    Attributes:
        name: what the task is called.
        states: one dict of readable columns per state.
        actions: one dict of readable columns per action.
        transitions: the entries of the transition model with their evidence.
        goal_states: int64, indices; for demonstrators and metrics, hidden from learners.
        start_states: int64, indices.
        gamma: discount factor in [0, 1).
        features: float arrays ``[n_states, d]`` by name.
        clusters: int64 state indices by name.
        preferred: int64, states to benefit (§5.12).
        avoided: int64, states to discount.
        generalisation: which pairs follow from a demonstrated one.
        demonstrations: labelled pairs that come with the task.
        fixed_vr: VR value by state, where it is known beforehand.
        provenance: where the data come from; anything JSON holds.
        task_hash: SHA-256 of ``task.json``; empty until the task is saved and loaded.
    """

    name: str
    states: list[dict[str, str]]
    actions: list[dict[str, str]]
    transitions: Transitions
    goal_states: np.ndarray
    start_states: np.ndarray
    gamma: float
    features: dict[str, np.ndarray]
    clusters: dict[str, np.ndarray]
    preferred: np.ndarray
    avoided: np.ndarray
    generalisation: Generalisation = field(default_factory=Generalisation.none)
    demonstrations: Demonstrations = field(default_factory=Demonstrations.empty)
    fixed_vr: dict[int, float] = field(default_factory=dict)
    provenance: dict[str, Any] = field(default_factory=dict)
    task_hash: str = ""

    def __post_init__(self) -> None:
        """Check every field against every other.

        Raises:
            InputError: naming file, field and what would be valid.
        """
        _check_rows("states.csv", self.states)
        _check_rows("actions.csv", self.actions)
        if not 0 <= self.gamma < 1:
            raise InputError(f"task.json: field 'gamma' must lie in [0, 1), is {self.gamma}")
        for place, indices, least in self._index_sets():
            _check_array(place, indices, (np.int64,), (np.size(indices),))
            _check_range(place, indices, self.n_states)
            if indices.size < least:
                raise InputError(f"{place} must not be empty")
            if np.unique(indices).size != indices.size:
                raise InputError(f"{place} names a state twice")
        both = np.intersect1d(self.preferred, self.avoided)
        if both.size:
            raise InputError(
                f"state_preferences.json: state {both[0]} is both preferred and avoided; name it "
                "in one field only"
            )
        for state, value in self.fixed_vr.items():
            if not 0 <= state < self.n_states or not np.isfinite(value):
                raise InputError(
                    f"task.json: field 'fixed_vr' must give finite values to states "
                    f"0…{self.n_states - 1}, gives {value} to {state}"
                )
        for name, feature in self.features.items():
            place = f"features.npz: field {name!r}"
            width = np.shape(feature)[1] if np.ndim(feature) == 2 else -1
            if width == 0:
                raise InputError("must have at least one column", place=place)
            _check_array(place, feature, (np.float32, np.float64), (self.n_states, width))
            if not np.isfinite(feature).all():
                raise InputError(f"{place} must be finite, holds NaN or infinity")
        g = self.generalisation
        _check_range("generalisation.npz: field 'state'", g.state, self.n_states)
        _check_range("generalisation.npz: field 'action'", g.action, self.n_actions)
        infeasible = np.flatnonzero(self.model.pair_index(g.state, g.action) < 0)
        for row in infeasible[:1]:
            raise InputError(
                f"generalisation.npz: field 'action' is {g.action[row]} in row {row}, "
                f"not feasible in state {g.state[row]}"
            )
        self.demonstrations.check(self.model)

    def _index_sets(self) -> list[tuple[str, np.ndarray, int]]:
        """Every set of states: where it stands, its indices, and its least size."""
        return [
            ("task.json: field 'goal_states'", self.goal_states, 1),
            ("task.json: field 'start_states'", self.start_states, 1),
            ("state_preferences.json: field 'preferred'", self.preferred, 0),
            ("state_preferences.json: field 'avoided'", self.avoided, 0),
            *((f"clusters.json: field {name!r}", c, 1) for name, c in self.clusters.items()),
        ]

    @property
    def n_states(self) -> int:
        """Number of states."""
        return len(self.states)

    @property
    def n_actions(self) -> int:
        """Number of actions."""
        return len(self.actions)

    @cached_property
    def model(self) -> TransitionModel:
        """The transition model."""
        t = self.transitions
        try:
            return TransitionModel.from_entries(
                self.n_states, self.n_actions, t.state, t.action, t.next_state, t.probability
            )
        except InputError as error:
            raise error.at("transitions.npz") from None

    def feature(self, name: str) -> np.ndarray:
        """Features ``[n_states, d]`` by name.

        Raises:
            InputError: if there are none of that name; lists the valid ones.
        """
        return _named("features.npz", self.features, name)

    def cluster(self, name: str) -> np.ndarray:
        """State indices of a cluster, int64 ``[n]``.

        Raises:
            InputError: if there is none of that name; lists the valid ones.
        """
        return _named("clusters.json", self.clusters, name)


def _named(file: str, table: dict[str, np.ndarray], name: str) -> np.ndarray:
    if name not in table:
        raise InputError(f"{file}: no field {name!r}; valid: {', '.join(table)}")
    return table[name]


def _check_array(place: str, array: Any, dtypes: tuple[type, ...], shape: tuple[int, ...]) -> None:
    wanted = f"{' or '.join(np.dtype(d).name for d in dtypes)} {list(shape)}".replace("-1", "d")
    if not isinstance(array, np.ndarray):
        raise InputError(f"{place} must be {wanted}, is {type(array).__name__}")
    if array.dtype not in dtypes or array.shape != shape:
        raise InputError(f"{place} must be {wanted}, is {array.dtype} {list(array.shape)}")


def _check_range(place: str, indices: np.ndarray, limit: int) -> None:
    outside = indices[(indices < 0) | (indices >= limit)]
    if outside.size:
        raise InputError(f"{place} must lie in 0…{limit - 1}, holds {outside[0]}")


def _check_rows(file: str, rows: list[dict[str, str]]) -> None:
    if not rows:
        raise InputError(f"{file}: at least one row wanted")
    for number, row in enumerate(rows):
        if row.keys() != rows[0].keys() or "index" in row:
            raise InputError(
                f"{file}: row {number} must have the columns {list(rows[0])}, "
                f"'index' left out, has {list(row)}"
            )
