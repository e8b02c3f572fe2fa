"""Wu's dominant points: the support with the largest curvature between two limits (eqs 16-17)."""

from dataclasses import dataclass

import numpy as np

from contourslam.contour import Contours
from contourslam.contour.contours import Floats, Ints
from contourslam.detectors.teh_chin import k_cosine
from contourslam.kernels import kernel


@kernel
def _respond(points: Floats, starts: Ints, closed: np.ndarray, least: int, most: int, first: int) -> Floats:
    response = np.zeros(points.shape[0])
    for c in range(closed.size):
        a, b = starts[c], starts[c + 1]
        for i in range(a, b):
            room = (b - a - 1) // 2 if closed[c] else min(i - a, b - 1 - i)
            if room < least:
                continue
            best, support = -2.0, least
            for k in range(least, min(most, room) + 1):
                cosine = k_cosine(points, a, b, closed[c], i, k)
                if cosine > best:
                    best, support = cosine, k
            total = 0.0
            for k in range(first, support + 1):  # eq. (17): the mean over the support
                total += k_cosine(points, a, b, closed[c], i, k)
            response[i] = 0.5 * (1.0 + total / (support - first + 1))
    return response


@dataclass(frozen=True, slots=True)
class Wu:
    """Wu (2003) as the paper uses it: the support of largest k-cosine, the mean cosine over it (eqs 15-17).

    The response is (1 + cv) / 2: 0 on a wall, 1 on a spike, 0.5 at a right angle.

    Attributes
    ----------
    adapted : bool
        Our adaptation: equalized contours, and the mean of eq. (17) begins at `least_support`, since chords shorter
        than that measure the range noise. Off, the raw points of the scan, supports of 3 to 12 points, the mean from
        k = 1 as printed.
    least_support, most_support : float
        K_min and K_max, m.
    """

    adapted: bool = True
    least_support: float = 0.20
    most_support: float = 0.50

    @property
    def equalized(self) -> bool:
        """Whether the contours come equalized: an adaptation."""
        return self.adapted

    @property
    def threshold(self) -> float:
        """An opening angle of about 145 degrees."""
        return 0.09

    def reach(self, contours: Contours) -> int:
        """K_min."""
        return contours.points_in(self.least_support, 3)

    def respond(self, contours: Contours) -> Floats:
        """Mean curvature of each point, see :class:`contourslam.detectors.Detector`."""
        least = contours.points_in(self.least_support, 3)
        most = contours.points_in(self.most_support, 12)
        first = least if self.adapted else 1
        return _respond(contours.points, contours.starts, contours.closed, least, most, first)
