"""How a wheeled robot moves in the plane."""

import numpy as np
from numpy.typing import NDArray

from contourslam.geometry.angles import wrap

Floats = NDArray[np.float64]


def unicycle_step(pose: Floats, v: float, omega: float, dt: float) -> Floats:
    """One step of the differential-drive robot as the paper prints it (eq. 28).

    The step goes straight along the heading *after* the turn, theta + omega * dt.

    Parameters
    ----------
    pose : ndarray, shape (3,)
        x (m), y (m), heading (rad) before the step.
    v : float
        Forward speed, m/s.
    omega : float
        Turning speed, rad/s.
    dt : float
        Duration, s.

    Returns
    -------
    ndarray, shape (3,)
        Pose after the step, heading in (-pi, pi].
    """
    heading = float(pose[2]) + omega * dt
    x, y = pose[0] + v * dt * np.cos(heading), pose[1] + v * dt * np.sin(heading)
    return np.array([x, y, wrap(np.array(heading))])
