"""Matched filter: the contour's elementary vectors against the shape "angle" (eqs 12-13)."""

import math
from dataclasses import dataclass

import numpy as np

from contourslam.contour import Contours
from contourslam.contour.contours import Floats, Ints
from contourslam.kernels import kernel


@kernel
def _respond(points: Floats, starts: Ints, closed: np.ndarray, s: int, turns: Floats, margin: bool) -> Floats:
    response = np.zeros(points.shape[0])
    cosines, sines, walls = np.cos(turns), np.sin(turns), np.cos(0.5 * turns)
    sums = np.zeros((points.shape[0] + 2 * s + 1, 3))  # running sums of the elementary vectors and their squares
    for c in range(closed.size):
        a, size = starts[c], starts[c + 1] - starts[c]
        if size < 2 * s + 1:
            continue
        before = s if closed[c] else 0  # a ring goes on by one side beyond either end
        for j in range(size - 1 + 2 * before + (1 if closed[c] else 0)):
            m = a + (j - before) % size
            n = a + (j - before + 1) % size
            dx, dy = points[n, 0] - points[m, 0], points[n, 1] - points[m, 1]
            sums[j + 1, 0], sums[j + 1, 1] = sums[j, 0] + dx, sums[j, 1] + dy
            sums[j + 1, 2] = sums[j, 2] + dx * dx + dy * dy
        for i in range(s - before, size - s + before):
            # P(s, 0) and P(2s, s): the sum of each side's vectors over the root of their squares' sum (eq. 12).
            j = i + before
            q1, q2 = math.sqrt(sums[j, 2] - sums[j - s, 2]), math.sqrt(sums[j + s, 2] - sums[j, 2])
            if q1 <= 0.0 or q2 <= 0.0:
                continue
            x1, y1 = (sums[j, 0] - sums[j - s, 0]) / q1, (sums[j, 1] - sums[j - s, 1]) / q1
            x2, y2 = (sums[j + s, 0] - sums[j, 0]) / q2, (sums[j + s, 1] - sums[j, 1]) / q2
            left = 1.0 if x1 * y2 - y1 * x2 >= 0.0 else -1.0
            for t in range(turns.size):
                # Turning the second side back lays both in one line. The factor -exp(-i dphi) of the paper, with the
                # interior angle dphi = pi - turn, is this rotation: its minus sign is the half turn, so the minus of
                # eq. (13) must not be applied once more.
                cos, sin = cosines[t], -left * sines[t]
                x, y = x1 + cos * x2 - sin * y2, y1 + sin * x2 + cos * y2
                score = math.sqrt(x * x + y * y) / (2.0 * math.sqrt(s))  # eq. (13)
                if margin:  # over what a straight wall scores on this template
                    score = (score - walls[t]) / (1.0 - walls[t])
                response[a + i] = max(response[a + i], score)
    return response


@dataclass(frozen=True, slots=True)
class MatchedFilter:
    """The paper's matched filter: two straight sides that enclose an angle (eqs 12-13).

    Attributes
    ----------
    adapted : bool
        Our adaptation: a bank of angles, each judged by its margin over what a straight wall scores on it. Off, the
        score of one right-angle template as printed, where a straight wall has 0.71 and a right angle 1.
    side : float
        Length of each side of the template, m.
    turns_deg : tuple of float
        Angles by which the bank's templates turn (180 degrees less the interior angle), degrees.
    """

    adapted: bool = True
    side: float = 0.30
    turns_deg: tuple[float, ...] = (45.0, 60.0, 75.0, 90.0, 105.0, 120.0, 140.0)

    @property
    def equalized(self) -> bool:
        """The filter needs elementary vectors of one length, in the paper and here."""
        return True

    @property
    def threshold(self) -> float:
        """Margin of a corner whose sides are 15 degrees rounder than the nearest template, or the printed score."""
        return 0.7 if self.adapted else 0.92

    def reach(self, contours: Contours) -> int:
        """One side of the template."""
        return self._vectors(contours)

    def _vectors(self, contours: Contours) -> int:
        return max(round(self.side / contours.spacing), 3)

    def respond(self, contours: Contours) -> Floats:
        """Score of each point, see :class:`contourslam.detectors.Detector`."""
        turns = np.radians(self.turns_deg) if self.adapted else np.array([0.5 * math.pi])
        return _respond(contours.points, contours.starts, contours.closed, self._vectors(contours), turns, self.adapted)
