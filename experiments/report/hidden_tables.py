"""How results on hidden rewards and few labels are told: sections' lines, in Markdown."""

from experiments.report.cells import Result, share_of, tabled


def rewards(result: Result) -> list[str]:
    """Hidden rewards by learner; by kind of reward where no label is wrong.

    Where some are, of all, and of those whose costs all have names.
    """
    rows = [
        (
            row["method"],
            str(row["answers"]),
            f"{100 * row['label_noise']:.0f} %",
            row["rewards"],
            str(row["number"]),
            *_spread(row["success_mdp"]),
            *_spread(row["accuracy_optimal_all"]),
            f"{row['labels']['mean']:.1f}",
        )
        for row in result["summary"]
        if row["label_noise"] == 0 or row["rewards"] in ("all", "named costs")
    ]
    head = ["learner", "answers", "wrong labels", "rewards", "number", "goal reached", "least"]
    return tabled([*head, "an action as good", "least", "labels"], rows)


def _spread(told: Result) -> tuple[str, str]:
    """Mean and interval, and the least."""
    return share_of([told[name] for name in ("mean", "low", "high")]), f"{100 * told['least']:.1f}"


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
                    str(result[f"{group}reaches"]),
                    str(result[f"{group}unsure"]),
                    f"{result[f'{group}contradicted_reaches']} of {result[f'{group}contradicted']}",
                    f"{result[f'{group}labels_mean']:.1f}",
                    "–" if right is None else f"{result[f'{group}stopped_labels_mean']:.1f}",
                )
            )
    simple = [
        (each["rule"], str(each["stopped"]), str(each["wrong"]), *_means(each))
        for each in result["simple_rules"]
    ]
    head = ["a simpler rule", "would have ended", "wrongly", "at labels"]
    return [
        "A lesson is *ended* when the learner says that it reaches the goal the way it is liked,",
        "*rightly* if it does from 99 % of the starts and takes an action as good in 90 %. Else it",
        "says that it has *not understood* how it is liked, or is *not sure* of the goal; beside",
        "that, of lessons in which an audit contradicted it, those in which it said the former.",
        "",
        f"Of {result['checks']} checks that predict success, {result['checks_right']} are right.",
        "",
        *tabled(
            [
                *("rewards", "lessons", "ended", "rightly", "not understood", "not sure"),
                *("of contradicted", "labels", "of those ended"),
            ],
            rows,
        ),
        *tabled([*head, "goal reached", "an action as good"], simple),
    ]


def _means(rule: Result) -> tuple[str, ...]:
    """What a simpler rule comes to on average, if it would have ended any lesson."""
    if not rule["stopped"]:
        return "", "", ""
    means = [rule[f"{name}_mean"] for name in ("success_mdp", "accuracy_optimal_all")]
    return f"{rule['labels_mean']:,.1f}", *(f"{100 * mean:.1f}" for mean in means)


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
    return [
        "The method `planning` keeps, of what it learnt, the rewards where runs ended, if these",
        "explain as many labels as all do: that asks the labels alone. Such a reward is *pruned*;",
        "*as learnt* is beside it. Either goes with a *caution*, one number for how much uncertain",
        "outcomes are minded: the mean of its posterior. From one run that is nearly the mean of",
        "its prior, for hardly a label tells. Without it one run comes to 89.9 on these task data,",
        "where most cubes tumble that drop from the upper layer; of a demonstrator that does not",
        "mind, as much would be lost by it. This reward is a goal, caution and little else. The",
        "demo's `one_trajectory` is learnt by `goal_posterior`: it also learns what else somebody",
        "minds about actions, asks for what it does not know, and says when it knows enough.",
        "",
        *tabled([*head, "least", "seconds"], rows),
    ]
