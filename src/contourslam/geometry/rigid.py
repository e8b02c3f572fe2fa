"""Rotations and rigid motions in space, as 3 by 3 and 4 by 4 matrices."""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]


def rigid(rotation: ArrayLike, translation: ArrayLike) -> Floats:
    """Put a rotation (3, 3) and a translation (3,), m, into one matrix (4, 4)."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rotation, translation
    return matrix


def from_planar(pose: ArrayLike, height: float = 0.0) -> Floats:
    """Turn a pose in the plane, x (m), y (m), heading (rad), into a matrix (4, 4), at a height (m)."""
    x, y, heading = (float(value) for value in np.asarray(pose, dtype=np.float64))
    c, s = math.cos(heading), math.sin(heading)
    return np.array([[c, -s, 0.0, x], [s, c, 0.0, y], [0.0, 0.0, 1.0, height], [0.0, 0.0, 0.0, 1.0]])


def inverse(matrix: Floats) -> Floats:
    """Invert a rigid motion (4, 4)."""
    turned = matrix[:3, :3].T
    return rigid(turned, -turned @ matrix[:3, 3])


def is_rigid(matrix: ArrayLike, tolerance: float = 1e-6) -> bool:
    """Whether a matrix is a rigid motion: a rotation, a translation, and nothing else."""
    values = np.asarray(matrix)
    if values.shape != (4, 4) or not np.isfinite(values).all():
        return False
    turn = values[:3, :3]
    fits = np.allclose(turn @ turn.T, np.eye(3), atol=tolerance) and np.linalg.det(turn) > 0.0
    return bool(fits and np.allclose(values[3], (0.0, 0.0, 0.0, 1.0), atol=1e-12))


def quaternion(rotation: Floats) -> tuple[float, float, float, float]:
    """Quaternion x, y, z, w of a rotation (3, 3), with w not below 0; exact also at half a turn."""
    r = rotation
    # The largest of the four is computed first: it is never near 0.
    squares = 1.0 + np.array(
        [r[0, 0] - r[1, 1] - r[2, 2], r[1, 1] - r[0, 0] - r[2, 2], r[2, 2] - r[0, 0] - r[1, 1], np.trace(r)]
    )
    rows = np.array(
        [
            [squares[0], r[0, 1] + r[1, 0], r[0, 2] + r[2, 0], r[2, 1] - r[1, 2]],
            [r[0, 1] + r[1, 0], squares[1], r[1, 2] + r[2, 1], r[0, 2] - r[2, 0]],
            [r[0, 2] + r[2, 0], r[1, 2] + r[2, 1], squares[2], r[1, 0] - r[0, 1]],
            [r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1], squares[3]],
        ]
    )
    best = rows[int(np.argmax(squares))]
    best = best / np.linalg.norm(best) * (-1.0 if best[3] < 0.0 else 1.0)
    x, y, z, w = (float(value) for value in best)
    return x, y, z, w


def from_quaternion(x: float, y: float, z: float, w: float) -> Floats:
    """Rotation (3, 3) of a quaternion of any length above 0."""
    length = math.hypot(x, y, z, w)
    x, y, z, w = x / length, y / length, z / length, w / length
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def rotation_from_vector(vector: ArrayLike) -> Floats:
    """Rotation (3, 3) about a vector (3,) by its length, rad (Rodrigues)."""
    turn = np.asarray(vector, dtype=np.float64)
    half = 0.5 * float(np.linalg.norm(turn))
    x, y, z = turn * (0.5 * np.sinc(half / math.pi))
    return from_quaternion(x, y, z, math.cos(half))


def vector_from_rotation(rotation: Floats) -> Floats:
    """Vector (3,) along the axis of a rotation, as long as its angle, rad; the inverse of `rotation_from_vector`."""
    x, y, z, w = quaternion(rotation)
    sine = math.hypot(x, y, z)
    return np.array([x, y, z]) * (2.0 * math.atan2(sine, w) / sine if sine > 1e-12 else 2.0)
