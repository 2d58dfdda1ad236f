"""How well a transition model predicts trials that it was not made from."""

from collections.abc import Iterable
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from diagrams.trials.counts import Evidence, TransitionEntries
from diagrams.trials.record import Outcome, Pair, Trial
from irl.metrics import wilson_interval
from models.task.pairs import split_key
from models.task.spaces import GRID_Z, POSITIONS, Kind, decode_actions, decode_states

PROBABLE = 0.05
"""An outcome at least as probable as this was to be expected."""
GROUPS = ("grasp", "translate", "rotate", "drop, lower layer", "drop, upper layer")
"""What is scored by itself: kinds of action, and drops by how far the cube falls."""


def groups(keys: ArrayLike) -> np.ndarray:
    """Which of `GROUPS` pairs belong to ``[n]``.

    Args:
        keys: of `models.task.pairs` ``[n]``.
    """
    state, action = split_key(np.asarray(keys))
    kind = decode_actions(action).kind
    upper = POSITIONS[decode_states(state).position][:, 2] > GRID_Z.mean()
    return np.where((kind == Kind.DROP) & upper, len(Kind), kind)


def draw_pairs(model: TransitionEntries, number: int, rng: np.random.Generator) -> list[Pair]:
    """Draw feasible pairs that were not measured themselves, as many of each of `GROUPS`.

    Args:
        model: entries by pair.
        number: of pairs in all; rounded up to a multiple of the groups.
        rng: draws them, without replacement.

    Returns:
        Pairs, the groups by turns.
    """
    keys = np.unique(model.key[model.evidence != Evidence.MEASURED])
    group = groups(keys)
    each = -(-number // len(GROUPS))
    drawn = [rng.choice(keys[group == g], each, replace=False) for g in range(len(GROUPS))]
    return [Pair.from_key(key) for key in np.stack(drawn, axis=1).ravel()]


def scores(model: TransitionEntries, trials: Iterable[Trial]) -> dict[str, Any]:
    """How often the likeliest state came about, and how often what came about was probable.

    By group, and over all: there each group counts by its share of the feasible pairs, since the
    draw has as many of each. ``expected`` is the share of hits that the model itself would predict
    for the same trials, ``probable_expected`` that of probable outcomes; a right model comes near.

    Args:
        model: entries by pair.
        trials: faults are counted and left out, as are pairs that the model does not have.
    """
    predicted = _predict(model)
    faults, absent = [], 0
    keys, hits = [], []
    for pair, _, record in trials:
        if record.outcome == Outcome.FAULT:
            faults.append({"state": pair.state, "action": pair.action, "fault": record.reason})
            continue
        probability = predicted.get(pair.key)
        if probability is None:
            absent += 1
            continue
        # Of equally likely states only one is predicted, the first.
        likeliest = max(probability, key=lambda state: (probability[state], -state))
        probable = {s: p for s, p in probability.items() if p >= PROBABLE}
        keys.append(pair.key)
        hits.append(
            (
                record.next_state == likeliest,
                record.next_state in probable,
                probability[likeliest],
                sum(probable.values()),
            )
        )

    group = groups(np.array(keys, dtype=np.int64))
    table = np.array(hits, dtype=float).reshape(-1, 4)
    shares = np.bincount(groups(list(predicted)), minlength=len(GROUPS)) / len(predicted)
    rows = [table[group == g] for g in range(len(GROUPS))]
    result: dict[str, Any] = {
        "trials": len(table),
        "faults": faults,
        "without_model": absent,
        "by_action": {
            name: {
                "trials": len(own),
                "share_of_pairs": float(share),
                "most_likely": _share(own[:, 0]),
                "probable": _share(own[:, 1]),
                "expected": float(own[:, 2].mean()) if len(own) else 0.0,
                "probable_expected": float(own[:, 3].mean()) if len(own) else 0.0,
            }
            for name, own, share in zip(GROUPS, rows, shares, strict=True)
        },
    }
    tried = [g for g in range(len(GROUPS)) if len(rows[g])]
    total = shares[tried].sum()
    for column, name in enumerate(("most_likely", "probable", "expected")):
        mean = [shares[g] * rows[g][:, column].mean() for g in tried]
        result[name] = float(sum(mean) / total) if tried else 0.0
    return result


def print_scores(result: dict[str, Any]) -> None:
    """One line for each of `GROUPS`, and one for all."""
    print(f"{'action':>17} {'trials':>7} {'likeliest':>10} {'expected':>9} {'probable':>9}")
    for name, row in result["by_action"].items():
        print(
            f"{name:>17} {row['trials']:7d} {row['most_likely'][0]:10.1%} "
            f"{row['expected']:9.1%} {row['probable'][0]:9.1%}"
        )
    print(
        f"{'by pairs':>17} {result['trials']:7d} {result['most_likely']:10.1%} "
        f"{result['expected']:9.1%} {result['probable']:9.1%}"
    )
    print(f"{len(result['faults'])} simulator faults")


def plot_validation(figure: Figure, result: dict[str, Any]) -> None:
    """Draw both shares by group, with their intervals."""
    figure.set_size_inches(9, 4)
    axes = figure.subplots()
    names = list(result["by_action"])
    for offset, (key, label) in enumerate(
        (("most_likely", "the likeliest state came about"), ("probable", "what came was probable"))
    ):
        shares = np.array([result["by_action"][name][key] for name in names])
        place = np.arange(len(names)) + 0.4 * offset - 0.2
        error = np.abs(shares[:, 1:] - shares[:, :1]).T
        axes.bar(place, shares[:, 0], width=0.38, label=label)
        axes.errorbar(place, shares[:, 0], yerr=error, fmt="none", color="black", capsize=3)
    trials = [result["by_action"][name]["trials"] for name in names]
    axes.set_xticks(
        range(len(names)), [f"{n}\n{t} trials" for n, t in zip(names, trials, strict=True)]
    )
    axes.set(ylabel="share of trials, 95 % interval", ylim=(0, 1.02))
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, 1.14), ncol=2, frameon=False)
    axes.grid(axis="y", alpha=0.3)


def _predict(model: TransitionEntries) -> dict[int, dict[int, float]]:
    """Probability by next state, by pair."""
    predicted: dict[int, dict[int, float]] = {}
    for k, s, p in zip(
        model.key.tolist(), model.next_state.tolist(), model.probability.tolist(), strict=True
    ):
        predicted.setdefault(k, {})[s] = p
    return predicted


def _share(hits: np.ndarray) -> list[float]:
    """Share and its 95 % interval; zeros without trials."""
    if not hits.size:
        return [0.0, 0.0, 1.0]
    return [float(hits.mean()), *wilson_interval(round(hits.sum()), hits.size)]
