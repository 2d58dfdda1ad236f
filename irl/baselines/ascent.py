"""How the baselines climb: gradient ascent, thesis (3.14), and its sparse variant."""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

Objective = Callable[[np.ndarray], tuple[float, np.ndarray]]
Callback = Callable[[int, float], None]
"""Told after each evaluation how many there were, and the value found."""

_MEMORY = 5  # a step may lose on the last value, but not on the worst of so many
_PROGRESS = 1e-4  # share of the predicted gain that a step must bring
_SHORTEST, _LONGEST = 1e-10, 1e10  # steps tried


@dataclass(frozen=True)
class Ascent:
    """Where an ascent ended.

    Attributes:
        x: the weights, ``[d]``.
        value: the objective there, penalty included.
        iterations: evaluations of the objective after the first.
    """

    x: np.ndarray
    value: float
    iterations: int


def ascend(
    objective: Objective,
    x: np.ndarray,
    *,
    tolerance: float,
    max_iterations: int,
    callback: Callback | None = None,
) -> Ascent:
    """Climb by (3.14): x ← x + α ∇L, where α doubles after a gain and halves without one.

    Args:
        objective: value and gradient ``[d]`` at a point.
        x: where to begin.
        tolerance: largest gradient entry at which the ascent ends.
        max_iterations: the ascent ends after so many evaluations in any case.
        callback: follows the ascent.
    """
    value, gradient = objective(x)
    done, rate = 0, 1.0
    while done < max_iterations and np.abs(gradient).max(initial=0.0) > tolerance:
        further = x + rate * gradient
        there = objective(further)
        done += 1
        if callback is not None:
            callback(done, there[0])
        if there[0] > value:
            x, (value, gradient) = further, there
            rate *= 2
        else:
            rate /= 2
    return Ascent(x, value, done)


def proximal_ascend(
    objective: Objective,
    x: np.ndarray,
    l1: float,
    *,
    tolerance: float,
    max_iterations: int,
    callback: Callback | None = None,
) -> Ascent:
    """Climb L(x) − l1 |x|₁ by proximal steps (ISTA) of Barzilai and Borwein's length.

    This is SpaRSA (Wright, Nowak & Figueiredo 2009): after a step along the gradient every entry
    is pulled towards 0 by l1 times the step, and stays there if it is small. A step is halved
    until the objective exceeds the least of the last five.

    Args:
        objective: L and its gradient ``[d]`` at a point.
        x: where to begin.
        l1: price of the absolute entries, from 0.
        tolerance: the ascent ends where a step of length 1 would move no entry by more.
        max_iterations: the ascent ends after so many evaluations in any case.
        callback: follows the ascent.
    """
    smooth, gradient = objective(x)
    value = smooth - l1 * np.abs(x).sum()
    recent = deque([value], maxlen=_MEMORY)
    best, step, done = Ascent(x, value, 0), 1.0, 0
    while done < max_iterations:
        if np.abs(_shrink(x + gradient, l1) - x).max(initial=0.0) <= tolerance:
            break
        further = _shrink(x + step * gradient, l1 * step)
        moved = further - x
        smooth, gradient_there = objective(further)
        value = smooth - l1 * np.abs(further).sum()
        done += 1
        if callback is not None:
            callback(done, value)
        if value < min(recent) + _PROGRESS / (2 * step) * (moved @ moved):
            step /= 2
            if step < _SHORTEST:
                break
            continue
        # The curvature met along the way is the next step's inverse length.
        bend = -moved @ (gradient_there - gradient)
        step = min(moved @ moved / bend, _LONGEST) if bend > 0 else min(2 * step, _LONGEST)
        x, gradient = further, gradient_there
        recent.append(value)
        if value > best.value:
            best = Ascent(x, value, done)
    return Ascent(best.x, best.value, done)


def _shrink(x: np.ndarray, by: float) -> np.ndarray:
    """Move every entry towards 0, and not beyond."""
    return np.sign(x) * np.maximum(np.abs(x) - by, 0.0)
