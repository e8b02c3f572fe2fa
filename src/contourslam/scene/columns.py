"""Round columns in the contours, as facets of a prism."""

import math

import numpy as np
from numpy.typing import NDArray

from contourslam.scene.walls import Named

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

_CELL = 0.08  # m; points in cells that touch belong together
_FEWEST = 25  # points
_LARGEST, _SMALLEST = 0.5, 0.06  # m, radius
_OFF = 0.02  # m, root mean square distance from the circle
_RADIAL = 0.9  # mean cosine between the normals and the radius
_ARC = math.radians(120.0)  # of the circle that must be seen
_WHOLE = math.radians(300.0)  # from where on it is taken to be round all about
_SIDES = 14


def find_columns(points: Floats, free: Bools) -> tuple[Named, Bools]:
    """Find round columns among contour points.

    Parameters
    ----------
    points : ndarray, shape (n, 4)
        x, y (m) and the normal towards free space.
    free : ndarray of bool, shape (n,)
        Those that no wall explains.

    Returns
    -------
    facets : list of (str, ndarray of shape (2, 2))
        "contour-c0-0" and so on: column and facet, each as seen from free space from the left to the right, m.
    left : ndarray of bool, shape (n,)
        Those that no column explains either.
    """
    facets: Named = []
    left, number = free.copy(), 0
    for group in _groups(points[:, :2], np.flatnonzero(free)):
        circle = _circle(points[group])
        if circle is None:
            continue
        middle, radius, angles = circle
        for side, (first, last) in enumerate(_arcs(angles)):
            # Seen from outside, left to right is counter-clockwise; the sides lie half in and half out of the circle.
            out = radius / math.cos(0.25 * (last - first)) ** 2
            ends = middle + out * np.array([[math.cos(a), math.sin(a)] for a in (first, last)])
            facets.append((f"contour-c{number}-{side}", ends))
        number += 1
        left[np.hypot(*(points[:, :2] - middle).T) < radius + 0.06] = False
    return facets, left


def _groups(places: Floats, chosen: NDArray[np.int64]) -> list[NDArray[np.int64]]:
    """Points in cells that touch each other."""
    import cv2

    if not len(chosen):
        return []
    cell = np.floor(places[chosen] / _CELL).astype(np.int64)
    cell -= cell.min(axis=0)
    image = np.zeros(cell.max(axis=0) + 1, np.uint8)
    image[tuple(cell.T)] = 1
    count, labels = cv2.connectedComponents(image, connectivity=8)
    label = np.asarray(labels)[tuple(cell.T)]
    return [chosen[label == number] for number in range(1, count) if np.sum(label == number) >= _FEWEST]


def _circle(points: Floats) -> tuple[Floats, float, Floats] | None:
    """Middle, radius and the angles seen of a circle through points; None where they do not lie on one.

    The fit is algebraic (Kasa 1976).
    """
    origin = points[:, :2].mean(axis=0)
    x, y = (points[:, :2] - origin).T
    if max(np.ptp(x), np.ptp(y)) > 2.2 * _LARGEST:
        return None
    (a, b, c), *_ = np.linalg.lstsq(np.column_stack([x, y, np.ones(len(x))]), x * x + y * y, rcond=None)
    radius = math.sqrt(max(c + 0.25 * (a * a + b * b), 0.0))
    middle = origin + 0.5 * np.array([a, b])
    away = points[:, :2] - middle
    distance = np.maximum(np.hypot(*away.T), 1e-9)
    angles = np.sort(np.arctan2(away[:, 1], away[:, 0]))
    if not _SMALLEST < radius < _LARGEST or math.sqrt(np.mean((distance - radius) ** 2)) > _OFF:
        return None
    if np.mean(np.sum(away * points[:, 2:], axis=1) / distance) < _RADIAL:
        return None
    gaps = np.diff(np.append(angles, angles[0] + 2.0 * math.pi))
    return None if 2.0 * math.pi - gaps.max() < _ARC else (middle, radius, angles)


def _arcs(angles: Floats) -> list[tuple[float, float]]:
    """The sides of the prism: all around, or as far as the circle was seen."""
    gaps = np.diff(np.append(angles, angles[0] + 2.0 * math.pi))
    widest = int(np.argmax(gaps))
    seen = 2.0 * math.pi - float(gaps[widest])
    span = 2.0 * math.pi if seen > _WHOLE else seen
    begin = float(angles[(widest + 1) % len(angles)])
    knots = begin + np.linspace(0.0, span, max(round(_SIDES * span / (2.0 * math.pi)), 3) + 1)
    return list(zip(knots[:-1].tolist(), knots[1:].tolist(), strict=True))
