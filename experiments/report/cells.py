"""How figures are written in RESULTS.md: shares, gains, tables in Markdown."""

from collections.abc import Iterable, Sequence
from typing import Any

from experiments.grasping.tables.options import spread

Result = dict[str, Any]
"""A part's ``result.json``."""


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
