"""What RESULTS.md says first: ten claims, each with its figure and the command behind it."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from experiments.report.cells import points, share

Results = Mapping[str, dict[str, Any]]
"""Results that are kept, by name of their part."""
Claim = tuple[str, str, Callable[[dict[str, Any]], str]]
"""What it says, the part that it rests on, and its figure from that part's result."""


def told(claim: Claim, results: Results) -> str | None:
    """The figure of a claim; None if what it is read from was not measured."""
    _, name, figure = claim
    try:
        return figure(results[name])
    except LookupError:
        return None


def _row(result: dict[str, Any], **wanted: Any) -> dict[str, Any]:
    """The row of a result that has the values wanted.

    Raises:
        LookupError: if there is none.
    """
    for row in result["rows"]:
        if all(row[name] == value for name, value in wanted.items()):
            return row
    raise LookupError(f"no row with {wanted}")


def _cell(result: dict[str, Any], method: str, chosen: str) -> dict[str, Any]:
    return _row(result, method=method, demonstration_set=chosen, advice="none")


def _thesis(result: dict[str, Any]) -> str:
    own = [share(_cell(result, "thesis", name)["accuracy_strict"]) for name in SETS]
    return f"the same action: {', '.join(own)} % (thesis: 8, 15, 19)"


def _ours(result: dict[str, Any]) -> str:
    row = _cell(result, "fa_mlirl", "active")
    good, won = row["accuracy_optimal_all"], row["success_mdp"]
    return (
        f"an action as good in {share(good)} %, goal reached {share(won)} %, on the worst seed "
        f"{100 * min(good):.1f} and {100 * min(won):.1f}"
    )


def _ties(result: dict[str, Any]) -> str:
    row = _cell(result, "fa_mlirl", "active")
    return (
        f"{share(row['accuracy_strict'])} % of at most {share(row['accuracy_strict_ceiling'])} %; "
        f"without chance {share(row['strict_of_ceiling'])} % of that"
    )


def _few(labels: int) -> Callable[[dict[str, Any]], str]:
    def told(result: dict[str, Any]) -> str:
        row = _row(result, labels=labels, advice="none")
        good, won = share(row["accuracy_optimal_all"]), share(row["success_mdp"])
        return f"an action as good in {good} %, goal reached {won} %"

    return told


def _advice(result: dict[str, Any]) -> str:
    rows = [_row(result, labels=n, advice="action") for n in (7, 30, 160)]
    gains = ", ".join(points(row["gain"]["accuracy_optimal_all"]) for row in rows)
    lost = max(row["success_lost_at_most"] for row in rows)
    return f"{gains} points at 7, 30, 160 states; success lost at most {100 * lost:.1f}"


def _questions(result: dict[str, Any]) -> str:
    row = _row(result, learner="likelihood", strategy="visited_and_diverse")
    gain = row["against_random"]
    return (
        f"{points(gain['accuracy_optimal_all'])} points of accuracy, "
        f"{points(gain['success_mdp'])} of success over random ones"
    )


def _rewards(result: dict[str, Any]) -> str:
    rows = [
        row
        for row in result["summary"]
        if (row["method"], row["label_noise"], row["rewards"]) == ("goal_posterior", 0, "all")
    ]
    last = max(rows, key=lambda row: row["answers"])
    good = last["accuracy_optimal_all"]
    return (
        f"an action as good in {100 * good['mean']:.1f} %, at least {100 * good['least']:.1f}; "
        f"goal reached {100 * last['success_mdp']['mean']:.1f} %"
    )


def _enough(result: dict[str, Any]) -> str:
    return (
        f"ended {result['stopped']} of {result['lessons']} lessons, rightly in "
        f"{100 * (result['right_share'] or 0):.1f} %"
    )


def _grids(result: dict[str, Any]) -> str:
    return ", ".join(f"{row['size']}²: {share(row['accuracy'])} %" for row in result["rows"])


SETS = ("initial", "random", "active")
CLAIMS: Sequence[Claim] = (
    ("The thesis' network, made anew, and the thesis' own figures", "grasping/table", _thesis),
    ("Our network at 8.11 % of the states", "grasping/table", _ours),
    ("Its share of the demonstrator's very actions, beside the most", "grasping/table", _ties),
    ("Our network at 1 % of the states", "grasping/advice", _few(160)),
    ("Our network from 30 states", "grasping/advice", _few(30)),
    ("What advice on actions adds", "grasping/advice", _advice),
    ("What asking well adds, on the likelihood alone", "grasping/questions", _questions),
    ("Hidden rewards from one run and a few answers", "grasping/rewards", _rewards),
    ("Lessons that the learner ends itself", "grasping/enough", _enough),
    ("Grid-worlds", "gridworld", _grids),
)
