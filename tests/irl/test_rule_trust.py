"""Rules are trusted as far as runs through the same states agree with them."""

import numpy as np
import pytest

from irl.demonstrations import Demonstrations
from irl.generalisation import Generalisation
from irl.rule_trust import AT_THE_END, ON_THE_WAY, rule_trust

COLUMNS = 10  # states 0 … 9 are where something is lifted, 10 … 19 where it is held
CARRY, DROP = 2, 3


def rules(members):
    """Groups of pairs by rule: name → list of groups."""
    rows = [
        (s, a, group, k)
        for k, groups in enumerate(members.values())
        for group, pairs in enumerate(groups, start=100 * k)
        for s, a in pairs
    ]
    state, action, group, rule = np.array(rows).T
    columns = (x.astype(np.int32) for x in (state, action, group))
    return Generalisation(*columns, rule.astype(np.uint8), list(members))


LIFTS = [[(s, a) for s in range(COLUMNS)] for a in (0, 1)]
RULES = rules(
    {
        "lift alike": LIFTS,
        "drop anywhere": [[(s, DROP) for s in range(10, 20)]],
        "carry alike": [[(s, CARRY) for s in range(10, 20)]],
        "lift by parity": [[(s, (s + k) % 2) for s in range(COLUMNS)] for k in (0, 1)],
        "never": [[(30, 0), (31, 0)]],
    }
)


def runs(n, habit=False, seed=0):
    """Lift with 0 or 1, by chance or, by habit, always with 0; carry to column 0; drop there."""
    rng = np.random.default_rng(seed)
    walks = []
    for start in rng.integers(COLUMNS, size=n):
        lift = [(int(start), 0 if habit else int(rng.integers(2)))]
        walks.append([*lift, *([(int(start) + 10, CARRY)] if start else []), (10, DROP)])
    return Demonstrations.from_trajectories(walks)


@pytest.mark.parametrize("habit", [False, True])
def test_right_rules_are_trusted_and_drops_where_work_ends_are_not(habit):
    trust = rule_trust(runs(150, habit), RULES, RULES.rule_names)
    assert trust["lift alike"][ON_THE_WAY].share > 0.9
    assert trust["drop anywhere"][AT_THE_END].share < 0.15
    assert trust["drop anywhere"][AT_THE_END].agreed == 0
    assert trust["drop anywhere"][AT_THE_END].states == COLUMNS - 1
    # What is carried from 1 … 9 would be from 0, too, the rule says; there it is dropped.
    assert trust["carry alike"][ON_THE_WAY].states == COLUMNS
    assert 0.7 < trust["carry alike"][ON_THE_WAY].share < 0.95
    # By chance both lifts are right everywhere, so any of them follows; by habit only one is.
    parity = trust["lift by parity"][ON_THE_WAY].share
    assert (parity < 0.7) if habit else (parity > 0.9)


def test_without_evidence_trust_is_three_quarters():
    trust = rule_trust(runs(3), RULES, ["never", "lift alike"])
    assert trust["never"][ON_THE_WAY].share == pytest.approx(0.75, abs=1e-6)
    assert trust["never"][AT_THE_END].states == 0
    assert trust["lift alike"][ON_THE_WAY].states <= 3
    assert rule_trust(Demonstrations.empty(), RULES, ["never"])["never"][ON_THE_WAY].states == 0


def test_what_was_generalised_is_no_evidence():
    shown = runs(40)
    derived = Demonstrations(
        shown.trajectory, shown.step, shown.state, 1 - np.minimum(shown.action, 1),
        np.full(len(shown), 1, dtype=np.uint8),
    )  # fmt: skip
    both = Demonstrations.concatenate([shown, derived])
    names = RULES.rule_names
    assert rule_trust(both, RULES, names) == rule_trust(shown, RULES, names)
