"""Extended Kalman filter over a pose and many landmarks of two numbers each (eqs 23-27).

A measurement touches the pose and the landmarks seen, 3 + 2 m columns of the state: H is kept to those, and P is
changed by a product of thin matrices. Only the lower triangle of P is stored, so it cannot lose its symmetry.
"""

import math

import numpy as np
from numpy.typing import NDArray

from contourslam.contour.contours import Floats, Ints
from contourslam.kernels import kernel
from contourslam.slam.measurement import KIND, innovation


@kernel
def landmark_columns(chosen: Ints) -> Ints:
    """Columns of the state that belong to the pose and the chosen landmarks."""
    columns = np.empty(3 + 2 * chosen.size, dtype=np.int64)
    columns[0], columns[1], columns[2] = 0, 1, 2
    for k in range(chosen.size):
        columns[3 + 2 * k], columns[4 + 2 * k] = 3 + 2 * chosen[k], 4 + 2 * chosen[k]
    return columns


@kernel
def covariance_columns(covariance: Floats, size: int, columns: Ints) -> Floats:
    """Whole columns of the covariance as rows of an array (len(columns), size), from its lower triangle."""
    out = np.empty((columns.size, size))
    for k in range(columns.size):
        c = columns[k]
        for i in range(c):
            out[k, i] = covariance[c, i]
    for i in range(size):
        for k in range(columns.size):
            if i >= columns[k]:
                out[k, i] = covariance[i, columns[k]]
    return out


@kernel
def covariance_block(covariance: Floats, columns: Ints) -> Floats:
    """Square block of the covariance for the given columns."""
    out = np.empty((columns.size, columns.size))
    for a in range(columns.size):
        for b in range(columns.size):
            i, j = columns[a], columns[b]
            out[a, b] = covariance[i, j] if i >= j else covariance[j, i]
    return out


@kernel
def cholesky(matrix: Floats) -> Floats:
    """Lower factor of a small symmetric positive definite matrix; its last diagonal is -1 where it is not one."""
    n = matrix.shape[0]
    lower = np.zeros((n, n))
    for i in range(n):
        for j in range(i + 1):
            total = matrix[i, j]
            for k in range(j):
                total -= lower[i, k] * lower[j, k]
            if i == j:
                if not total > 0.0:
                    lower[n - 1, n - 1] = -1.0
                    return lower
                lower[i, i] = math.sqrt(total)
            else:
                lower[i, j] = total / lower[j, j]
    return lower


@kernel
def _subtract_gram(covariance: Floats, w: Floats, size: int) -> None:
    """P -= W^T W on the lower triangle: two rows of P and four of W at a time, which spares memory traffic.

    The number above the diagonal that comes along with each second row is never read.
    """
    rank = w.shape[0]
    even = size - size % 2
    for i in range(0, even, 2):
        p, q = covariance[i], covariance[i + 1]
        k = 0
        while k + 4 <= rank:
            a, b, c, d = w[k], w[k + 1], w[k + 2], w[k + 3]
            ai, bi, ci, di = a[i], b[i], c[i], d[i]
            aj, bj, cj, dj = a[i + 1], b[i + 1], c[i + 1], d[i + 1]
            for m in range(i + 2):
                x, y, z, t = a[m], b[m], c[m], d[m]
                p[m] -= ai * x + bi * y + ci * z + di * t
                q[m] -= aj * x + bj * y + cj * z + dj * t
            k += 4
        while k < rank:
            a = w[k]
            ai, aj = a[i], a[i + 1]
            for m in range(i + 2):
                p[m] -= ai * a[m]
                q[m] -= aj * a[m]
            k += 1
    for i in range(even, size):
        for k in range(rank):
            factor = w[k, i]
            for m in range(i + 1):
                covariance[i, m] -= factor * w[k, m]


