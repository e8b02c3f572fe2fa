"""Values of the plane in the shapes that Rerun takes them in: all lies at height 0 of its 3-D space."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contourslam.contour.contours import Floats

SIGMAS = 3.0  # of the ellipses
KINDS = ("seen", "missed", "convex", "concave")


def turned(kind: str) -> int:
    """Give the class id of a kind; those of contours and shades lie below 100."""
    return 100 + KINDS.index(kind)


def flat(points: NDArray[Any]) -> NDArray[np.float32]:
    """Give points of the plane a height of 0: shape (n, 2) to (n, 3)."""
    out = np.zeros((len(points), 3), dtype=np.float32)
    out[:, :2] = points
    return out


def segment(begin: Floats, end: Floats) -> list[NDArray[np.float32]]:
    """Give one line from point to point."""
    return [flat(np.stack([begin, end]))]


def quaternions(angles: Floats) -> Floats:
    """Give turns about the vertical as x, y, z, w: shape (n, 4)."""
    out = np.zeros((len(angles), 4))
    out[:, 2], out[:, 3] = np.sin(0.5 * angles), np.cos(0.5 * angles)
    return out


def ellipses(centres: Floats, covariances: Floats) -> dict[str, NDArray[Any]]:
    """Give the ellipses of `SIGMAS` standard deviations as flat ellipsoids.

    Parameters
    ----------
    centres : ndarray, shape (n, 2)
        m.
    covariances : ndarray, shape (n, 2, 2)
        m².
    """
    a, b, c = covariances[:, 0, 0], covariances[:, 0, 1], covariances[:, 1, 1]
    middle, half = 0.5 * (a + c), np.hypot(0.5 * (a - c), b)
    sizes = np.zeros((len(centres), 3))
    sizes[:, 0], sizes[:, 1] = np.sqrt(np.maximum(middle + half, 0.0)), np.sqrt(np.maximum(middle - half, 0.0))
    return {
        "centers": flat(centres),
        "half_sizes": SIGMAS * sizes,
        "quaternions": quaternions(0.5 * np.arctan2(2.0 * b, a - c)),
    }


def nis_bounds(dof: int) -> tuple[float, float]:
    """Bounds between which 95 % of the NIS by its degrees of freedom lie, where the filter is honest.

    Quantiles of chi square by their cube root (Wilson and Hilferty 1931), which is exact enough to draw.
    """
    spread = 2.0 / (9.0 * dof)
    low, high = (max(1.0 - spread + z * math.sqrt(spread), 0.0) ** 3 for z in (-1.96, 1.96))
    return low, high
