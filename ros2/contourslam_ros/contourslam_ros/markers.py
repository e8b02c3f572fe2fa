"""The map drawn for RViz: corners with their sides, walls, and ellipses of their covariance.

Each kind is one marker that holds all of it, replaced as a whole: nothing has to be deleted when landmarks go.
"""

import numpy as np
from geometry_msgs.msg import Point
from numpy.typing import NDArray
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker, MarkerArray

from contourslam.slam.landmark_map import CornerMap, WallMap

Floats = NDArray[np.float64]

SIDE = 0.25  # m, of the two lines that show how a corner opens
STEPS = 16  # of an ellipse
WALL, CORNER, ELLIPSE = (0.13, 0.35, 0.65), (0.84, 0.33, 0.10), (0.45, 0.45, 0.45)


def map_markers(head: Header, corners: CornerMap, walls: WallMap, sigmas: float) -> MarkerArray:
    """Draw a map.

    Parameters
    ----------
    head : Header
    corners : CornerMap
    walls : WallMap
    sigmas : float
        Half axes of the ellipses in standard deviations.

    Returns
    -------
    MarkerArray
        Markers ``corners``, ``corner_sides``, ``corner_ellipses``, ``walls`` and ``wall_ellipses``.
    """
    ends = walls.end_points.reshape(-1, 2)
    doubts = walls.end_point_covariances.reshape(-1, 2, 2)
    return MarkerArray(
        markers=[
            _marker(head, "walls", Marker.LINE_LIST, ends, 0.03, WALL),
            _marker(head, "wall_ellipses", Marker.LINE_LIST, ellipses(ends, doubts, sigmas), 0.008, ELLIPSE),
            _marker(head, "corners", Marker.SPHERE_LIST, corners.positions, 0.08, CORNER),
            _marker(head, "corner_sides", Marker.LINE_LIST, _sides(corners), 0.02, CORNER),
            _marker(
                head,
                "corner_ellipses",
                Marker.LINE_LIST,
                ellipses(corners.positions, corners.covariances, sigmas),
                0.008,
                ELLIPSE,
            ),
        ]
    )


def ellipses(centres: Floats, covariances: Floats, sigmas: float) -> Floats:
    """Outline ellipses with line segments.

    Parameters
    ----------
    centres : ndarray, shape (n, 2)
        m.
    covariances : ndarray, shape (n, 2, 2)
        m².
    sigmas : float
        Half axes in standard deviations.

    Returns
    -------
    ndarray, shape (n * steps * 2, 2)
        First and last point of each segment in turn, m.
    """
    if not len(centres):
        return np.empty((0, 2))
    values, axes = np.linalg.eigh(covariances)
    halves = axes * (sigmas * np.sqrt(np.maximum(values, 0.0)))[:, None, :]
    angle = 2.0 * np.pi * np.arange(STEPS + 1) / STEPS
    outline = centres[:, None] + np.einsum("nij,kj->nki", halves, np.stack([np.cos(angle), np.sin(angle)], axis=1))
    return np.stack([outline[:, :-1], outline[:, 1:]], axis=2).reshape(-1, 2)


def _sides(corners: CornerMap) -> Floats:
    """Both sides of each corner, as far as `SIDE`, from the corner outwards."""
    half = corners.openings / 2.0
    angles = np.stack([corners.directions - half, corners.directions + half], axis=1)
    tips = corners.positions[:, None] + SIDE * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    starts = np.broadcast_to(corners.positions[:, None], tips.shape)
    return np.stack([starts, tips], axis=2).reshape(-1, 2)


def _marker(
    head: Header, name: str, kind: int, points: Floats, size: float, colour: tuple[float, float, float]
) -> Marker:
    marker = Marker(header=head, ns=name, type=kind)
    if not len(points):  # RViz complains of a list without points
        marker.action = Marker.DELETE
        return marker
    marker.pose.orientation.w = 1.0
    marker.scale.x = marker.scale.y = marker.scale.z = size
    red, green, blue = colour
    marker.color = ColorRGBA(r=red, g=green, b=blue, a=1.0)
    marker.points = [Point(x=x, y=y) for x, y in points.tolist()]
    return marker