@kernel
def correct(
    mean: Floats, covariance: Floats, size: int, columns: Ints, jacobian: Floats, nu: Floats, noise: Floats
) -> float:
    """Correction of the filter, in place (eqs 25-27), with ``K = P H^T S^-1`` applied through one Cholesky factor.

    Parameters
    ----------
    mean : ndarray, shape (>= size,)
    covariance : ndarray, shape (>= size, >= size)
        Lower triangle.
    size : int
        Numbers in the state.
    columns : ndarray of int, shape (c,)
        Columns of H that are not zero.
    jacobian : ndarray, shape (z, c)
        These columns.
    nu : ndarray, shape (z,)
        Innovation, angles wrapped.
    noise : ndarray, shape (z, z)
        Covariance of the measurement (Q of eq. 25).

    Returns
    -------
    float
        Normalised innovation squared, ``nu^T S^-1 nu``; -1, and nothing is changed, where S is not positive definite.
    """
    z, c = jacobian.shape
    gathered = covariance_columns(covariance, size, columns)
    w = np.zeros((z, size))  # H P, then W = L^-1 H P
    for a in range(z):
        for k in range(c):
            h = jacobian[a, k]
            if h != 0.0:
                for i in range(size):
                    w[a, i] += h * gathered[k, i]
    s = noise.copy()
    for b in range(z):
        for k in range(c):
            h = jacobian[b, k]
            if h != 0.0:
                for a in range(b, z):  # the factorisation reads the lower triangle only
                    s[a, b] += w[a, columns[k]] * h
    lower = cholesky(s)
    if lower[z - 1, z - 1] <= 0.0:
        return -1.0
    y = np.empty(z)
    nis = 0.0
    for a in range(z):
        total = nu[a]
        for b in range(a):
            total -= lower[a, b] * y[b]
            factor = lower[a, b]
            for i in range(size):
                w[a, i] -= factor * w[b, i]
        scale = 1.0 / lower[a, a]
        y[a] = total * scale
        nis += y[a] * y[a]
        for i in range(size):
            w[a, i] *= scale
    for a in range(z):
        for i in range(size):
            mean[i] += w[a, i] * y[a]
    mean[2] = -((-mean[2] + math.pi) % (2.0 * math.pi) - math.pi)
    _subtract_gram(covariance, w, size)
    return nis


@kernel
def stack(
    rows: Ints, landmarks: Ints, values: Floats, noises: Floats, table: Floats, expected: Floats, by_pose: Floats,
    by_landmark: Floats,
) -> tuple[Floats, Floats, Floats]:  # fmt: skip
    """Jacobian, innovation and noise of several matched observations, ready for :func:`correct`."""
    m = rows.size
    jacobian, nu, noise = np.zeros((2 * m, 3 + 2 * m)), np.empty(2 * m), np.zeros((2 * m, 2 * m))
    for k in range(m):
        i, j, a = rows[k], landmarks[k], 2 * k
        jacobian[a : a + 2, :3] = by_pose[j]
        jacobian[a : a + 2, 3 + a : 5 + a] = by_landmark[j]
        nu[a], nu[a + 1] = innovation(table[j, KIND], values[i], expected[j])
        noise[a : a + 2, a : a + 2] = noises[i]
    return jacobian, nu, noise


@kernel
def augment(
    mean: Floats, covariance: Floats, size: int, a: float, b: float, by_pose: Floats, by_measurement: Floats,
    noise: Floats,
) -> None:  # fmt: skip
    """Append a landmark with its full cross-covariance: P_l = J_pose P, P_ll = J_pose P J_pose^T + J_z Q J_z^T.

    Parameters
    ----------
    mean, covariance : ndarray
        State and lower triangle, with room for two more.
    size : int
        Numbers in the state before.
    a, b : float
        The landmark.
    by_pose, by_measurement : ndarray, shapes (2, 3) and (2, 2)
        Jacobians of the landmark by the pose and by the measurement.
    noise : ndarray, shape (2, 2)
        Covariance of the measurement.
    """
    for r in range(2):
        for i in range(size):
            total = 0.0
            for k in range(3):
                total += by_pose[r, k] * (covariance[i, k] if i >= k else covariance[k, i])
            covariance[size + r, i] = total
    for r in range(2):
        for q in range(r + 1):
            total = 0.0
            for k in range(3):
                total += covariance[size + r, k] * by_pose[q, k]
            for k in range(2):
                for m in range(2):
                    total += by_measurement[r, k] * noise[k, m] * by_measurement[q, m]
            covariance[size + r, size + q] = total
    mean[size], mean[size + 1] = a, b


@kernel
def remove(mean: Floats, covariance: Floats, size: int, at: int) -> None:
    """Marginalise the landmark whose two numbers stand at `at`: its rows and columns go, the rest moves up."""
    for i in range(at, size - 2):
        mean[i] = mean[i + 2]
        for j in range(i + 1):
            covariance[i, j] = covariance[i + 2, j] if j < at else covariance[i + 2, j + 2]


def symmetric(covariance: Floats, size: int) -> NDArray[np.float64]:
    """Full symmetric covariance from its lower triangle.

    Parameters
    ----------
    covariance : ndarray, shape (>= size, >= size)
    size : int

    Returns
    -------
    ndarray, shape (size, size)
    """
    lower = np.tril(covariance[:size, :size])
    return np.asarray(lower + np.tril(lower, -1).T)
