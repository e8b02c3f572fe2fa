"""Non-maximum suppression along the contour, shared by all detectors."""

import numpy as np

from contourslam.contour import Contours
from contourslam.contour.contours import Floats, Ints
from contourslam.kernels import kernel


@kernel
def _suppress(response: Floats, starts: Ints, closed: np.ndarray, threshold: float, reach: int) -> Ints:
    kept = np.empty(response.size, dtype=np.int64)
    count = 0
    for c in range(closed.size):
        a, b = starts[c], starts[c + 1]
        size = b - a
        for i in range(a, b):
            value = response[i]
            if not value >= threshold:
                continue
            largest = True
            for step in range(1, reach + 1):
                before, after = i - step, i + step
                if closed[c]:
                    before, after = a + (before - a) % size, a + (after - a) % size
                # Of equal neighbours the first one stays, so a plateau gives one candidate.
                if before >= a and response[before] >= value and before != i:
                    largest = False
                if after < b and response[after] > value:
                    largest = False
            if largest:
                kept[count] = i
                count += 1
    return kept[:count]


def suppress(response: Floats, contours: Contours, threshold: float, reach: int) -> Ints:
    """Keep the points whose response reaches the threshold and is the largest within reach on their contour.

    Parameters
    ----------
    response : ndarray, shape (m,)
    contours : Contours
        m points.
    threshold : float
    reach : int
        Points to either side.

    Returns
    -------
    ndarray of int, shape (k,)
        Indices of the candidates, ascending.
    """
    return _suppress(response, contours.starts, contours.closed, threshold, reach)
