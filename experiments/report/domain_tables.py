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


def sailing(result: Result) -> list[str]:
    """Performance at the last question, by strategy."""
    rows = [
        (name, f"{curve[-1][0]:g}", share_of(curve[-1][1:]))
        for name, curve in result["curves"].items()
    ]
    return tabled(["strategy", "questions", "performance, %"], rows)
