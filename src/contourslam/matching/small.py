"""Symmetric 3 x 3 matrices, as kernels: faster than a general solver, and needed once or more a scan."""

import math

import numpy as np

from contourslam.contour.contours import Floats
from contourslam.geometry.poses import compose_one
from contourslam.kernels import kernel


@kernel
def invert(matrix: Floats) -> Floats:
    """Inverse of a symmetric positive definite 3 x 3 matrix; rows and columns are scaled to like size first."""
    s = np.empty(3)
    for i in range(3):
        s[i] = 1.0 / math.sqrt(max(matrix[i, i], 1e-300))
    a, b, c = 1.0, matrix[0, 1] * s[0] * s[1], matrix[0, 2] * s[0] * s[2]
    d, e, f = 1.0, matrix[1, 2] * s[1] * s[2], 1.0
    out = np.empty((3, 3))
    out[0, 0], out[0, 1], out[0, 2] = d * f - e * e, c * e - b * f, b * e - c * d
    out[1, 1], out[1, 2], out[2, 2] = a * f - c * c, b * c - a * e, a * d - b * b
    det = max(a * out[0, 0] + b * out[0, 1] + c * out[0, 2], 1e-15)
    for i in range(3):
        for j in range(i, 3):
            out[i, j] *= s[i] * s[j] / det
            out[j, i] = out[i, j]
    return out


@kernel
def solve(matrix: Floats, vector: Floats) -> Floats:
    """Solution x of matrix x = vector, for a symmetric positive definite 3 x 3 matrix."""
    inverse = invert(matrix)
    out = np.zeros(3)
    for i in range(3):
        for j in range(3):
            out[i] += inverse[i, j] * vector[j]
    return out


@kernel
def turned(matrix: Floats, angle: float) -> Floats:
    """R M R^T: a covariance or information given in axes turned by `angle`, in the axes that they are turned from."""
    c, s = math.cos(angle), math.sin(angle)
    out = np.empty((3, 3))
    xx, xy, yy, xt, yt = matrix[0, 0], matrix[0, 1], matrix[1, 1], matrix[0, 2], matrix[1, 2]
    out[0, 0] = c * c * xx - 2.0 * c * s * xy + s * s * yy
    out[0, 1] = out[1, 0] = c * s * (xx - yy) + (c * c - s * s) * xy
    out[1, 1] = s * s * xx + 2.0 * c * s * xy + c * c * yy
    out[0, 2] = out[2, 0] = c * xt - s * yt
    out[1, 2] = out[2, 1] = s * xt + c * yt
    out[2, 2] = matrix[2, 2]
    return out


@kernel
def moved(pose: Floats, covariance: Floats, increment: Floats, noise: Floats) -> tuple[Floats, Floats]:
    """Pose and covariance after an increment; the covariance is in the axes that the pose is given in.

    Parameters
    ----------
    pose : ndarray, shape (3,)
    covariance : ndarray, shape (3, 3)
    increment : ndarray, shape (3,)
        In the frame of `pose`.
    noise : ndarray, shape (3, 3)
        Its covariance, in the frame of `pose`.
    """
    end = compose_one(pose, increment)
    gx, gy = -(end[1] - pose[1]), end[0] - pose[0]
    out = turned(noise, pose[2])
    p = covariance
    out[0, 0] += p[0, 0] + 2.0 * gx * p[0, 2] + gx * gx * p[2, 2]
    out[0, 1] += p[0, 1] + gx * p[1, 2] + gy * p[0, 2] + gx * gy * p[2, 2]
    out[1, 1] += p[1, 1] + 2.0 * gy * p[1, 2] + gy * gy * p[2, 2]
    out[0, 2] += p[0, 2] + gx * p[2, 2]
    out[1, 2] += p[1, 2] + gy * p[2, 2]
    out[2, 2] += p[2, 2]
    out[1, 0], out[2, 0], out[2, 1] = out[0, 1], out[0, 2], out[1, 2]
    return end, out


@kernel
def square_root(matrix: Floats, least: float = 0.0) -> Floats:
    """Upper R with R^T R = matrix, by Cholesky; a direction with no more than `least` gives a row of zeros."""
    r = np.zeros((3, 3))
    for i in range(3):
        pivot = matrix[i, i]
        for k in range(i):
            pivot -= r[k, i] * r[k, i]
        if pivot <= 1e-12 * matrix[i, i] or pivot <= least:
            continue
        r[i, i] = math.sqrt(pivot)
        for j in range(i + 1, 3):
            rest = matrix[i, j]
            for k in range(i):
                rest -= r[k, i] * r[k, j]
            r[i, j] = rest / r[i, i]
    return r
