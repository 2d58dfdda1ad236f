"""How the baselines climb: gradient ascent, thesis (3.14), a sparse variant, and L-BFGS."""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from itertools import count
from typing import Annotated

import numpy as np
from scipy.optimize import OptimizeResult, minimize

from irl.choices import Limits, Settings, check_range

Objective = Callable[[np.ndarray], tuple[float, np.ndarray]]
Callback = Callable[[int, float], None]
"""Told after each evaluation how many there were, and the value found."""

_MEMORY = 5  # a step may lose on the last value, but not on the worst of so many
_PROGRESS = 1e-4  # share of the predicted gain that a step must bring
_SHORTEST, _LONGEST = 1e-10, 1e10  # steps tried


@dataclass(frozen=True)
class AscentConfig(Settings):
    """When an ascent ends."""

    tolerance: Annotated[float, Limits(0)] = 1e-4
    """Largest gradient entry at which it ends; with a price on absolute entries, largest change
    that a unit step would make."""
    max_iterations: Annotated[int, Limits(0, 1_000_000_000)] = 200
    """Evaluations of the objective after which it ends in any case."""


@dataclass(frozen=True)
class RidgeConfig(AscentConfig):
    """How to climb a concave objective, less l2 |x|² / 2."""

    tolerance: Annotated[float, Limits(0)] = 1e-6
    max_iterations: Annotated[int, Limits(0, 1_000_000_000)] = 1000
    l2: Annotated[float, Limits(0, 1e9)] = 1e-3
    """Price of |x|² / 2 against the objective. Above 0 the solution is unique and finite, where
    flawless demonstrations would otherwise push it to infinity."""


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
    config: AscentConfig,
    callback: Callback | None = None,
) -> Ascent:
    """Climb by (3.14): x ← x + α ∇L, where α doubles after a gain and halves without one.

    Args:
        objective: value and gradient ``[d]`` at a point.
        x: where to begin.
        config: when to end.
        callback: follows the ascent.
    """
    value, gradient = objective(x)
    done, rate = 0, 1.0
    while done < config.max_iterations and np.abs(gradient).max(initial=0.0) > config.tolerance:
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
    config: AscentConfig,
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
        config: when to end.
        callback: follows the ascent.
    """
    smooth, gradient = objective(x)
    value = smooth - l1 * np.abs(x).sum()
    recent = deque([value], maxlen=_MEMORY)
    best, step, done = Ascent(x, value, 0), 1.0, 0
    while done < config.max_iterations:
        if np.abs(_shrink(x + gradient, l1) - x).max(initial=0.0) <= config.tolerance:
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


def sparse_ascend(
    objective: Objective,
    x: np.ndarray,
    sparsity: float,
    config: AscentConfig,
    callback: Callback | None = None,
) -> tuple[Ascent, float]:
    """Climb by ``proximal_ascend`` at a price that suits the objective.

    Args:
        objective: as there.
        x: as there.
        sparsity: the price as a share of that above which 0 would be best, in 0…1.
        config: as there.
        callback: as there.

    Returns:
        Where the ascent ended, and the price.

    Raises:
        InputError: if ``sparsity`` is out of range.
    """
    check_range("sparsity", sparsity, 0, 1)
    l1 = sparsity * np.abs(objective(np.zeros_like(x))[1]).max()
    return proximal_ascend(objective, x, l1, config, callback), l1


def ridge_ascend(
    objective: Objective,
    x: np.ndarray,
    config: RidgeConfig,
    ftol: float = 0.0,
    callback: Callback | None = None,
) -> np.ndarray:
    """Climb a concave L(x) − l2 |x|² / 2 by L-BFGS.

    Args:
        objective: L and its gradient ``[d]`` at a point.
        x: where to begin.
        config: l2, and when to end.
        ftol: relative gain of an iteration below which the ascent ends too.
        callback: told after each iteration, not each evaluation, how many there were, and the
            value found, the price off.

    Returns:
        Where the ascent ended, ``[d]``.
    """

    def loss(x: np.ndarray) -> tuple[float, np.ndarray]:
        value, gradient = objective(x)
        return config.l2 / 2 * (x @ x) - value, config.l2 * x - gradient

    iterations = count(1)

    def follow(intermediate_result: OptimizeResult) -> None:  # SciPy goes by this name
        if callback is not None:
            callback(next(iterations), -float(intermediate_result.fun))

    options = {"gtol": config.tolerance, "ftol": ftol, "maxiter": config.max_iterations}
    return minimize(loss, x, jac=True, method="L-BFGS-B", options=options, callback=follow).x


def _shrink(x: np.ndarray, by: float) -> np.ndarray:
    """Move every entry towards 0, and not beyond."""
    return np.sign(x) * np.maximum(np.abs(x) - by, 0.0)
