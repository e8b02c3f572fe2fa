"""What the wheels say: the pose of the base in a frame that drifts."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contourslam.errors import ScanError
from contourslam.scan.laser_scan import all_finite


@dataclass(frozen=True, slots=True)
class Odometry:
    """One odometry reading.

    Attributes
    ----------
    stamp : float
        Time in s.
    pose : ndarray, shape (3,)
        x (m), y (m), heading (rad) of the base in the odometry frame (``T_odom_base``).
    """

    stamp: float
    pose: NDArray[np.float64]

    def __post_init__(self) -> None:
        pose = np.array(self.pose, dtype=np.float64)
        if pose.shape != (3,) or not all_finite(pose) or not math.isfinite(self.stamp):
            raise ScanError(f"odometry at stamp {self.stamp}: pose must be three finite numbers, got {self.pose!r}")
        pose.flags.writeable = False
        object.__setattr__(self, "pose", pose)


@dataclass(frozen=True, slots=True)
class TruePose:
    """The true pose of the base in the world frame, known in simulation only.

    Attributes
    ----------
    stamp : float
        Time in s.
    pose : ndarray, shape (3,)
        x (m), y (m), heading (rad) (``T_world_base``).
    """

    stamp: float
    pose: NDArray[np.float64]
