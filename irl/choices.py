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
        raise InputError(f"{field}: unknown name {value!r}; choose one of {', '.join(valid)}")


def check_range(
    field: str, value: float, low: float, high: float = float("inf"), open_low: bool = False
) -> None:
    """Refuse a number outside ``low…high``, or equal to ``low`` if that end is open.

    Raises:
        InputError: if ``value`` is outside, or not a number.
    """
    if not (low < value <= high if open_low else low <= value <= high):
        sign = ">" if open_low else "≥"
        upper = "" if high == float("inf") else f" and ≤ {high:g}"
        raise InputError(f"{field}: must be {sign} {low:g}{upper}, is {value}")
