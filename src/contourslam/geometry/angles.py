"""Angles, always wrapped to (-pi, pi]."""

import math

import numpy as np
from numpy.typing import NDArray

from contourslam.kernels import kernel

Floats = NDArray[np.float64]


@kernel
def wrap_angle(angle: float) -> float:
    """Wrap one angle to (-pi, pi] (kernel; also callable from other kernels)."""
    wrapped = -((-angle + math.pi) % (2.0 * math.pi) - math.pi)
    # Just beyond pi the remainder rounds up to a whole turn, which would give -pi.
    return wrapped if wrapped != -math.pi else math.pi


def wrap(angles: Floats) -> Floats:
    """Wrap an array of angles.

    Parameters
    ----------
    angles : ndarray, any shape
        rad.

    Returns
    -------
    ndarray, same shape
        The same directions in (-pi, pi], rad.
    """
    wrapped = -((-np.asarray(angles) + np.pi) % (2.0 * np.pi) - np.pi)
    return np.where(wrapped == -np.pi, np.pi, wrapped)
