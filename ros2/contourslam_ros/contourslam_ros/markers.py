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
Colour = tuple[float, float, float]

SIDE = 0.25  # m, of the two lines that show how a corner opens
STEPS = 16  # of an ellipse
WALL, CORNER, ELLIPSE = (0.13, 0.35, 0.65), (0.84, 0.33, 0.10), (0.45, 0.45, 0.45)


def map_markers(head: Header, corners: CornerMap, walls: WallMap, sigmas: float, within: str = "") -> MarkerArray:
    """Draw a map.

    Parameters
    ----------
    head : Header
    corners : CornerMap
    walls : WallMap
    sigmas : float
        Half axes of the ellipses in standard deviations.
    within : str
        Before the markers' names.

    Returns
    -------
    MarkerArray
        Markers ``corners``, ``corner_sides``, ``corner_ellipses``, ``walls`` and ``wall_ellipses``.
    """
    ends = walls.end_points.reshape(-1, 2)
    end_covariances = walls.end_point_covariances.reshape(-1, 2, 2)
    corner_ellipses = _outlines(corners.positions, corners.covariances, sigmas)
    wall_ellipses = _outlines(ends, end_covariances, sigmas)
    return MarkerArray(
        markers=[
            marker(head, f"{within}walls", Marker.LINE_LIST, _points(ends), 0.03, WALL),
            marker(head, f"{within}wall_ellipses", Marker.LINE_LIST, wall_ellipses, 0.008, ELLIPSE),
            marker(head, f"{within}corners", Marker.SPHERE_LIST, _points(corners.positions), 0.08, CORNER),
            marker(head, f"{within}corner_sides", Marker.LINE_LIST, _points(_sides(corners)), 0.02, CORNER),
            marker(head, f"{within}corner_ellipses", Marker.LINE_LIST, corner_ellipses, 0.008, ELLIPSE),
        ]
    )


def ellipses(centres: Floats, covariances: Floats, sigmas: float) -> Floats:
    """Outline ellipses.

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
    ndarray, shape (n, steps, 2)
        Points around each, m.
    """
    values, axes = np.linalg.eigh(covariances)
    halves = axes * (sigmas * np.sqrt(np.maximum(values, 0.0)))[:, None, :]
    angle = 2.0 * np.pi * np.arange(STEPS) / STEPS
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    outlines: Floats = centres[:, None] + np.einsum("nij,kj->nki", halves, circle)
    return outlines


def _outlines(centres: Floats, covariances: Floats, sigmas: float) -> list[Point]:
    """Outline ellipses with line segments; neighbours share their point, for to make one takes microseconds."""
    segments: list[Point] = []
    for outline in ellipses(centres, covariances, sigmas).tolist():
        around = [Point(x=x, y=y) for x, y in outline]
        for first, second in zip(around, around[1:] + around[:1], strict=True):
            segments += (first, second)
    return segments


def _points(places: Floats) -> list[Point]:
    return [Point(x=x, y=y) for x, y in places.tolist()]


def _sides(corners: CornerMap) -> Floats:
    """Both sides of each corner, as far as `SIDE`, from the corner outwards."""
    half = corners.openings / 2.0
    angles = np.stack([corners.directions - half, corners.directions + half], axis=1)
    tips = corners.positions[:, None] + SIDE * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    starts = np.broadcast_to(corners.positions[:, None], tips.shape)
    return np.stack([starts, tips], axis=2).reshape(-1, 2)


def marker(head: Header, name: str, kind: int, points: list[Point], size: float, colour: Colour) -> Marker:
    """Make a marker of points, or one that removes itself where there are none.

    Parameters
    ----------
    head : Header
    name : str
        Its namespace.
    kind : int
        Such as ``Marker.LINE_LIST``.
    points : list of Point
    size : float
        Width or diameter, m.
    colour : tuple of float
        Red, green, blue, 0 to 1.
    """
    made = Marker(header=head, ns=name, type=kind)
    if not points:  # RViz complains of a list without points
        made.action = Marker.DELETE
        return made
    made.pose.orientation.w = 1.0
    made.scale.x = made.scale.y = made.scale.z = size
    red, green, blue = colour
    made.color = ColorRGBA(r=red, g=green, b=blue, a=1.0)
    made.points = points
    return made
