"""Rotation matrices as logs print them, with six decimals: made rotations again."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from models.arrays import refuse_first
from models.errors import ModelError

Array = NDArray[np.float64]

SIX_DECIMALS = 1.5e-6
"""Farthest that rounding nine entries to six decimals moves a matrix (Frobenius): 3 × 0.5e-6."""


def renormalised(R: ArrayLike, tolerance: float = SIX_DECIMALS, name: str = "R") -> Array:
    """The rotations nearest to ``R [..., 3, 3]``, by singular values.

    Every other function wants rotations to `models.rotations.ORTHONORMAL`, which six decimals do
    not keep. What comes out is at most as far from ``R`` as the matrix that was printed, and
    within twice that of it.

    Args:
        R: matrices, as they were printed.
        tolerance: largest distance (Frobenius) to the nearest rotation; for ``d`` decimals that
            were rounded it is 1.5 · 10⁻ᵈ, twice that if they were cut off.
        name: what messages call ``R``.

    Raises:
        ModelError: if the shape is another, an entry is not a finite number, the tolerance is not
            between 0 and 0.1, or a matrix is farther than that from every rotation, as a
            reflection is.
    """
    if not 0.0 < tolerance <= 0.1:
        raise ModelError(f"tolerance {tolerance}; valid: above 0, up to 0.1")
    try:
        matrices = np.asarray(R, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ModelError(f"{name}: {error}; valid: numbers [..., 3, 3]") from None
    if matrices.shape[-2:] != (3, 3):
        raise ModelError(f"{name} has shape {list(matrices.shape)}; valid: [..., 3, 3]")
    if not np.isfinite(matrices).all():
        raise ModelError(f"{name} holds a value that is not finite; valid: finite numbers")
    U, _, Vt = np.linalg.svd(matrices)
    # Without this the nearest orthogonal matrix to a reflection would be one.
    U[..., 2] *= np.linalg.det(U @ Vt)[..., None]
    nearest = U @ Vt
    distance = np.linalg.norm(matrices - nearest, axis=(-2, -1))
    bad = distance > tolerance
    refuse_first(
        bad,
        name,
        lambda first: (
            f"is {distance[first]:.3g} from the nearest rotation; valid: at most {tolerance:g}"
        ),
    )
    return nearest
