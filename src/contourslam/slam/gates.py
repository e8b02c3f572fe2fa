"""Quantiles of the chi-square distribution for the even degrees of freedom that landmarks of two numbers have."""

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from contourslam.errors import ConfigError


@lru_cache(maxsize=256)
def chi_square_gate(probability: float, dof: int) -> float:
    """Value that a chi-square variable of even `dof` stays below with the given probability.

    For even degrees of freedom the distribution function is a finite sum, so no library is needed on the robot.

    Parameters
    ----------
    probability : float
        Between 0 and 1.
    dof : int
        Even and positive.

    Raises
    ------
    ConfigError
        If an argument is out of its range.
    """
    if not 0.0 < probability < 1.0 or dof < 2 or dof % 2:
        raise ConfigError(f"no gate for probability {probability} and {dof} degrees of freedom")
    low, high = 0.0, 4.0 * dof + 100.0
    for _ in range(80):
        middle = 0.5 * (low + high)
        term = tail = math.exp(-0.5 * middle)
        for i in range(1, dof // 2):
            term *= 0.5 * middle / i
            tail += term
        low, high = (middle, high) if 1.0 - tail < probability else (low, middle)
    return high


@lru_cache(maxsize=256)
def joint_gates(probability: float, most: int) -> NDArray[np.float64]:
    """Gates for 0 to `most` landmarks at once, shape (most + 1,); that for none is zero."""
    return np.array([0.0] + [chi_square_gate(probability, 2 * m) for m in range(1, most + 1)])
