"""The Gen3 Lite's inverse kinematics, first stage: one polynomial and back substitution.

All solutions of the arm with right angles and the lengths of its description, by the method of
Zohour et al. (2021): reduce the unknowns to one, find the roots of its polynomial, compute the
other joints from each. The derivation is our own; its unknown is q6.

**Geometry.** With right angles, consecutive axes intersect, but for 2 and 3, which are parallel
and a = 0.28 m apart. Let S be where axes 1 and 2 meet, at height h, and write

    k  the direction of axis 6, E's z;          w = p − d6 k − S   where axes 5 and 6 meet,
    u  that of axis 5, = cos q6 x_E − sin q6 y_E ⊥ k,   r = w − d5 u   where 4 and 5 meet,
    f  that of axis 4, f ⊥ u, with the forearm d4 f,
    n = (sin q1, −cos q1, 0)  that of axis 2, f ⊥ n, with the offset δ n from S to axis 4.

q6 gives u and r. The arm lies in a plane across n, hence (1) n·r = δ: two planes. In it the
upper arm spans |r − δ n − d4 f| = a, or with f ∥ n × u

    (2)   A² (1 − (n·u)²) − 4 d4² (n·(u × w))² = 0,   A = |r|² − δ² + d4² − a².

**Elimination.** Let v = u × w, X = r_x² + r_y², and let × and |·| below take x and y alone. By
(1), n = (δ r ± √(X − δ²) r^⊥) / X. The product of (2) over both signs is F / X², with

    F = (L X − U)² + 4 δ² (G (L − E) + (X − δ²) L M (u × v)²),        L = A², M = 4 d4²,
    G = L (r × u)² + M (r × v)²,   E = L |u|² + M |v|²,   U = δ² E + G.

In q6, the components of u, r, v and A are trigonometric polynomials of degree 1, X of degree 2
and F of degree 8: with z = exp(i q6) an ordinary polynomial of degree 16, given by 17 values of
F. To compute these nothing is divided by and no branch chosen. δ = 10 mm is small, so F is nearly
a square: solutions with the shoulder turned over have almost the same q6.

**Back substitution.** A root gives u and r; (1) n and q1; (2) f up to its sign; the upper arm
r − δ n − d4 f gives q2; f gives q3, u gives q4, and k gives q5. Where n ∥ u, (2) leaves f open;
there the length of the upper arm gives it.
"""

import numpy as np
from numpy.typing import NDArray

from models.compiled import compiled
from models.gen3_lite.chain import ORIGIN
from models.gen3_lite.trigonometric_roots import trigonometric_roots

Array = NDArray[np.float64]
Vector = tuple[float, float, float]

SOLUTIONS = 16
"""Most solutions of one pose: the degree of the polynomial."""

# Lengths of the arm with right angles [m], as the module's docstring calls them.
_HEIGHT = ORIGIN[0, 2] + ORIGIN[1, 2]
_OFFSET = -ORIGIN[1, 1] - ORIGIN[3, 2]
_UPPER_ARM = ORIGIN[2, 1]
_FOREARM = ORIGIN[4, 2] - ORIGIN[3, 1]
_WRIST = ORIGIN[4, 0] + ORIGIN[5, 2]
_HAND = -ORIGIN[5, 0]

_NEAR_CIRCLE = 0.05  # |log |z|| of roots that may be real, rounding and the exact chain considered
_SPREAD = 3.0  # such a root's q6 per log |z|: a mirrored pair starts on either side
_ON_CIRCLE = 1e-9  # |log |z|| of roots that are real
_CLOSED, _ALMOST = 2e-3, 0.02  # largest misfit at roots on the circle, and near it [m, -]
_PARALLEL = 0.05  # sine of the angle between n and u below which the elbow gives f


def out_of_reach(R_BE: Array, p_BE: Array) -> NDArray[np.bool_]:
    """Whether the wrist is further from the shoulder than the arm is long.

    That proves that there is no solution; the arm cannot reach every pose that is nearer.

    Args:
        R_BE: rotations of the end effector in the base ``[..., 3, 3]``.
        p_BE: its positions ``[..., 3]`` [m].
    """
    wrist = p_BE - _HAND * R_BE[..., 2] - np.array([0.0, 0.0, _HEIGHT])
    longest = np.hypot(_UPPER_ARM + _FOREARM, _OFFSET) + _WRIST
    # What the rounded right angles may add is below 1e-5 m.
    return np.linalg.norm(wrist, axis=-1) > longest + 1e-5


@compiled()
def polynomials(R: Array, p: Array) -> Array:
    """F at 17 equispaced q6, the first of them 0, for n poses: ``[n, 17]``."""
    values = np.empty((len(R), SOLUTIONS + 1))
    for i in range(len(R)):
        for j in range(SOLUTIONS + 1):
            w, u, r = _wrist(2.0 * np.pi * j / (SOLUTIONS + 1), R[i], p[i])
            v = _cross(u, w)
            A = _dot(r, r) - _OFFSET**2 + _FOREARM**2 - _UPPER_ARM**2
            X = r[0] ** 2 + r[1] ** 2
            L, M = A**2, 4.0 * _FOREARM**2
            G = L * (r[0] * u[1] - r[1] * u[0]) ** 2 + M * (r[0] * v[1] - r[1] * v[0]) ** 2
            E = L * (u[0] ** 2 + u[1] ** 2) + M * (v[0] ** 2 + v[1] ** 2)
            U = _OFFSET**2 * E + G
            twist = (X - _OFFSET**2) * L * M * (u[0] * v[1] - u[1] * v[0]) ** 2
            values[i, j] = (L * X - U) ** 2 + 4.0 * _OFFSET**2 * (G * (L - E) + twist)
    return values


