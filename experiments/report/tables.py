"""How each kept result is told: sections' lines, in Markdown."""

from collections.abc import Iterable, Sequence
from typing import Any

from experiments.grasping.tables.options import spread
from experiments.grasping.tables.table import THESIS_TABLE

Result = dict[str, Any]
SETS = {
    "initial": "981 states, 6.14 %",
    "random": "asked at random, 14.25 %",
    "active": "asked by the learner, 8.11 %",
}
ADVICE = {"none": "no advice", "action": "on actions", "state": "on states", "both": "both"}
METHODS = {"thesis": "thesis' network", "fa_mlirl": "ours"}


def share(values: Sequence[float]) -> str:
    """Mean and 95 % interval over seeds, in per cent; one seed alone has no interval."""
    if len(values) == 1:
        return f"{100 * values[0]:.1f} (one seed)"
    return share_of(spread(values))


def share_of(told: Sequence[float]) -> str:
    """The same from [mean, low, high]."""
    mean, low, high = (f"{100 * value:.1f}" for value in told)
    return f"{mean} [{low}, {high}]"


def points(told: Sequence[float]) -> str:
    """A gain [mean, low, high] in percentage points."""
    mean, low, high = (f"{round(100 * value, 1) + 0.0:+.1f}" for value in told)
    return f"{mean} [{low}, {high}]"


