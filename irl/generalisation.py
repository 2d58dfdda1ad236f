"""Which demonstrated pairs speak for which others (§5.10.1); `irl.rule_trust`: how rightly."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from irl.demonstrations import SOURCES, Demonstrations
from irl.errors import InputError
from irl.pairs import pair_key

FILE = "generalisation.npz"


# More actions than int32 can name: groups of pairs do not know how many a task has.
_ANY_ACTION = 1 << 32


@dataclass(frozen=True, eq=False)
class Generalisation:
    """Groups of pairs: by a group's rule, each of its pairs follows from every other.

    A pair may be in several groups, one for every rule that covers it.

    Attributes:
        state: int32 ``[n]``.
        action: int32 ``[n]``.
        group: int32 ``[n]``, at least 0.
        rule: uint8 ``[n]``, an index into ``rule_names``; one rule to a group.
        rule_names: what the rules are called.
    """

    state: np.ndarray
    action: np.ndarray
    group: np.ndarray
    rule: np.ndarray
    rule_names: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        """Check what can be checked without the transition model.

        Raises:
            InputError: if a column has the wrong type or length, a group has two rules or
                holds a pair twice, or a rule has no name.
        """
        types = {"state": np.int32, "action": np.int32, "group": np.int32, "rule": np.uint8}
        for name, dtype in types.items():
            column = getattr(self, name)
            if (
                not isinstance(column, np.ndarray)
                or column.dtype != dtype
                or column.shape != (self.state.size,)
            ):
                raise InputError(
                    f"{FILE}: field '{name}' must be {np.dtype(dtype)} [{self.state.size}], "
                    f"is {getattr(column, 'dtype', type(column).__name__)} {np.shape(column)}"
                )
        if len(set(self.rule_names)) != len(self.rule_names):
            raise InputError("task.json: field 'generalisation_rules' names a rule twice")
        if not self.state.size:
            return
        if self.rule.max() >= len(self.rule_names):
            raise InputError(
                f"{FILE}: field 'rule' holds {self.rule.max()}, but task.json, field "
                f"'generalisation_rules', names {len(self.rule_names)} rules"
            )
        if min(self.state.min(), self.action.min(), self.group.min()) < 0:
            raise InputError(f"{FILE}: fields 'state', 'action', 'group' must be at least 0")
        order = np.lexsort((self.action, self.state, self.group))
        same_group = self.group[order][1:] == self.group[order][:-1]
        if (same_group & (self.rule[order][1:] != self.rule[order][:-1])).any():
            raise InputError(f"{FILE}: field 'rule' differs within a group")
        key = pair_key(self.state, self.action, _ANY_ACTION)[order]
        if (same_group & (key[1:] == key[:-1])).any():
            raise InputError(f"{FILE}: a group holds a pair (state, action) twice")

    @classmethod
    def none(cls) -> "Generalisation":
        """No rules: every pair speaks for itself alone."""
        column = np.zeros(0, dtype=np.int32)
        return cls(column, column, column, np.zeros(0, dtype=np.uint8), [])

    @cached_property
    def _by_pair(self) -> tuple[np.ndarray, np.ndarray]:
        keys = pair_key(self.state, self.action, _ANY_ACTION)
        order = np.argsort(keys, kind="stable")
        return keys[order], order

    @cached_property
    def _by_group(self) -> tuple[np.ndarray, np.ndarray]:
        order = np.lexsort((self.action, self.state, self.group))
        return self.group[order], order

    def rule_indices(self, rules: Iterable[str] | None) -> list[int]:
        """Indices of the named rules; of all when ``rules`` is ``None``.

        Raises:
            InputError: if a name is unknown.
        """
        if rules is None:
            return list(range(len(self.rule_names)))
        wanted = list(rules)
        for name in wanted:
            if name not in self.rule_names:
                raise InputError(f"no rule {name!r}", place="generalisation", valid=self.rule_names)
        return [self.rule_names.index(name) for name in wanted]

    def following(
        self, state: int, action: int, rules: Iterable[str] | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """The pairs that follow from one, itself excluded.

        Args:
            state: the demonstrated state.
            action: the action demonstrated there.
            rules: names of the rules to apply, in this order; all by default.

        Returns:
            States and actions, int64 ``[n]`` each, by rule, then state; a pair that follows by
            two rules comes twice.

        Raises:
            InputError: if a rule is unknown.
        """
        keys, by_pair = self._by_pair
        groups, by_group = self._by_group
        key = pair_key(state, action, _ANY_ACTION)
        own = by_pair[np.searchsorted(keys, key) : np.searchsorted(keys, key, side="right")]
        found = [np.zeros(0, dtype=np.int64)]
        for rule in self.rule_indices(rules):
            for group in np.sort(self.group[own[self.rule[own] == rule]]):
                first = np.searchsorted(groups, group)
                members = by_group[first : np.searchsorted(groups, group, side="right")]
                found.append(members[~np.isin(members, own)])
        rows = np.concatenate(found)
        return self.state[rows].astype(np.int64), self.action[rows].astype(np.int64)


def generalise(
    demonstrations: Demonstrations,
    generalisation: Generalisation,
    rules: Iterable[str] | None = None,
    rules_at_end: Iterable[str] | None = None,
) -> Demonstrations:
    """Add what follows from the demonstrated pairs (§5.10.1).

    Only what was demonstrated speaks for other pairs; what followed before does not, so errors
    of a rule do not multiply. A demonstrated pair speaks once for each pair, whether it follows by
    one rule, by two, or did so before.

    Args:
        demonstrations: any set; its own pairs are kept.
        generalisation: groups of feasible pairs.
        rules: names of the rules to apply; all by default.
        rules_at_end: names of those to apply to the last pair of a run; the same by default.

    Raises:
        InputError: if a rule is unknown.
    """
    names = [generalisation.rule_names[k] for k in generalisation.rule_indices(rules)]
    at_end = names
    if rules_at_end is not None:
        at_end = [generalisation.rule_names[k] for k in generalisation.rule_indices(rules_at_end)]
    shown = np.flatnonzero(~demonstrations.generalised)
    last = demonstrations.last_of_runs
    parts = [demonstrations]
    known: dict[tuple[int, int, bool], tuple[np.ndarray, np.ndarray]] = {}
    for k in shown:
        source = int(demonstrations.state[k]), int(demonstrations.action[k]), bool(last[k])
        if source not in known:
            known[source] = generalisation.following(*source[:2], at_end if last[k] else names)
        state, action = known[source]
        parts.append(
            Demonstrations(
                trajectory=np.full(state.size, demonstrations.trajectory[k]),
                step=np.full(state.size, demonstrations.step[k]),
                state=state,
                action=action,
                source=np.full(state.size, SOURCES.index("generalised"), dtype=np.uint8),
            )
        )
    every = Demonstrations.concatenate(parts)
    columns = every.trajectory, every.step, every.state, every.action, every.generalised
    _, first = np.unique(np.stack(columns), axis=1, return_index=True)
    return every.select(np.sort(first))
