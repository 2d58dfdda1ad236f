"""What goes on being earned: x = b + γ W x, the linear system of a policy's values.

W has no entry below 0 and rows that sum to 1 at most. Sweeps of x ← b + γ W x need 1/(1 − γ) steps
for each digit. Where a chain of states mixes fast, a Krylov method
needs few steps whatever γ is. Where it mixes slowly, few states lie between its parts, as in grids
and chains, and then factors of I − M are sparse. So the one is tried first and the other after it;
but where states lead to many others, and γ is small enough, sweeps are tried before factors, which
fill up: those of a soft policy of 16,000 states take minutes. The answer is refined by residuals of
twice the care (Wilkinson): near γ = 1 a value of 1e6 with an error of 1e-10 of it would hide what
an action costs.
"""

from functools import cached_property

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import bicgstab, splu

LARGEST = 100_000
"""States up to which I − γ W is factorised, should the Krylov method not do."""
_KRYLOV_STEPS = 60
_KRYLOV = 1e-8  # relative residual of a Krylov solution, before it is refined
_REFINEMENTS = 8
_FEW = 5000  # sweeps that may come before factors,
_MANY = 10  # where a state leads to more than so many others, on average


class Onward:
    """Solves x = b + γ W x.

    Attributes:
        W: square, in CSR form; no entry is below 0, no row's sum above 1, or else no column's.
        gamma: γ, below 1.
        krylov: whether the Krylov method is tried; False once it did not do.
        work: multiplications spent so far, about.
    """

    def __init__(self, W: sparse.csr_matrix, gamma: float, krylov: bool = True) -> None:
        """Do nothing yet."""
        self.W = W
        self.gamma = gamma
        self.krylov = krylov
        self.work = 0

    def solve(self, b: np.ndarray) -> np.ndarray | None:
        """Solve for x ``[n]``, to rounding.

        Args:
            b: ``[n]``, finite.

        Returns:
            x, or None if W is too large for an answer.
        """
        x = np.zeros(b.size)
        scale = np.abs(b).max(initial=0.0)
        if scale == 0:
            return x
        careful, gamma = self.W.astype(np.longdouble), np.longdouble(self.gamma)
        left, last = b, np.inf
        for _ in range(_REFINEMENTS):
            step = self._approximately(left)
            if step is None:
                return None
            x = x + step
            size = np.abs(step).max()
            # At rounding already, or no longer getting nearer to it.
            if size <= 1e-16 * np.abs(x).max() or size > last / 2:
                break
            exact = x.astype(np.longdouble)
            left, last = (b - (exact - gamma * (careful @ exact))).astype(np.float64), size
            self.work += careful.nnz
            if not left.any():
                break
        return x

    def _approximately(self, b: np.ndarray) -> np.ndarray | None:
        if self.krylov:
            steps = 0

            def count(_: np.ndarray) -> None:
                nonlocal steps
                steps += 1

            # Of size 1: SciPy takes products of small residuals for a breakdown.
            A, size = self._system, np.abs(b).max()
            x, failed = bicgstab(A, b / size, rtol=_KRYLOV, maxiter=_KRYLOV_STEPS, callback=count)
            self.work += 2 * steps * (A.nnz + 5 * b.size)
            if not failed and np.isfinite(x).all():
                return x * size
            self.krylov = False
        if self.W.nnz > _MANY * b.size and self._sweeps <= _FEW:
            return self._swept(b)
        if b.size > LARGEST:
            return None
        return self._factors.solve(b)

    @property
    def _sweeps(self) -> int:
        """How many leave no more than the Krylov method may: of x, at most γⁿ / (1 − γ) |b|."""
        if self.gamma == 0:
            return 0
        return int(np.ceil(np.log(_KRYLOV * (1 - self.gamma)) / np.log(self.gamma)))

    def _swept(self, b: np.ndarray) -> np.ndarray:
        x = b
        for _ in range(self._sweeps):
            x = b + self.gamma * (self.W @ x)
        self.work += self._sweeps * self.W.nnz
        return x

    @cached_property
    def _system(self) -> sparse.csr_matrix:
        return (sparse.identity(self.W.shape[0], format="csr") - self.gamma * self.W).tocsr()

    @cached_property
    def _factors(self):  # SciPy does not name the type
        factors = splu(self._system.tocsc())
        self.work += 10 * factors.nnz
        return factors
