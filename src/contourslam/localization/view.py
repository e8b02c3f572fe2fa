"""What the robot saw, as it is held against a map: contour points, where each was seen from, what each counts for."""

from dataclasses import dataclass

import numpy as np

from contourslam.contour.contours import Floats, Ints

SQUARE = 0.2  # m; points in one square count for one look at a surface
MOST_SEARCHED = 80  # points that the global search takes
FARTHEST = 15.0  # m; points beyond are not searched with where there are others: they ask for the finest headings


@dataclass(frozen=True, slots=True)
class View:
    """Contour points around the robot.

    Attributes
    ----------
    points : ndarray, shape (n, 4)
        x, y (m) and unit normal in the frame of the base.
    origins : ndarray, shape (n, 2)
        Where the lidar was when it saw each, in the same frame, m.
    weights : ndarray, shape (n,)
        What each counts for: the points of one square of 0.2 m count one together.
    chosen : ndarray of int, shape (c,)
        Some of them, spread evenly over the surfaces.
    """

    points: Floats
    origins: Floats
    weights: Floats
    chosen: Ints


def view_of(oriented: Floats, origins: Floats | None = None) -> View:
    """Make a view of contour points.

    Parameters
    ----------
    oriented : ndarray, shape (n, 4)
        Points and normals in the frame of the base; rows that are not finite are left out.
    origins : ndarray, shape (2,) or (n, 2), optional
        Where the lidar was, m; the base by default.

    Raises
    ------
    ValueError
        If an array has the wrong shape.
    """
    points = np.asarray(oriented, np.float64)
    if points.ndim != 2 or points.shape[1] != 4:
        raise ValueError(f"contour points have shape {points.shape}, wanted (n, 4): x, y and the normal")
    places = np.zeros(2) if origins is None else np.asarray(origins, np.float64)
    places = np.broadcast_to(places, (len(points), 2))
    good = np.isfinite(points).all(axis=1)
    points, places = np.ascontiguousarray(points[good]), np.ascontiguousarray(places[good])
    squares = np.floor(points[:, :2] / SQUARE)
    _, first, which, count = np.unique(squares, axis=0, return_index=True, return_inverse=True, return_counts=True)
    near = first[np.hypot(points[first, 0], points[first, 1]) < FARTHEST]
    chosen = np.sort(near if 2 * len(near) >= len(first) else first)
    chosen = chosen[np.linspace(0, len(chosen) - 1, min(len(chosen), MOST_SEARCHED)).round().astype(np.int64)]
    return View(points, places, 1.0 / count[which.reshape(-1)] if len(points) else np.empty(0), chosen)