def approximate(R: Array, p: Array) -> tuple[NDArray[np.int64], Array, Array]:
    """Find every solution of the right-angled arm, and what comes close to one.

    Args:
        R: rotations of the end effector in the base ``[n, 3, 3]``.
        p: its positions ``[n, 3]`` [m].

    Returns:
        Of k answers, pose by pose: which pose each is of ``[k]``, the joint angles ``[k, 6]``
        [rad], and by how much they miss the upper arm's length [m] or the right angle of u and
        f ``[k]``.
    """
    roots = trigonometric_roots(polynomials(R, p))
    rough = np.empty((len(R), 4 * SOLUTIONS, 6))
    closure = np.full(rough.shape[:2], np.nan)
    _approximate(R, p, roots, rough, closure)
    written = ~np.isnan(closure)
    return np.nonzero(written)[0], rough[written], closure[written]


@compiled(error_model="numpy")
def _approximate(
    R: Array, p: Array, roots: NDArray[np.complex128], rough: Array, closure: Array
) -> None:
    for i in range(len(R)):
        _approximate_one(R[i], p[i], roots[i], rough[i], closure[i])


@compiled(error_model="numpy")
def _approximate_one(
    R: Array, p: Array, roots: NDArray[np.complex128], rough: Array, closure: Array
) -> None:
    count = 0
    for z in roots:
        if not abs(np.log(abs(z))) < _NEAR_CIRCLE:  # also where there is no root: NaN
            continue
        q6 = np.angle(z) + _SPREAD * np.log(abs(z))
        allowed = _CLOSED if abs(np.log(abs(z))) < _ON_CIRCLE else _ALMOST
        _, u, r = _wrist(q6, R, p)
        tilt = np.arccos(min(1.0, _OFFSET / np.hypot(r[0], r[1])))
        for branch in range(4):
            bearing = np.arctan2(r[1], r[0]) + (tilt if branch < 2 else -tilt)
            n = (np.cos(bearing), np.sin(bearing), 0.0)
            across = _dot(r, n)
            planar = (r[0] - across * n[0], r[1] - across * n[1], r[2])  # from the shoulder
            f = _forearm(n, u, planar, 1.0 - 2.0 * (branch & 1))
            upper_arm = _sum(1.0, planar, -_FOREARM, f)
            stretch = np.sqrt(_dot(upper_arm, upper_arm)) - _UPPER_ARM
            misfit = max(abs(stretch), abs(_dot(f, u)))
            if misfit < allowed:
                closure[count] = misfit
                _joints(n, u, f, upper_arm, R, rough[count])
                rough[count, 5] = q6
                count += 1


@compiled()
def _wrist(q6: float, R: Array, p: Array) -> tuple[Vector, Vector, Vector]:
    """Vectors w, u and r."""
    c, s = np.cos(q6), np.sin(q6)
    w = (p[0] - _HAND * R[0, 2], p[1] - _HAND * R[1, 2], p[2] - _HAND * R[2, 2] - _HEIGHT)
    u = (c * R[0, 0] - s * R[0, 1], c * R[1, 0] - s * R[1, 1], c * R[2, 0] - s * R[2, 1])
    return w, u, _sum(1.0, w, -_WRIST, u)


@compiled(error_model="numpy")
def _forearm(n: Vector, u: Vector, planar: Vector, sign: float) -> Vector:
    """Direction f across n, and across u too unless that is open; then so that the elbow closes."""
    f = _cross(n, u)
    length = np.sqrt(_dot(f, f))
    if length > _PARALLEL:
        return _sum(sign / length, f, 0.0, f)
    reach = np.sqrt(_dot(planar, planar))
    cosine = (reach**2 + _FOREARM**2 - _UPPER_ARM**2) / (2.0 * _FOREARM * reach)
    bend = sign * np.arccos(min(max(cosine, -1.0), 1.0))
    return _sum(np.cos(bend) / reach, planar, np.sin(bend) / reach, _cross(n, planar))


@compiled()
def _joints(n: Vector, u: Vector, f: Vector, upper_arm: Vector, R: Array, q: Array) -> None:
    """Write q1 to q5 into ``q [6]``."""
    q[0] = np.arctan2(n[0], -n[1])
    q[1] = np.arctan2(upper_arm[0] * n[1] - upper_arm[1] * n[0], upper_arm[2])
    # x axes of links 2 and 3; z_2 = n = -z_3.
    x2 = (-np.cos(q[1]) * n[1], np.cos(q[1]) * n[0], np.sin(q[1]))
    q[2] = np.arctan2(_dot(f, x2), _dot(f, _cross(n, x2)))
    q[3] = np.arctan2(-_dot(u, n), _dot(u, _cross(f, n)))
    k = (R[0, 2], R[1, 2], R[2, 2])
    q[4] = np.arctan2(-_dot(k, _cross(f, u)), _dot(k, f))


@compiled()
def _dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@compiled()
def _sum(s: float, a: Vector, t: float, b: Vector) -> Vector:
    """Linear combination s a + t b."""
    return s * a[0] + t * b[0], s * a[1] + t * b[1], s * a[2] + t * b[2]


@compiled()
def _cross(a: Vector, b: Vector) -> Vector:
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )
