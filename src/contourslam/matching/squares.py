"""Contour points by the square of the plane that they lie in and the way they look: to keep or average one of each."""

import numpy as np

from contourslam.contour.contours import Floats, Ints


def numbered(squares: Floats) -> Ints:
    """One number for each square of a grid, given by two whole numbers in the last axis."""
    return np.asarray(squares[..., 0].astype(np.int64) << 32 | squares[..., 1].astype(np.int64) & 0xFFFFFFFF)


def squares_of(points: Floats, size: float) -> Ints:
    """The square of the plane, of `size` (m), that each contour point lies in, and which of eight ways it looks."""
    octants = np.floor(np.arctan2(points[:, 3], points[:, 2]) * (4.0 / np.pi) + 0.5).astype(np.int64) % 8
    return numbered(np.floor(points[:, :2] / size)) * 8 + octants


def averaged(points: Floats, size: float) -> Floats:
    """One contour point, x, y (m) and unit normal, for each square of `size` (m) and each way of looking in it."""
    _, which, count = np.unique(squares_of(points, size), return_inverse=True, return_counts=True)
    sums = np.stack([np.bincount(which.reshape(-1), points[:, c], len(count)) for c in range(4)], axis=1)
    out = sums / count[:, None]
    out[:, 2:] /= np.maximum(np.hypot(out[:, 2], out[:, 3]), 1e-9)[:, None]
    return np.ascontiguousarray(out)
