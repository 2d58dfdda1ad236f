"""What a setting may be: a name that selects one of several behaviours, or a number with limits.

@dataclass(frozen=True)
class Config(Settings):
    step: Annotated[float, Limits(0, open_low=True)] = 1e-3
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from typing import get_type_hints

from irl.errors import InputError


def check_choice(field: str, value: object, valid: Iterable[str]) -> None:
    """Refuse a name that selects nothing.

    Raises:
        InputError: if ``value`` is not among ``valid``; the message lists them all.
    """
    valid = tuple(valid)
    if value not in valid:
        raise InputError(f"unknown name {value!r}", place=field, valid=valid)


def check_range(
    field: str,
    value: float,
    low: float,
    high: float = float("inf"),
    *,
    open_low: bool = False,
    open_high: bool = False,
) -> None:
    """Refuse a number outside ``low…high``, or equal to an end that is open.

    Raises:
        InputError: if ``value`` is outside, or not a number.
    """
    above = low < value if open_low else low <= value
    below = value < high if open_high else value <= high
    if not (above and below):
        least = f"{'>' if open_low else '≥'} {low:g}"
        most = "" if high == float("inf") else f" and {'<' if open_high else '≤'} {high:g}"
        raise InputError(f"must be {least}{most}, is {value}", place=field)


@dataclass(frozen=True)
class Limits:
    """The numbers that a field of settings may hold, as an annotation of its type.

    Attributes:
        low: the least.
        high: the largest.
        open_low: whether ``low`` itself is refused.
        open_high: whether ``high`` itself is refused.
    """

    low: float
    high: float = float("inf")
    open_low: bool = False
    open_high: bool = False


class Settings:
    """Base of frozen dataclasses of settings: every field is held to its ``Limits``."""

    def __post_init__(self) -> None:
        """Refuse values outside their limits.

        Raises:
            InputError: naming the field and what it may be.
        """
        for field, limits in _limits(type(self)):  # type: ignore[arg-type]  # hashable it is
            check_range(
                field,
                getattr(self, field),
                limits.low,
                limits.high,
                open_low=limits.open_low,
                open_high=limits.open_high,
            )


@cache
def _limits(settings: type) -> tuple[tuple[str, Limits], ...]:
    """The fields of a class of settings that have limits, with these."""
    return tuple(
        (field, limits)
        for field, hint in get_type_hints(settings, include_extras=True).items()
        for limits in getattr(hint, "__metadata__", ())
        if isinstance(limits, Limits)
    )
