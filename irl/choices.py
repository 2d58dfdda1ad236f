"""Names that select one of several behaviours."""

from collections.abc import Iterable

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
