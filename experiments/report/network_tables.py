"""How results on the network of Algorithm 4.1 are told: sections' lines, in Markdown."""

from experiments.grasping.tables.table import THESIS_TABLE
from experiments.report.cells import Result, points, share, share_of, tabled

SETS = {
    "initial": "981 states, 6.14 %",
    "random": "asked at random, 14.25 %",
    "active": "asked by the learner, 8.11 %",
}
ADVICE = {"none": "no advice", "action": "on actions", "state": "on states", "both": "both"}
FORMS = {"doubt": "doubted", "mask": "excluded", "thesis": "as in the thesis"}
_FIGURES = ("predicted_accuracy", "true_accuracy", "true_success")
METHODS = {"thesis": "thesis' network", "fa_mlirl": "ours"}


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
    """Few labels, with and without advice; and with answers some of which are wrong."""
    head = ["states shown", "advice", "an action as good", "gain", "goal reached", "gain"]
    head += ["success lost at most"]
    rows = [(str(row["labels"]), ADVICE[row["advice"]], *_gained(row)) for row in result["rows"]]
    lines = [
        f"The demo's learner, no questions, all twenty clusters answered; {len(result['seeds'])}",
        "seeds, per cent, gains in points on the same seeds. 160 states are 1 %.",
        "",
        *tabled(head, rows),
    ]
    if not result.get("wrong_rows"):
        return lines
    wrong = [
        (str(row["labels"]), f"{100 * row['wrong']:.0f} %", FORMS[row["advice"]], *_gained(row))
        for row in result["wrong_rows"]
    ]
    return [
        *lines,
        "**What is made of advice on actions, right and wrong** (thesis 6.1). A wrong answer wants",
        "avoided half of what is right somewhere in its cluster, and prefers an action that is",
        "wrong throughout. *Excluded*: what is avoided is out, unless that costs the way to where",
        "demonstrations ended. *Doubted*, the demo's way: so too, but not where it costs much by",
        "what was learnt from labels. *As in the thesis*: an avoided action is worth −2, a",
        "preferred one gains 20 % of |Q|.",
        "",
        *tabled(["states shown", "wrong answers", "what is avoided is", *head[2:]], wrong),
    ]


def _gained(row: Result) -> tuple[str, ...]:
    accuracy, success = "accuracy_optimal_all", "success_mdp"
    return (
        share(row[accuracy]),
        points(row["gain"][accuracy]),
        share(row[success]),
        points(row["gain"][success]),
        f"{100 * row['success_lost_at_most']:.1f}",
    )


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
        "alone, which asks one question after the other; *default*: the demo's, which asks ten at",
        "a time. No strategy can add more success than random questions leave to be gained:",
        f"{left_by_chance(result)}.",
        "",
        *tabled(head, rows),
    ]


def left_by_chance(result: Result) -> str:
    """Points of success that random questions leave to be gained, by learner."""
    return ", ".join(
        f"{100 * (1 - row['success_mdp'][0]):.1f} points of *{row['learner']}*"
        for row in result["rows"]
        if row["strategy"] == "random"
    )


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
        "Answers are right, and obeyed.",
        "",
        *tabled(head, rows),
    ]


def network(result: Result) -> list[str]:
    """Sizes of the network, and what it sees of a state."""
    rows = [
        (
            "–".join(map(str, row["hidden"])),
            row["features"],
            share(row["accuracy_optimal_all"]),
            share(row["success_mdp"]),
            f"{sum(row['seconds']) / len(row['seconds']):.1f}",
        )
        for row in result["rows"]
    ]
    return tabled(
        ["hidden units", "features", "an action as good", "goal reached", "seconds"], rows
    )


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


def ensemble(result: Result) -> list[str]:
    """When the network and the planning learner would stop asking, by two rules."""
    rows = []
    for row in result["rows"]:
        figures = ["", "", "", ""]
        if row["ended"]:
            mean, low, high = row["labels"]
            figures = [f"{mean:.0f} [{low:.0f}, {high:.0f}]"]
            figures += [share_of(row[name]) for name in _FIGURES]
        told = (row["learner"], row["rule"], *(str(row[n]) for n in ("lessons", "ended", "wrong")))
        rows.append((*told, *figures))
    return [
        "Neither has a posterior. So members learn from 63 % of the labels each. Where they let",
        "pass what the learner would do it predicts that it is right; whether it arrives where",
        "runs ended, the transition model says (`irl.ensemble`). It stops when it predicts 95 and",
        "99 % at two checks in a row, ten answers apart. *Policy unchanged*: at two checks",
        "in a row what it would have done before will still do in 99 % of the states. A stop is",
        "wrong where the goal is reached from less than 99 %, or an action as good taken in less",
        "than 90 %. The reward is the demo's; per cent.",
        "",
        *tabled(
            [
                *("learner", "rule", "lessons", "ended", "wrongly", "at labels"),
                *("as good, predicted", "as good", "goal reached"),
            ],
            rows,
        ),
    ]
