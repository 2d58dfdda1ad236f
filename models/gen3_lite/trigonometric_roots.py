"""Roots of real trigonometric polynomials, through companion matrices.

f(x) = Σ_{|k| ≤ d} c_k exp(i k x), with c_{−k} the conjugate of c_k. The coefficients follow from
2d + 1 equispaced values by a discrete Fourier transform; z = exp(i x) makes z^d f an ordinary
polynomial of degree 2d. Its roots on the unit circle are the real roots of f; the others come in
pairs mirrored at the circle, and close to it where f almost touches zero.
"""

import numpy as np
from numpy.typing import NDArray

_NEGLIGIBLE = 1e-14  # of the largest coefficient: what rounding alone leaves


def trigonometric_roots(values: NDArray[np.float64]) -> NDArray[np.complex128]:
    """Find every complex root z = exp(i x) of n polynomials, in no order.

    Args:
        values: f at the angles 2π i / (2d + 1), ``[n, 2d + 1]``.

    Returns:
        Roots ``[n, 2d]``; NaN for those that highest harmonics of zero take away.
    """
    harmonics = np.fft.rfft(values) / values.shape[1]
    size = np.abs(harmonics)
    present = size > _NEGLIGIBLE * size.max(axis=1, initial=0.0, keepdims=True)
    degree = np.where(present, np.arange(size.shape[1]), 0).max(axis=1, initial=0)
    roots = np.full((len(values), values.shape[1] - 1), np.nan, dtype=np.complex128)
    for d in np.unique(degree[degree > 0]):
        these = np.flatnonzero(degree == d)
        c = harmonics[these, : d + 1]
        lower = np.concatenate([c[:, -2::-1], c[:, 1:].conj()], axis=1)  # of z^(2d-1) to 1
        companion = np.zeros((len(these), 2 * d, 2 * d), dtype=np.complex128)
        companion[:, 0] = -lower / c[:, -1:]
        companion[:, np.arange(1, 2 * d), np.arange(2 * d - 1)] = 1.0
        roots[these, : 2 * d] = np.linalg.eigvals(companion)
    return roots
