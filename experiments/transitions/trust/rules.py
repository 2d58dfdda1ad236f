"""Each rule by which a trial speaks for other pairs, compared with trials of those pairs.

For one rule at a time: pairs that follow from a campaign's trials by that rule alone are drawn and
tried, and what came about is compared with what the rule predicted.
"""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure

from diagrams.trials.counts import (
    Evidence,
    TransitionEntries,
    thesis_entries,
    transition_entries,
)
from diagrams.trials.record import Pair, Trial
from experiments.transitions.trust.validation import scores
from irl.metrics import wilson_interval
from models.task.kernel_rules import EXACT_RULES, THESIS_RULES, exact_rule
from models.task.pairs import split_key
from models.task.spaces import Kind, decode_actions
from models.task.trial_classes import TrialClasses

EXACT, THESIS = "exact", "thesis"


class Rule(NamedTuple):
    """A rule and what it predicts.

    Attributes:
        source: `EXACT` or `THESIS`.
        name: of `EXACT_RULES` or `THESIS_RULES`.
        model: entries of the pairs that follow by it.
        keys: those pairs, by their keys, none of them tried in the campaign.
    """

    source: str
    name: str
    model: TransitionEntries
    keys: np.ndarray


def find_rules(feasible: np.ndarray, trials: Sequence[Trial], classes: TrialClasses) -> list[Rule]:
    """What every rule alone makes of a campaign's trials.

    Args:
        feasible: bool ``[N_STATES or more, N_ACTIONS]``.
        trials: of the campaign.
        classes: which pairs share trials.
    """
    model = transition_entries(feasible, trials, classes)
    keys = _untried(model)
    related = exact_rule(classes, *split_key(keys))
    rules = [
        Rule(EXACT, name, model, keys[related == number]) for number, name in enumerate(EXACT_RULES)
    ]
    for name in THESIS_RULES:
        alone = thesis_entries(feasible, trials, [name])
        rules.append(Rule(THESIS, name, alone, _untried(alone)))
    return rules


def draw_rule_pairs(rule: Rule, number: int, rng: np.random.Generator) -> list[Pair]:
    """Draw pairs that follow by a rule, as evenly over the kinds of action as there are.

    Args:
        rule: which.
        number: of pairs, at most.
        rng: draws them, without replacement.
    """
    order = rng.permutation(rule.keys)
    kind = decode_actions(split_key(order)[1]).kind
    # The nth of its kind comes in the nth round.
    nth = np.zeros(order.size, dtype=np.int64)
    for k in Kind:
        nth[kind == k] = np.arange((kind == k).sum())
    chosen = order[np.argsort(nth, kind="stable")][:number]
    return [Pair.from_key(key) for key in chosen]


def judge(
    rules: Sequence[Rule], drawn: Sequence[Sequence[Pair]], trials: Sequence[Trial]
) -> list[dict[str, Any]]:
    """How well each rule predicted the trials of its pairs, by `validation.scores`."""
    rows = []
    for rule, pairs in zip(rules, drawn, strict=True):
        mine = set(pairs)
        found = scores(_restrict(rule), [trial for trial in trials if trial.pair in mine])
        rows.append({"source": rule.source, "rule": rule.name, "pairs": rule.keys.size, **found})
    return rows


def print_rules(rows: Sequence[Mapping[str, Any]]) -> None:
    """One line for each rule and kind of action."""
    print(
        f"{'rule':>22} {'action':>17} {'trials':>7} {'likeliest':>10} {'expected':>9} "
        f"{'probable':>9}"
    )
    for row in rows:
        for kind, part in row["by_action"].items():
            if part["trials"]:
                print(
                    f"{row['source'] + ': ' + row['rule']:>22} {kind:>17} {part['trials']:7d} "
                    f"{part['most_likely'][0]:10.1%} {part['expected']:9.1%} "
                    f"{part['probable'][0]:9.1%}"
                )


def plot_rules(figure: Figure, rows: Sequence[Mapping[str, Any]]) -> None:
    """Draw how often each rule's likeliest state came about, beside what it expected itself."""
    names, shares, errors, expected = [], [], [], []
    for row in rows:
        parts = [part for part in row["by_action"].values() if part["trials"]]
        if not parts:
            continue
        trials = sum(part["trials"] for part in parts)
        hits = round(sum(part["most_likely"][0] * part["trials"] for part in parts))
        low, high = wilson_interval(hits, trials)
        names.append(f"{row['source']}: {row['rule']}\n{trials} trials")
        shares.append(hits / trials)
        errors.append((max(0.0, hits / trials - low), max(0.0, high - hits / trials)))
        expected.append(sum(part["expected"] * part["trials"] for part in parts) / trials)
    figure.set_size_inches(8, 0.5 * len(names) + 1.2)
    axes = figure.subplots()
    axes.barh(names, shares, xerr=np.array(errors).T, color="#4393c3", capsize=3)
    axes.plot(expected, names, "kd", ms=5, ls="none", label="expected by the rule's own model")
    axes.set(xlim=(0, 1.02), xlabel="the likeliest state came about, 95 % interval")
    axes.invert_yaxis()
    axes.legend(loc="lower left")


def _restrict(rule: Rule) -> TransitionEntries:
    """The entries of the rule's own pairs."""
    return rule.model.select(np.isin(rule.model.key, rule.keys))


def _untried(model: TransitionEntries) -> np.ndarray:
    """Pairs that follow from trials of others."""
    return np.unique(model.key[model.evidence == Evidence.KERNEL])
