"""Motion model: how far the base moved between two scans, and how well the wheels know it (eqs 23-24, 28)."""

import math

import numpy as np

from contourslam.config import MotionConfig
from contourslam.contour.contours import Floats
from contourslam.kernels import kernel
from contourslam.matching.small import turned


def motion_noise(increment: Floats, config: MotionConfig, twist_change: Floats | None = None) -> Floats:
    """Covariance of an odometry increment in the frame it starts in (R of eq. 24).

    The variances grow with the distance and the angle driven, so that they add up alike over short and long steps.

    Parameters
    ----------
    increment : ndarray, shape (3,)
        Forward (m), left (m) and turn (rad) since the last scan.
    config : MotionConfig
    twist_change : ndarray, shape (3,), optional
        By how much forward, left (m/s) and turning (rad/s) speed changed since the scan before. Where the clocks of
        lidar and wheels disagree, a steady motion hides it; starting and stopping shows it.

    Returns
    -------
    ndarray, shape (3, 3)
        Diagonal: forward, left (m²), turn (rad²).
    """
    distance, turn = math.hypot(increment[0], increment[1]), abs(float(increment[2]))
    # A standing robot keeps a trace of doubt, so that the covariance stays positive definite.
    forward = config.forward_per_sqrt_m**2 * distance + 1e-10
    lateral = config.lateral_per_sqrt_m**2 * (distance + 0.1 * turn) + 1e-10
    heading = math.radians(config.turn_per_sqrt_m_deg) ** 2 * distance
    heading += math.radians(config.turn_per_sqrt_rad_deg) ** 2 * turn + 1e-10
    if twist_change is not None:
        forward += (config.clock_sigma * twist_change[0]) ** 2
        lateral += (config.clock_sigma * twist_change[1]) ** 2
        heading += (config.clock_sigma * twist_change[2]) ** 2
    noise = np.zeros((3, 3))
    noise[0, 0], noise[1, 1], noise[2, 2] = forward, lateral, heading
    return noise


@kernel
def predict(
    mean: Floats, covariance: Floats, size: int, increment: Floats, noise: Floats, linearised_at: Floats
) -> None:
    """Prediction of the filter, in place: the pose moves by `increment`, its covariance grows (eqs 23-24, 28).

    Eq. (28) is the increment (V dt cos(omega dt), V dt sin(omega dt), omega dt). Only the pose's three rows change.

    Parameters
    ----------
    mean : ndarray, shape (>= size,)
        State: x, y, heading, then two numbers a landmark.
    covariance : ndarray, shape (>= size, >= size)
        Its covariance; the lower triangle is kept.
    size : int
        Numbers in the state.
    increment : ndarray, shape (3,)
        Motion in the base frame: forward (m), left (m), turn (rad).
    noise : ndarray, shape (3, 3)
        Its covariance in the frame it starts in.
    linearised_at : ndarray, shape (3,)
        Pose at which the Jacobian is taken to start: the mean itself, or the first estimate of it.
    """
    start = mean[2]
    cos, sin = math.cos(start), math.sin(start)
    mean[0] += cos * increment[0] - sin * increment[1]
    mean[1] += sin * increment[0] + cos * increment[1]
    mean[2] = -((-(mean[2] + increment[2]) + math.pi) % (2.0 * math.pi) - math.pi)
    # G = [[1, 0, -dy], [0, 1, dx], [0, 0, 1]] for the pose, the identity for the landmarks.
    gx, gy = -(mean[1] - linearised_at[1]), mean[0] - linearised_at[0]
    p = covariance
    xx, yx, yy, tx, ty, tt = p[0, 0], p[1, 0], p[1, 1], p[2, 0], p[2, 1], p[2, 2]
    r = turned(noise, start)
    p[0, 0] = xx + 2.0 * gx * tx + gx * gx * tt + r[0, 0]
    p[1, 0] = yx + gx * ty + gy * tx + gx * gy * tt + r[1, 0]
    p[1, 1] = yy + 2.0 * gy * ty + gy * gy * tt + r[1, 1]
    p[2, 0] = tx + gx * tt + r[2, 0]
    p[2, 1] = ty + gy * tt + r[2, 1]
    p[2, 2] = tt + r[2, 2]
    for i in range(3, size):
        p[i, 0] += gx * p[i, 2]
        p[i, 1] += gy * p[i, 2]
