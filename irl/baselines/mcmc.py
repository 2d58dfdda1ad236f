"""Markov chain Monte Carlo under a Gaussian prior, and whether it has converged."""

import math
from collections.abc import Callable, Iterator
from typing import Generic, NamedTuple, TypeVar

import numpy as np

TARGET = 0.3  # share of proposals accepted that the adaptation aims at
_FADING = 0.6  # exponent of the adaptation's decay, between 1/2 and 1

Extra = TypeVar("Extra")


class Step(NamedTuple, Generic[Extra]):
    """Where a chain is after one proposal.

    Attributes:
        x: the parameters.
        log_likelihood: theirs.
        extra: what else their evaluation gave.
        accepted: whether the proposal was taken.
    """

    x: np.ndarray
    log_likelihood: float
    extra: Extra
    accepted: bool


def crank_nicolson(
    log_likelihood: Callable[[np.ndarray], tuple[float, Extra]],
    start: np.ndarray,
    scale: float,
    rng: np.random.Generator,
    burn_in: int,
) -> Iterator[Step[Extra]]:
    """Metropolis–Hastings by preconditioned Crank–Nicolson steps, Cotter et al. (2013).

    The proposal √(1 − ε²) x + ε ξ, ξ drawn from the prior N(0, scale² I), leaves the prior as it
    is, so that the likelihood alone decides about acceptance, and ε need not shrink as parameters
    grow in number.

    Args:
        log_likelihood: of parameters ``[d]``, in nats, and anything else worth keeping.
        start: ``[d]``.
        scale: the prior's standard deviation, above 0.
        rng: the only source of chance.
        burn_in: proposals, not yielded, in which ε adapts; it is fixed afterwards.

    Yields:
        The chain's steps, without end.
    """
    x = np.array(start, dtype=np.float64)
    value, extra = log_likelihood(x)
    log_epsilon = math.log(0.5)
    k = 0
    while True:
        epsilon = math.exp(log_epsilon)
        proposal = math.sqrt(1 - epsilon**2) * x + epsilon * scale * rng.standard_normal(x.size)
        there, extra_there = log_likelihood(proposal)
        log_ratio = there - value
        accepted = bool(math.log(1 - rng.random()) <= log_ratio)
        if accepted:
            x, value, extra = proposal, there, extra_there
        k += 1
        if k <= burn_in:
            surplus = math.exp(min(log_ratio, 0.0)) - TARGET
            log_epsilon = min(log_epsilon + surplus * k**-_FADING, 0.0)
        else:
            yield Step(x, value, extra, accepted)


def split_r_hat(draws: np.ndarray) -> np.ndarray:
    """Potential scale reduction of halved chains, Gelman et al. (2013), section 11.4.

    Args:
        draws: ``[n_chains, n_draws, ...]``, at least 4 draws a chain.

    Returns:
        ``[...]``, near 1 where the chains agree; 1 where nothing varies.
    """
    n = draws.shape[1] // 2
    halves = np.concatenate([draws[:, :n], draws[:, n : 2 * n]])
    within = halves.var(axis=1, ddof=1).mean(axis=0)
    between = halves.mean(axis=1).var(axis=0, ddof=1)
    return np.sqrt(np.where(within > 0, (n - 1) / n + between / np.where(within > 0, within, 1), 1))


def effective_sample_size(draws: np.ndarray) -> np.ndarray:
    """How many independent draws tell as much of the mean, Gelman et al. (2013), section 11.5.

    Autocorrelations are summed in pairs of neighbouring lags as long as these are positive,
    Geyer (1992).

    Args:
        draws: ``[n_chains, n_draws, ...]``, at least 4 draws a chain.

    Returns:
        ``[...]``, at most the number of draws.
    """
    m, n = draws.shape[:2]
    flat = draws.reshape(m, n, -1)
    deviation = flat - flat.mean(axis=1, keepdims=True)
    spectrum = np.abs(np.fft.rfft(deviation, 2 * n, axis=1)) ** 2
    covariance = np.fft.irfft(spectrum, axis=1)[:, :n].mean(axis=0) / n
    within = covariance[0] * n / (n - 1)
    total = within * (n - 1) / n + (flat.mean(axis=1).var(axis=0, ddof=1) if m > 1 else 0.0)
    correlation = 1 - (within - covariance) / np.where(total > 0, total, 1.0)
    correlation[0] = 1.0
    pairs = correlation[: n - n % 2].reshape(n // 2, 2, -1).sum(axis=1)
    pairs = np.where(np.logical_and.accumulate(pairs > 0, axis=0), pairs, 0.0)
    size = np.where(total > 0, m * n / np.maximum(2 * pairs.sum(axis=0) - 1, 1.0), m * n)
    return size.reshape(draws.shape[2:])
