"""Curvature scale space: maxima of the smoothed contour's curvature (eqs 18-22)."""

import math
from dataclasses import dataclass

import numpy as np

from contourslam.contour import Contours
from contourslam.contour.contours import Floats, Ints
from contourslam.kernels import kernel


@kernel
def _gaussian_derivatives(sigma: float) -> tuple[Floats, Floats]:
    """First and second derivative of a Gaussian, sampled, scaled to be exact on straight lines and parabolas."""
    half = math.ceil(3.0 * sigma)
    first, second = np.empty(2 * half + 1), np.empty(2 * half + 1)
    for j in range(-half, half + 1):
        g = math.exp(-0.5 * (j / sigma) ** 2)
        first[j + half] = -j * g
        second[j + half] = (j * j / sigma**2 - 1.0) * g
    moment = 0.0
    for j in range(-half, half + 1):
        moment -= j * first[j + half]
    first /= moment
    second -= second.mean()
    moment = 0.0
    for j in range(-half, half + 1):
        moment += 0.5 * j * j * second[j + half]
    second /= moment
    return first, second


@kernel
def curvature(points: Floats, a: int, b: int, wraps: bool, sigma: float) -> tuple[Floats, Floats]:
    """Curvature (1/m) and step (m) of ``points[a:b]`` smoothed with a Gaussian of `sigma` samples, eqs (21) and (22).

    The step is how far one sample goes along the smoothed contour. An open contour goes on beyond each end by its
    reflection through the end point, so that a straight end stays straight.
    """
    first, second = _gaussian_derivatives(sigma)
    half = first.size // 2
    n = b - a
    # The contour with its continuation, laid out once, so that the inner loop needs no test.
    x, y = np.empty(n + 2 * half), np.empty(n + 2 * half)
    for j in range(n + 2 * half):
        i = j - half
        if wraps:
            x[j], y[j] = points[a + i % n, 0], points[a + i % n, 1]
        elif i < 0:
            m = min(-i, n - 1)
            x[j], y[j] = 2.0 * points[a, 0] - points[a + m, 0], 2.0 * points[a, 1] - points[a + m, 1]
        elif i >= n:
            m = max(2 * (n - 1) - i, 0)
            x[j], y[j] = 2.0 * points[b - 1, 0] - points[a + m, 0], 2.0 * points[b - 1, 1] - points[a + m, 1]
        else:
            x[j], y[j] = points[a + i, 0], points[a + i, 1]
    kappa, steps = np.empty(n), np.empty(n)
    for i in range(n):
        dx = dy = ddx = ddy = 0.0
        for j in range(2 * half + 1):
            px, py = x[i + 2 * half - j], y[i + 2 * half - j]  # convolution: the kernel runs backwards
            dx += first[j] * px
            dy += first[j] * py
            ddx += second[j] * px
            ddy += second[j] * py
        steps[i] = math.hypot(dx, dy)
        kappa[i] = (dx * ddy - ddx * dy) / steps[i] ** 3 if steps[i] > 0.0 else 0.0
    return kappa, steps


@kernel
def _opening_cosine(points: Floats, i: int, before: int, after: int) -> float:
    """Cosine of the angle at i between the mean directions of its sides, which end at `before` and `after`."""
    ax = ay = bx = by = 0.0
    for j in range(before, i):
        ax, ay = ax + points[j, 0] - points[i, 0], ay + points[j, 1] - points[i, 1]
    for j in range(i + 1, after + 1):
        bx, by = bx + points[j, 0] - points[i, 0], by + points[j, 1] - points[i, 1]
    norm = math.sqrt((ax * ax + ay * ay) * (bx * bx + by * by))
    return (ax * bx + ay * by) / norm if norm > 0.0 else -1.0


