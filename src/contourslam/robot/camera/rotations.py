"""All rotations in space, evenly enough."""

import math

import numpy as np
from numpy.typing import NDArray

from contourslam.geometry.rigid import from_quaternion

Floats = NDArray[np.float64]


def all_rotations(spacing_deg: float) -> Floats:
    """Give rotations such that none is farther from the nearest than about the spacing.

    Parameters
    ----------
    spacing_deg : float
        Degrees.

    Returns
    -------
    ndarray, shape (n, 3, 3)

    References
    ----------
    M. Alexa, Super-Fibonacci spirals: fast, low-discrepancy sampling of SO(3), CVPR 2022.
    """
    # The volume of all rotations is 8 pi^2, that of a ball of rotations of a small angle a about 4/3 pi a^3.
    count = math.ceil(8.0 * math.pi**2 / (4.0 / 3.0 * math.pi * math.radians(0.75 * spacing_deg) ** 3))
    phi, psi = math.sqrt(2.0), 1.533751168755204288118041
    s = np.arange(count) + 0.5
    near, far = np.sqrt(s / count), np.sqrt(1.0 - s / count)
    alpha, beta = 2.0 * math.pi * s / phi, 2.0 * math.pi * s / psi
    quaternions = np.column_stack([near * np.sin(alpha), near * np.cos(alpha), far * np.sin(beta), far * np.cos(beta)])
    return np.array([from_quaternion(*quaternion) for quaternion in quaternions.tolist()])
