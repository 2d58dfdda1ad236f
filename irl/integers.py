"""Numbers that a user gives: taken as they are, or refused; never rounded, reshaped or wrapped."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from irl.errors import InputError

_REAL = "fiub"
_KINDS = {"b": "booleans", "f": "floats", "c": "complex numbers", "O": "objects"}


def unmasked(values: Any, place: str, wanted: str = "numbers") -> np.ndarray:
    """An array, or what becomes one, unless a mask leaves some of it out.

    Raises:
        InputError: if something is masked, of which plain arrays keep what is under the mask; or
            if no array can be made.
    """
    if np.ma.is_masked(values):
        raise InputError(
            f"{np.ma.count_masked(values)} entries are masked; leave them out, or give what is "
            "meant by them: .filled(value)",
            place=place,
        )
    try:
        return np.asarray(values)
    except (ValueError, TypeError, OverflowError) as error:  # ragged, or an integer beyond int64
        raise InputError(f"{wanted} wanted ({error})", place=place) from None


def reals(values: Any, place: str) -> NDArray[np.float64]:
    """Real numbers of any shape, as float64; NaN and infinity are left to the caller.

    Raises:
        InputError: if the values are no real numbers, or some are masked.
    """
    array = unmasked(values, place)
    if array.dtype.kind not in _REAL:
        raise InputError(f"real numbers wanted, got {array.dtype} {list(array.shape)}", place=place)
    return array.astype(np.float64, copy=False)


def integers(
    values: Any,
    place: str,
    *,
    columns: int | None = None,
    low: int | None = 0,
    below: int | None = None,
    dtype: type[np.integer] = np.int64,
) -> NDArray[Any]:
    """An array of integers, or an error that says what came and what to do.

    Args:
        values: an array, or what becomes one; empty ones may have any type.
        place: what to call it in an error.
        columns: None for an array ``[n]``, else the width of one ``[n, columns]``.
        low: the least that is allowed; None for what ``dtype`` holds.
        below: what every value must be less than; None for what ``dtype`` holds.
        dtype: type of the result.

    Raises:
        InputError: if the shape is another, the values are not integers, or one is out of range.
    """
    array = unmasked(values, place, "integers")
    wanted = "[n]" if columns is None else f"[n, {columns}]"
    if array.size == 0 and array.ndim <= (1 if columns is None else 2):
        return np.zeros((0,) if columns is None else (0, columns), dtype)
    came = f"{array.dtype} {list(array.shape)}"
    if array.ndim != (1 if columns is None else 2) or (
        columns is not None and array.shape[1] != columns
    ):
        raise InputError(
            f"integers {wanted} wanted, got {came}{_advice(array, columns)}", place=place
        )
    if array.dtype.kind not in "iu":
        kind = _KINDS.get(array.dtype.kind, "other things")
        remedy = {
            "b": "; give the indices, numpy.flatnonzero(mask)",
            "f": "; if they are whole numbers, convert them first: .astype(int)",
        }.get(array.dtype.kind, "")
        raise InputError(f"integers {wanted} wanted, got {kind} ({came}){remedy}", place=place)
    holds = np.iinfo(dtype)
    least = holds.min if low is None else max(low, int(holds.min))
    most = int(holds.max) if below is None else min(below - 1, int(holds.max))
    wrong = np.argwhere((array < least) | (array > most))
    if wrong.size:
        first = tuple(wrong[0].tolist())
        raise InputError(
            f"must lie in {least}…{most}, is {array[first]} in row {first[0]}", place=place
        )
    return array.astype(dtype)


def _advice(array: np.ndarray, columns: int | None) -> str:
    """What to do about a wrong shape, where that can be guessed."""
    if columns is None or array.ndim != 2:
        return ""
    remedies = []
    if array.shape[1] > columns:
        remedies.append(f"if the first {columns} columns are meant, give [:, :{columns}]")
    if array.shape[0] == columns:
        remedies.append("if it is transposed, give its .T")
    return "".join(f"; {remedy}" for remedy in remedies)