def tabled(head: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """A table in Markdown."""
    return [f"| {' | '.join(cells)} |" for cells in (head, ["---"] * len(head), *rows)] + [""]


def table_6_3(result: Result) -> list[str]:
    """Thesis Table 6.3 beside ours."""
    rows = [
        (
            METHODS[row["method"]],
            SETS[row["demonstration_set"]],
            ADVICE[row["advice"]],
            f"{100 * THESIS_TABLE[row['demonstration_set']][list(ADVICE).index(row['advice'])]:.0f}"
            if row["method"] == "thesis"
            else "",
            share(row["accuracy_strict"]),
            share(row["accuracy_strict_ceiling"]),
            share(row["accuracy_optimal_all"]),
            f"{100 * min(row['accuracy_optimal_all']):.1f}",
            share(row["success_mdp"]),
            f"{100 * min(row['success_mdp']):.1f}",
            str(len(row["success_mdp"])),
        )
        for row in result["rows"]
    ]
    head = ["network", "demonstrated", "advice", "thesis", "the same action", "its ceiling"]
    head += ["an action as good", "worst", "goal reached", "worst", "seeds"]
    return [
        "All in per cent. *The same action*: in 100 states never shown, the one that the",
        "demonstrator draws there; *its ceiling*: what a perfect policy can expect of that, since",
        "equally good actions are drawn alike. *An action as good*: over all unseen states. The",
        "column *thesis* is Table 6.3 as printed. The thesis' network made anew has another",
        "transition model, demonstrator and optimiser than the thesis' author had; what is",
        "alike is that it takes what cannot be done for Q = 0, and hardly ever reaches the goal.",
        "",
        *tabled(head, rows),
        *_of_ceiling(result),
    ]


def _of_ceiling(result: Result) -> list[str]:
    (ours,) = [
        row
        for row in result["rows"]
        if (row["method"], row["demonstration_set"], row["advice"])
        == ("fa_mlirl", "active", "none")
    ] or [None]
    if ours is None:
        return []
    ratio = [
        a / b for a, b in zip(ours["accuracy_strict"], ours["accuracy_strict_ceiling"], strict=True)
    ]
    return [
        "The same action, as a share of its ceiling, ours at 8.11 % without advice: "
        f"{share(ratio)} % over 100 draws a seed, {100 * min(ratio):.0f} % on the worst. That is",
        "the chance of a hundred draws: the demonstrator itself, asked twice, agrees with itself",
        "in no larger a share. Without that chance, as expected over all unseen states, it is",
        f"{share(ours['strict_of_ceiling'])} %, and {100 * min(ours['strict_of_ceiling']):.1f} % "
        "on the worst.",
        "",
    ]


def ladder(result: Result) -> list[str]:
    """One change at a time."""
    rows = [
        (
            row["change"],
            share(row["accuracy_strict"]),
            share(row["accuracy_optimal_all"]),
            share(row["success_mdp"]),
        )
        for row in result["rows"]
    ]
    return [
        f"981 demonstrated states, no questions, no advice; {len(result['seeds'])} seeds, %.",
        "",
        *tabled(["change", "the same action", "an action as good", "goal reached"], rows),
    ]


def advice(result: Result) -> list[str]:
    """Few labels, with and without advice."""
    rows = [
        (
            str(row["labels"]),
            ADVICE[row["advice"]],
            share(row["accuracy_optimal_all"]),
            points(row["gain"]["accuracy_optimal_all"]),
            share(row["success_mdp"]),
            points(row["gain"]["success_mdp"]),
            f"{100 * row['success_lost_at_most']:.1f}",
        )
        for row in result["rows"]
    ]
    head = ["states shown", "advice", "an action as good", "gain", "goal reached", "gain"]
    return [
        f"The demo's learner, no questions, all twenty clusters answered; {len(result['seeds'])}",
        "seeds, per cent, gains in points on the same seeds. 160 states are 1 %.",
        "",
        *tabled([*head, "success lost at most"], rows),
    ]


def questions(result: Result) -> list[str]:
    """Strategies compared with random questions."""
    low, high = result["labels"]
    rows = [
        (
            row["learner"],
            f"`{row['strategy']}`",
            share_of(row["accuracy_optimal_all"]),
            points(row["against_random"]["accuracy_optimal_all"]),
            share_of(row["success_mdp"]),
            points(row["against_random"]["success_mdp"]),
        )
        for row in result["rows"]
    ]
    head = ["learner", "strategy", "an action as good", "gain", "goal reached", "gain"]
    return [
        f"From {low} demonstrated states to {high}; gains over random questions in points, on the",
        f"same {len(result['seeds'])} seeds. *likelihood*: a network that climbs the likelihood",
        "alone; *default*: the demo's. That one reaches the goal from everywhere with 30 states",
        "already, as the table of few labels says: no question can add to its success.",
        "",
        *tabled(head, rows),
    ]


def clusters(result: Result) -> list[str]:
    """Who drew the clusters that were asked about."""
    rows = [
        (
            row["drawn"],
            str(row["answers"]),
            share_of(row["excluded"]),
            points(row["gain"]),
            points(row["lost"]),
        )
        for row in result["rows"]
    ]
    head = ["clusters", "answers", "pairs excluded, %", "gain of accuracy", "success lost"]
    return [
        f"From {result['labels']} demonstrated states; {len(result['seeds'])} seeds, points.",
        "",
        *tabled(head, rows),
    ]


def network(result: Result) -> list[str]:
    """Sizes of the network."""
    rows = [
        (
            "–".join(map(str, row["hidden"])),
            share(row["accuracy_optimal_all"]),
            share(row["success_mdp"]),
            f"{sum(row['seconds']) / len(row['seconds']):.1f}",
        )
        for row in result["rows"]
    ]
    return tabled(["hidden units", "an action as good", "goal reached", "seconds"], rows)


def model_free(result: Result) -> list[str]:
    """Moves seen in place of the transition model."""
    rows = [
        (
            f"{row['transitions']:,}",
            str(row["trajectories"]),
            share(row["accuracy_optimal_all"]),
            share(row["success_mdp"]),
        )
        for row in result["rows"]
    ]
    head = ["moves tried", "trajectories shown", "an action as good", "goal reached"]
    return tabled(head, rows)


def larger(result: Result) -> list[str]:
    """More states."""
    rows = [
        (
            f"{row['states']:,}",
            str(row["labels"]),
            share(row["accuracy_optimal_all"]),
            share(row["success_mdp"]),
            f"{sum(row['seconds']) / len(row['seconds']):.1f}",
        )
        for row in result["rows"]
    ]
    return tabled(["states", "labels", "an action as good", "goal reached", "seconds"], rows)


def rewards(result: Result) -> list[str]:
    """Hidden rewards by learner."""
    rows = [
        (
            row["method"],
            str(row["answers"]),
            f"{100 * row['label_noise']:.0f} %",
            row["rewards"],
            str(row["number"]),
            *(f"{100 * row[name]['mean']:.1f}" for name in ("success_mdp", "accuracy_optimal_all")),
            f"{100 * row['accuracy_optimal_all']['least']:.1f}",
            f"{row['labels']['mean']:.1f}",
        )
        for row in result["summary"]
    ]
    head = ["learner", "answers", "wrong labels", "rewards", "number", "goal reached"]
    return tabled([*head, "an action as good", "least", "labels"], rows)


def enough(result: Result) -> list[str]:
    """Lessons that the learner ends, and what simpler rules would have ended."""
    groups = {"": "all", "named_": "every cost has a name", "nameless_": "a cost without a name"}
    rows = []
    for group, told in groups.items():
        if f"{group}stopped" in result:
            right = result[f"{group}right_share"]
            rows.append(
                (
                    told,
                    str(result[f"{group}lessons"]),
                    str(result[f"{group}stopped"]),
                    "–" if right is None else f"{100 * right:.1f} %",
                    str(result[f"{group}reaches"] + result[f"{group}unsure"]),
                    f"{result[f'{group}labels_mean']:.1f}",
                )
            )
    simple = [
        (each["rule"], str(each["stopped"]), str(each["wrong"]), f"{each['labels_mean'] or 0:.1f}")
        for each in result["simple_rules"]
    ]
    return [
        f"Of {result['checks']} checks that predict success, {result['checks_right']} are right.",
        "",
        *tabled(["rewards", "lessons", "ended", "rightly", "refused", "labels"], rows),
        *tabled(["a simpler rule", "would have ended", "wrongly", "at labels"], simple),
    ]


def planning(result: Result) -> list[str]:
    """What one trajectory, and labels often wrong, teach the planning learner."""
    rows = [
        (
            f"{100 * row['label_noise']:.0f} %",
            row["reward"],
            str(row["seeds"]),
            f"{row['labels']['mean']:.1f}",
            *(f"{100 * row[name]['mean']:.1f}" for name in ("success_mdp", "accuracy_optimal_all")),
            f"{100 * row['accuracy_optimal_all']['least']:.1f}",
            f"{row['seconds']['mean']:.1f}",
        )
        for row in result["summary"]
    ]
    head = ["wrong labels", "reward", "seeds", "labels", "goal reached", "an action as good"]
    return tabled([*head, "least", "seconds"], rows)


def gridworld(result: Result) -> list[str]:
    """Table 6.2 and accuracy."""
    rows = [
        (
            f"{row['size']} × {row['size']}",
            f"{100 * row['demonstrated_fraction']:.2f}",
            share(row["accuracy"]),
            f"{1000 * row['seconds_per_iteration']:.2f}",
            f"{1000 * row['seconds_per_iteration_thesis']:.1f}",
            str(len(row["seeds"])),
        )
        for row in result["rows"]
    ]
    head = ["grid", "demonstrated, %", "goal reached, %", "ms an iteration", "thesis", "seeds"]
    return tabled(head, rows)


def complexity(result: Result) -> list[str]:
    """Table 6.1: seconds an iteration."""
    names = list(dict.fromkeys(name for row in result["rows"] for name in row["seconds"]))
    rows = [
        (
            f"{row['states']:,}",
            *(f"{row['seconds'][n]:.3g}" if n in row["seconds"] else "" for n in names),
        )
        for row in result["rows"]
    ]
    return [
        "Seconds an iteration, ours; Table 6.1 as published is in the result.",
        "",
        *tabled(["states", *(f"`{name}`" for name in names)], rows),
    ]


def sailing(result: Result) -> list[str]:
    """Performance at the last question, by strategy."""
    rows = [
        (name, f"{curve[-1][0]:g}", share_of(curve[-1][1:]))
        for name, curve in result["curves"].items()
    ]
    return tabled(["strategy", "questions", "performance, %"], rows)
