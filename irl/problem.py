"""A learning problem: what is known before anyone demonstrates. `irl.teacher` knows the rest."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from irl.choices import check_number
from irl.errors import InputError
from irl.integers import integers, unmasked
from irl.mdp import TransitionModel
from irl.preferences import StatePreferences
from irl.task import TaskData


@dataclass(frozen=True, eq=False)
class LearningProblem:
    """A Markov decision process without its reward, and what the learner is told of its states.

    Attributes:
        model: the transition model P.
        features: ``[n_states, d]``, of a size near 1: what networks see of a state; None for
            methods that do without. Or ``[n_states, n_actions, d]``, of states and actions, for
            methods that learn what acting earns; what is infeasible is ignored.
        gamma: discount factor in [0, 1).
        fixed_vr: state → VR value known beforehand, such as −1 for a lost object.
        clusters: name → state indices; what an expert may be asked about.
        preferences: states known to be worth more, or less, than learnt (§5.12).
        start_states: int64, where episodes begin; by default wherever something can be done.
        candidates: int64, the states that may be asked about; all if None.
        costs: name → ``[n_pairs]``, from 0 to 1: what a demonstrator may mind about acting, for
            the method that weighs it (``goal_posterior``).
        factors: name → int64 ``[n_states]``: what states may have in common, so that goals can be
            told in words, for the same.

    Raises:
        InputError: naming the field that does not fit the others.
    """

    model: TransitionModel
    features: np.ndarray | None = None
    gamma: float = field(kw_only=True)
    fixed_vr: Mapping[int, float] = field(default_factory=dict, kw_only=True)
    clusters: Mapping[str, np.ndarray] = field(default_factory=dict, kw_only=True)
    preferences: StatePreferences = field(default_factory=StatePreferences, kw_only=True)
    start_states: np.ndarray = field(default=None, kw_only=True)  # type: ignore[arg-type]
    candidates: np.ndarray | None = field(default=None, kw_only=True)
    costs: Mapping[str, np.ndarray] = field(default_factory=dict, kw_only=True)
    factors: Mapping[str, np.ndarray] = field(default_factory=dict, kw_only=True)

    @classmethod
    def of(cls, task: TaskData, features: str | None = None) -> "LearningProblem":
        """What task data tell a learner: all but the goal and the demonstrations.

        Questions stay within the states that can be reached from the start states. Every column of
        ``states.csv`` is a factor.

        Args:
            task: the task.
            features: name of the features that networks see; None for methods without a network.

        Raises:
            InputError: if there are no features of that name; lists the valid ones.
        """
        return cls(
            task.model,
            None if features is None else task.feature(features),
            gamma=task.gamma,
            fixed_vr=task.fixed_vr,
            clusters=task.clusters,
            preferences=StatePreferences(task.preferred, task.avoided),
            start_states=task.start_states,
            candidates=np.flatnonzero(task.model.reachable(task.start_states)),
            factors={
                name: np.unique([row[name] for row in task.states], return_inverse=True)[1]
                for name in task.states[0]
            },
        )

    def __post_init__(self) -> None:
        """Fill in the start states, and check every field against the model."""
        n = self.model.n_states
        check_number("gamma", self.gamma)
        if not 0 <= self.gamma < 1:
            raise InputError(f"must lie in [0, 1), is {self.gamma}", place="gamma")
        if self.features is not None:
            object.__setattr__(self, "features", _table(self.features, self.model))
        if self.start_states is None:
            object.__setattr__(self, "start_states", self.model.acting)
        for name in ("start_states", "candidates"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, integers(getattr(self, name), name, below=n))
        for name, states in self.clusters.items():
            integers(states, f"clusters: {name!r}", below=n)
        for name, values in self.costs.items():
            _check_cost(values, self.model.n_pairs, f"costs: {name!r}")
        for name, values in self.factors.items():
            if integers(values, f"factors: {name!r}", low=None).size != n:
                raise InputError(
                    f"integers [{n}] wanted, got {np.shape(values)}", place=f"factors: {name!r}"
                )
        integers(list(self.fixed_vr), "fixed_vr: states", below=n)
        for name in ("preferred", "avoided"):
            integers(getattr(self.preferences, name), f"preferences: {name}", below=n)

    @property
    def pair_features(self) -> np.ndarray | None:
        """The features if they are those of pairs, ``[n_states, n_actions, d]``; else None."""
        return None if self.features is None or self.features.ndim == 2 else self.features

    def required_features(self, dtype: type = np.float64) -> np.ndarray:
        """The features ``[n_states, d]`` as numbers of a type, for what cannot do without.

        Raises:
            InputError: if there are none, or if they are those of pairs.
        """
        if self.features is None:
            raise InputError("features: this method learns from features [n_states, d]; give some")
        if self.features.ndim == 3:
            raise InputError(
                "[n_states, d] wanted by what learns from features of states, got features of "
                f"pairs {list(self.features.shape)}",
                place="features",
            )
        return np.asarray(self.features, dtype=dtype)


def _table(features: np.ndarray, model: TransitionModel) -> np.ndarray:
    table, n, m = unmasked(features, "features"), model.n_states, model.n_actions
    if table.shape[:-1] not in ((n,), (n, m)) or table.dtype.kind not in "fiub":
        raise InputError(
            f"numbers [{n}, d] wanted, or [{n}, {m}, d] of pairs, got {table.dtype} "
            f"{list(table.shape)}",
            place="features",
        )
    if table.shape[-1] == 0:
        raise InputError("must have at least one column", place="features")
    used = table if table.ndim == 2 else table[model.mask]
    if not np.isfinite(used).all():
        raise InputError("must be finite, hold NaN or infinity", place="features")
    if np.abs(used).max(initial=0) > np.finfo(np.float32).max:
        raise InputError("must be of a size near 1, hold what float32 cannot", place="features")
    return table


def _check_cost(cost: np.ndarray, n_pairs: int, place: str) -> None:
    values = np.asarray(cost)
    if values.shape != (n_pairs,) or values.dtype.kind not in "fiub":
        raise InputError(
            f"numbers [{n_pairs}], one a feasible pair, wanted, got {values.dtype} "
            f"{list(values.shape)}",
            place=place,
        )
    if not ((values >= 0) & (values <= 1)).all():
        raise InputError("must lie in 0…1", place=place)
