"""The map as its readers get it: corners and walls with their covariance and their record of being seen."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class CornerMap:
    """Corners of the map, one row each, in the world frame.

    Attributes
    ----------
    ids : ndarray of int, shape (c,)
        Identity, kept for life and never used again.
    positions : ndarray, shape (c, 2)
        m.
    covariances : ndarray, shape (c, 2, 2)
        Covariance of the position, m².
    directions : ndarray, shape (c,)
        Bisector of the two sides, pointing into the angle they enclose, rad.
    openings : ndarray, shape (c,)
        Angle between the two sides, in (0, pi), rad.
    convex : ndarray of bool, shape (c,)
        True where matter fills the angle (the edge of a box), false where free space does (the corner of a room).
    observed, failed : ndarray of int, shape (c,)
        How often the landmark was seen (o), and how often it should have been but was not (f).
    """

    ids: NDArray[np.int64]
    positions: Floats
    covariances: Floats
    directions: Floats
    openings: Floats
    convex: NDArray[np.bool_]
    observed: NDArray[np.int64]
    failed: NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class WallMap:
    """Walls of the map, one row each, in the world frame.

    Attributes
    ----------
    ids : ndarray of int, shape (w,)
        Identity, kept for life and never used again.
    end_points : ndarray, shape (w, 2, 2)
        First and last point, m; seen from free space the wall runs from the right to the left.
    end_point_covariances : ndarray, shape (w, 2, 2, 2)
        Covariance of each end point, m²; along the wall it is what the beam spacing leaves open.
    normals : ndarray, shape (w,)
        Direction of the normal that points from free space into the wall, rad.
    line_covariances : ndarray, shape (w, 2, 2)
        Covariance of (normal direction, distance along the normal at the wall's middle), rad and m.
    observed, failed : ndarray of int, shape (w,)
        How often the landmark was seen (o), and how often it should have been but was not (f).
    """

    ids: NDArray[np.int64]
    end_points: Floats
    end_point_covariances: Floats
    normals: Floats
    line_covariances: Floats
    observed: NDArray[np.int64]
    failed: NDArray[np.int64]
