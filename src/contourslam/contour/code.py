"""A contour as a complex signal: polar code and difference code (eqs 1-2)."""

import numpy as np
from numpy.typing import NDArray

from contourslam.contour.contours import Floats

Complex = NDArray[np.complex128]


def polar_code(ranges: Floats, angles: Floats) -> Complex:
    """Points of the contour in the complex plane, C(n) = r(n) exp(i alpha(n)) (eq. 1).

    Parameters
    ----------
    ranges, angles : ndarray, shape (n,)
        m and rad.

    Returns
    -------
    ndarray of complex, shape (n,)
        m, in the lidar's frame.
    """
    return np.asarray(ranges * np.exp(1j * np.asarray(angles)))


def difference_code(points: Complex) -> Complex:
    """Elementary vectors gamma(n) = C(n+1) - C(n) (eq. 2, whose printed sides are exchanged).

    Parameters
    ----------
    points : ndarray of complex, shape (n,)

    Returns
    -------
    ndarray of complex, shape (n - 1,)
        m.
    """
    return np.diff(points)
