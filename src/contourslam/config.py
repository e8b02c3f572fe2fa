"""Every setting of the core, a small frozen class per stage, in physical units, with defaults that work.

Pure data on purpose: the command line is generated from these classes, and asking it for help loads nothing else.
"""

from dataclasses import dataclass, field
from typing import Literal

from contourslam.errors import ConfigError

DetectorName = str
Association = Literal["nearest", "mahalanobis", "mutual", "joint"]


def _require(condition: bool, message: str) -> None:
    if not condition:
        raise ConfigError(message)


@dataclass(frozen=True, slots=True)
class LidarConfig:
    """The lidar and where it sits."""

    mount_x: float = 0.0
    """Lidar ahead of the middle of the axle, m (d of eq. 30). A recording's own static transform wins over the three."""
    mount_y: float = 0.0
    """Lidar to the left of the middle of the axle, m."""
    mount_yaw: float = 0.0
    """Direction of the lidar's zero beam in the base frame, rad."""
    sigma_range: float = 0.01
    """Standard deviation of one range, m. Where the points of a wall scatter more, their own scatter is used."""
    max_range: float = 30.0
    """Ranges beyond this are ignored, m."""
    beam_width_deg: float = 0.5
    """Least angular resolution to expect, degrees: below it two beams may see one spot."""

    def __post_init__(self) -> None:
        _require(self.sigma_range > 0, f"lidar.sigma_range must be positive, got {self.sigma_range}")
        _require(self.max_range > 0, f"lidar.max_range must be positive, got {self.max_range}")
