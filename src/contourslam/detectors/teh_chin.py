"""Teh and Chin's dominant points: the region of support ends where chord or height ratio stop growing (eqs 14-15)."""

import math
from dataclasses import dataclass

import numpy as np

from contourslam.contour import Contours
from contourslam.contour.contours import Floats, Ints
from contourslam.kernels import kernel


@kernel
def k_cosine(points: Floats, a: int, b: int, wraps: bool, i: int, k: int) -> float:
    """Cosine of the angle at i between the points k before and k after (eq. 15): -1 on a wall, +1 on a spike."""
    m, n = i - k, i + k
    if wraps:
        m, n = a + (m - a) % (b - a), a + (n - a) % (b - a)
    ax, ay = points[m, 0] - points[i, 0], points[m, 1] - points[i, 1]
    bx, by = points[n, 0] - points[i, 0], points[n, 1] - points[i, 1]
    norm = math.sqrt((ax * ax + ay * ay) * (bx * bx + by * by))
    return (ax * bx + ay * by) / norm if norm > 0.0 else -1.0


@kernel
def _chord_and_height(points: Floats, a: int, b: int, wraps: bool, i: int, k: int) -> tuple[float, float]:
    """Length l of the chord from i-k to i+k and the signed distance d of i from it (eq. 14)."""
    m, n = i - k, i + k
    if wraps:
        m, n = a + (m - a) % (b - a), a + (n - a) % (b - a)
    cx, cy = points[n, 0] - points[m, 0], points[n, 1] - points[m, 1]
    chord = math.hypot(cx, cy)
    if chord <= 0.0:
        return 0.0, 0.0
    height = (cx * (points[i, 1] - points[m, 1]) - cy * (points[i, 0] - points[m, 0])) / chord
    return chord, height


@kernel
def support_length(points: Floats, a: int, b: int, wraps: bool, i: int, least: int, most: int) -> int:
    """Teh and Chin's region of support at i: k grows until a stopping rule holds; 0 where there is no room."""
    room = (b - a - 1) // 2 if wraps else min(i - a, b - 1 - i)
    most = min(most, room)
    if most < least:
        return 0
    k = least
    chord, height = _chord_and_height(points, a, b, wraps, i, k)
    while k < most:
        next_chord, next_height = _chord_and_height(points, a, b, wraps, i, k + 1)
        if chord >= next_chord or next_chord <= 0.0:
            break
        ratio, next_ratio = height / chord if chord > 0.0 else 0.0, next_height / next_chord
        # The inequality turns with the sign of d.
        if (height > 0.0 and ratio >= next_ratio) or (height < 0.0 and ratio <= next_ratio):
            break
        k, chord, height = k + 1, next_chord, next_height
    return k


@kernel
def _respond(points: Floats, starts: Ints, closed: np.ndarray, least: int, most: int) -> Floats:
    response = np.zeros(points.shape[0])
    for c in range(closed.size):
        a, b = starts[c], starts[c + 1]
        for i in range(a, b):
            k = support_length(points, a, b, closed[c], i, least, most)
            if k > 0:
                response[i] = 0.5 * (1.0 + k_cosine(points, a, b, closed[c], i, k))
    return response


@dataclass(frozen=True, slots=True)
class TehChin:
    """Teh and Chin (1989) as the paper uses it: adaptive support, k-cosine as the curvature (eqs 14-15).

    The response is (1 + cos) / 2 = cos² of half the opening angle: 0 on a wall, 1 on a spike, 0.5 at a right angle.

    Attributes
    ----------
    adapted : bool
        Our adaptation: equalized contours, and a support that begins at `least_support`. Off, the raw points of the
        scan with a support that begins at k = 1, which range noise lets collapse to one or two points.
    least_support, most_support : float
        Limits of the support to either side, m.
    """

    adapted: bool = True
    least_support: float = 0.20
    most_support: float = 0.60

    @property
    def equalized(self) -> bool:
        """Whether the contours come equalized: an adaptation."""
        return self.adapted

    @property
    def threshold(self) -> float:
        """An opening angle of about 145 degrees."""
        return 0.09

    def reach(self, contours: Contours) -> int:
        """The least support."""
        return contours.points_in(self.least_support, 1)

    def respond(self, contours: Contours) -> Floats:
        """Curvature of each point, see :class:`contourslam.detectors.Detector`."""
        least = contours.points_in(self.least_support, 1)
        most = contours.points_in(self.most_support, 1_000)
        return _respond(contours.points, contours.starts, contours.closed, least, most)