@kernel
def _corner_maxima(kappa: Floats, ratio: float, flat: float) -> Ints:
    """Maxima of |kappa| that exceed `ratio` times its mean between the minima to their sides: no round ones."""
    n = kappa.size
    size = np.abs(kappa)
    out = np.empty(n, dtype=np.int64)
    count = 0
    for i in range(1, n - 1):
        if size[i] <= flat or size[i] < size[i - 1] or size[i] <= size[i + 1]:
            continue
        left, right = i, i
        while left > 0 and size[left - 1] <= size[left]:
            left -= 1
        while right < n - 1 and size[right + 1] <= size[right]:
            right += 1
        if size[i] > ratio * size[left : right + 1].mean():
            out[count] = i
            count += 1
    return out[:count]


@kernel
def _respond(
    points: Floats, starts: Ints, closed: np.ndarray, sigma: float, ratio: float, straight: float, side: int, edge: int
) -> Floats:
    response = np.zeros(points.shape[0])
    for c in range(closed.size):
        a, b = starts[c], starts[c + 1]
        n = b - a
        if n < 2 * edge + 1:
            continue
        kappa, steps = curvature(points, a, b, closed[c], sigma)
        # A ring is cut open where it is straightest, so that no corner falls on the cut.
        cut = int(np.argmin(np.abs(kappa))) if closed[c] else 0
        kappa = np.concatenate((kappa[cut:], kappa[:cut]))
        curve = np.concatenate((points[a + cut : b], points[a : a + cut]))
        candidates = _corner_maxima(kappa, ratio, 1e-6)
        # Dropping one false corner lengthens its neighbours' sides, so the angles are judged again until all stay.
        changed = True
        while changed:
            changed = False
            kept = 0
            for q in range(candidates.size):
                i = candidates[q]
                before = candidates[q - 1] if q > 0 else 0
                after = candidates[q + 1] if q + 1 < candidates.size else n - 1
                # No corner where the contour ends: a maximum there is the end's own.
                if not closed[c] and (i < edge or n - 1 - i < edge):
                    changed = True
                    continue
                if _opening_cosine(curve, i, max(before, i - side), min(after, i + side)) < straight:
                    changed = True
                    continue
                candidates[kept] = i
                kept += 1
            candidates = candidates[:kept]
        for i in candidates:
            response[a + (i + cut) % n] = abs(kappa[i]) * steps[(i + cut) % n] * sigma
    return response


@dataclass(frozen=True, slots=True)
class CurvatureScaleSpace:
    """Curvature scale space after He and Yung (2008): one low scale, a local threshold, a test of the angle.

    The response is the turn (rad) that the smoothed contour would take over one sigma at its curvature, at the maxima
    that pass, 0 elsewhere: about 0.8 at a right angle.

    Attributes
    ----------
    adapted : bool
        Our adaptation: equalized contours, with a scale in metres, above the range noise. Off, the raw points
        of the scan with a scale of 3 samples.
    sigma : float
        Standard deviation of the smoothing Gaussian, m.
    ratio : float
        A maximum exceeds this many times the mean curvature between its neighbouring minima; 1 would let round
        corners pass.
    straight_deg : float
        A corner that opens by more than this is dropped (He and Yung: 162), degrees.
    side : float
        Length of the sides whose directions make the angle, m.
    """

    adapted: bool = True
    sigma: float = 0.10
    ratio: float = 1.5
    straight_deg: float = 150.0
    side: float = 0.40

    @property
    def equalized(self) -> bool:
        """Whether the contours come equalized: an adaptation."""
        return self.adapted

    @property
    def threshold(self) -> float:
        """Half of what a corner that opens by 150 degrees gives; the detector's own tests do the rest."""
        return 0.1

    def reach(self, contours: Contours) -> int:
        """One scale."""
        return max(round(self._scale(contours)), 1)

    def _scale(self, contours: Contours) -> float:
        return max(self.sigma / contours.spacing, 1.0) if contours.spacing > 0.0 else 3.0

    def respond(self, contours: Contours) -> Floats:
        """Curvature at the corner points, see :class:`contourslam.detectors.Detector`."""
        scale = self._scale(contours)
        side = max(round(self.side / contours.spacing), 3) if contours.spacing > 0.0 else 12
        straight = math.cos(math.radians(self.straight_deg if self.adapted else 162.0))
        edge = math.ceil(scale) + 1
        return _respond(contours.points, contours.starts, contours.closed, scale, self.ratio, straight, side, edge)
