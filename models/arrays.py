"""Arrays and numbers from users: finite reals of the shape that is wanted, or refused.

Drake ends the program where an assertion of its own fails, and NumPy's messages name neither the
argument nor what it should be. Whatever takes numbers from a user therefore looks at them first.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from models.errors import ModelError

Array = NDArray[np.float64]


def finite_array(value: ArrayLike, trailing: tuple[int, ...], name: str) -> Array:
    """Give ``value [..., *trailing]`` back as float64.

    Args:
        value: what a user handed in.
        trailing: the last dimensions that it must have; any may come before them.
        name: what messages call it.

    Raises:
        ModelError: if it is no array of real numbers, the shape is another, or an entry is not
            finite.
    """
    array = _reals(value, name)
    if array.shape[array.ndim - len(trailing) :] != trailing or array.ndim < len(trailing):
        wanted = ", ".join(["...", *map(str, trailing)])
        raise ModelError(f"{name} has shape {list(array.shape)}; wanted [{wanted}]")
    return _finite(array, name)


def refuse_first(bad: NDArray[np.bool_], name: str, say: Callable[[tuple[int, ...]], str]) -> None:
    """Refuse a stack of arrays of which some are bad; name the first of them.

    Args:
        bad: bool ``[...]``, one for each; of a single array ``[]``.
        name: what messages call the stack.
        say: from the index of the first to what is wrong with it.

    Raises:
        ModelError: if any is bad.
    """
    for index in np.argwhere(bad)[:1]:
        first = tuple(index.tolist())
        raise ModelError(f"{name}{''.join(f'[{i}]' for i in first)} {say(first)}")


def finite_vector(value: ArrayLike, size: int, name: str) -> Array:
    """Give ``value [size]`` back as float64.

    Raises:
        ModelError: if it is anything but so many finite real numbers in a row.
    """
    # What planning asks thousands of times a second.
    if type(value) is np.ndarray and value.dtype == np.float64 and value.shape == (size,):
        array = value
    else:
        array = _reals(value, name)
    if array.shape != (size,):
        raise ModelError(f"{name} has shape {list(array.shape)}; wanted [{size}]")
    return _finite(array, name)


def finite_number(
    value: ArrayLike, name: str, *, above: float = -np.inf, valid: str = "a finite number"
) -> float:
    """Give a number back as a float.

    Args:
        value: what a user handed in.
        name: what messages call it.
        above: what the number must be above.
        valid: the valid choices, in words.

    Raises:
        ModelError: if it is anything but a single finite real number above ``above``.
    """
    if type(value) is float and above < value < np.inf:
        return value
    try:
        number = _reals(value, name)
    except ModelError:
        number = np.full(2, np.nan)
    if number.ndim != 0 or not np.isfinite(number) or number <= above:
        raise ModelError(f"{name}: {_shown(value)}; valid: {valid}")
    return float(number)


def _reals(value: ArrayLike, name: str) -> Array:
    try:
        array = np.asarray(value)
    except (TypeError, ValueError):  # ragged lists among others
        array = np.empty(0, dtype=object)
    if array.dtype.kind not in "fiu":  # complex, truth values, text, dates, objects
        raise ModelError(f"{name}: {_shown(value)}; wanted real numbers")
    return array.astype(np.float64, copy=False)


def _finite(array: Array, name: str) -> Array:
    if not np.isfinite(array).all():
        raise ModelError(f"{name} holds a value that is not finite; wanted finite numbers only")
    return array


def _shown(value: object) -> str:
    text = repr(value.item() if isinstance(value, np.generic) else value)
    return text if len(text) <= 60 else f"{text[:57]}..."
