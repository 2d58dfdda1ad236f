"""How grid-worlds, sailing and seconds an iteration are told: sections' lines, in Markdown."""

from experiments.report.cells import Result, share, share_of, tabled


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


ADVISERS = {
    "uncertain_cluster": "the most uncertain cluster",
    "random_cluster": "a cluster by chance",
    "uncertain_state": "the most uncertain state",
    "random_advice": "a state by chance",
}
"""Whom the expert is asked about, in words."""


def sailing(result: Result) -> list[str]:
    """Questions until the target, and what all advice comes to, by strategy."""
    rows = []
    for name, words in ADVISERS.items():
        values, objective = (
            result[kind][name] for kind in ("queries_to_target", "objective_queries_to_target")
        )
        last = result["curves"][name][-1]
        rows.append((words, _questions(values), share_of(last[1:]), _questions(objective)))
    target = f"{100 * result['target']:g} %"
    head = [
        "the expert is asked about",
        f"questions until {target}",
        "after all questions, %",
        f"until {target}, in the objective too",
    ]
    return [
        f"Lakes of {result['states']} states, {len(result['seeds'])} seeds, "
        f"{result['clusters']} clusters. Performance is 0 for acting by chance,",
        "100 % for the best. Advice counts in the action values, as in Algorithm 4.1; in the last",
        "column in what is maximised as well.",
        "",
        *tabled(head, rows),
    ]


def _questions(told: Result) -> str:
    """How many, with the interval; none if all there are were not enough."""
    numbers = [told[name] for name in ("queries", "low", "high")]
    first, *rest = ("more than all" if number is None else f"{number:g}" for number in numbers)
    return f"{first} [{', '.join(rest)}]"
