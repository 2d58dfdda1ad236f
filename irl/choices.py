"""What a setting may be: a name that selects one of several behaviours, or a number with limits.

@dataclass(frozen=True)
class Config(Settings):
    step: Annotated[float, Limits(0, open_low=True)] = 1e-3
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from functools import cache
from typing import Any, Literal, TypeVar, get_args, get_origin, get_type_hints

import numpy as np

from irl.errors import InputError

FAR = 100_000
"""An upper end from here on guards time and memory alone; whoever is below the lower end is not
told of it."""


def check_choice(field: str, value: object, valid: Iterable[str]) -> None:
    """Refuse a name that selects nothing.

    Raises:
        InputError: if ``value`` is not among ``valid``; the message lists them all.
    """
    valid = tuple(valid)
    if value not in valid:
        raise InputError(f"unknown name {value!r}", place=field, valid=valid)


def check_number(field: str, value: Any, *, whole: bool = False) -> None:
    """Refuse what is no real number, or no whole one.

    Raises:
        InputError: naming the field and what came.
    """
    kind = np.asarray(value).dtype.kind if np.ndim(value) == 0 else "several"
    if kind not in ("iu" if whole else "fiub"):
        wanted = "a whole number" if whole else "a number"
        raise InputError(f"{wanted} wanted, is {value!r}", place=field)


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
        InputError: if ``value`` is outside, infinite, or not a number.
    """
    check_number(field, value)
    endless = high == float("inf")
    above = low < value if open_low else low <= value
    below = value < high if open_high or endless else value <= high
    if not (above and below):
        least = f"{'>' if open_low else '≥'} {_shown(low)}"
        most = f" and {'<' if open_high else '≤'} {_shown(high)}"
        if endless:
            most = " and finite" if value == high else ""
        elif high >= FAR and not above:
            most = ""
        raise InputError(f"must be {least}{most}, is {value}", place=field)


def _shown(number: float) -> str:
    """Whole numbers with all their digits."""
    return f"{number}" if isinstance(number, int) else f"{number:g}"


@dataclass(frozen=True)
class Limits:
    """The numbers that a field of settings may hold, as an annotation of its type.

    Of a field that holds several they bind each; one that may hold None, or names, may hold these
    still.

    Attributes:
        low: the least.
        high: the largest.
        open_low: whether ``low`` itself is refused.
        open_high: whether ``high`` itself is refused.
        some: whether a field that holds several must hold one at least, and none twice.
    """

    low: float
    high: float = float("inf")
    open_low: bool = False
    open_high: bool = False
    some: bool = False

    def check(self, field: str, value: Any, hint: Any = float) -> None:
        """Refuse what a field of that name and type may not hold.

        Raises:
            InputError: naming the field and what it may be.
        """
        if self.some:
            _check_some(field, value)
        several = get_origin(hint) is tuple
        names = [n for k in get_args(hint) if get_origin(k) is Literal for n in get_args(k)]
        if several and not isinstance(value, (tuple, list)):
            raise InputError(f"several numbers wanted, is {value!r}", place=field)
        for number in value if several else (value,):
            if number is not None and number not in names:
                check_number(field, number, whole=hint is int or int in get_args(hint))
                check_range(
                    *(field, number, self.low, self.high),
                    open_low=self.open_low,
                    open_high=self.open_high,
                )


@dataclass(frozen=True)
class Members:
    """The names that a field of settings may hold, one at least and none twice, as an annotation.

    Attributes:
        valid: all of them.
    """

    valid: tuple[str, ...]

    def check(self, field: str, value: tuple[str, ...], hint: Any = None) -> None:
        """Refuse what a field of that name may not hold.

        Raises:
            InputError: naming the field and what it may be.
        """
        _check_some(field, value)
        for name in value:
            check_choice(field, name, self.valid)


def _check_some(field: str, values: Any) -> None:
    """Refuse none, and one that is there twice: what was measured once would count twice."""
    if not isinstance(values, (tuple, list)):
        raise InputError(f"several values wanted, is {values!r}", place=field)
    if not values:
        raise InputError("at least one value is needed", place=field)
    for number, value in enumerate(values):
        if value in values[:number]:
            raise InputError(f"{value} is given twice", place=field)


class Settings:
    """Base of dataclasses of settings: every field is held to its ``Limits`` or ``Members``.

    A field that is a bool is held to be one.
    """

    def __post_init__(self) -> None:
        """Refuse values outside their limits; make settings of settings that come as a dict.

        Raises:
            InputError: naming the field and what it may be.
        """
        for field, limits, hint in _limits(type(self)):  # type: ignore[arg-type]  # hashable it is
            limits.check(field, getattr(self, field), hint)
        for field in _switches(type(self)):  # type: ignore[arg-type]
            if not isinstance(value := getattr(self, field), (bool, np.bool_)):
                raise InputError(f"must be true or false, is {value!r}", place=field)
        for field, kind in _nested(type(self)):  # type: ignore[arg-type]
            object.__setattr__(self, field, made(kind, getattr(self, field), field))


Kind = TypeVar("Kind", bound=Settings)


def made(kind: type[Kind], value: Kind | Mapping[str, Any] | None, field: str) -> Kind:
    """Settings of that kind: as they are, of fields by name, or the defaults for None.

    Raises:
        InputError: if there is no such field, a value is outside its limits, or what came is
            nothing of this.
    """
    if isinstance(value, kind):
        return value
    if value is None:
        return kind()
    if not isinstance(value, Mapping):
        raise InputError(
            f"{kind.__name__} wanted, or a dict of its fields, got {type(value).__name__}",
            place=field,
        )
    for name in value:
        check_choice(field, name, (each.name for each in fields(kind)))  # type: ignore[arg-type]
    try:
        return kind(**value)
    except InputError as error:
        raise InputError(str(error), place=field) from None


@cache
def _nested(settings: type) -> tuple[tuple[str, type[Settings]], ...]:
    """The fields of a class of settings that are settings themselves, and of which class."""
    hints = get_type_hints(settings)
    return tuple(
        (field, hint)
        for field, hint in hints.items()
        if isinstance(hint, type) and issubclass(hint, Settings)
    )


@cache
def _switches(settings: type) -> tuple[str, ...]:
    """The fields of a class of settings that are on or off."""
    return tuple(field for field, hint in get_type_hints(settings).items() if hint is bool)


@cache
def _limits(settings: type) -> tuple[tuple[str, Limits | Members, Any], ...]:
    """The fields of a class of settings that have limits, with these and their types."""
    return tuple(
        (field, limits, get_args(hint)[0])
        for field, hint in get_type_hints(settings, include_extras=True).items()
        for limits in getattr(hint, "__metadata__", ())
        if isinstance(limits, (Limits, Members))
    )
