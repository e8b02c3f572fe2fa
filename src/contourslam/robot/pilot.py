"""Driving along a way by the robot's own idea of where it is."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contourslam.errors import ConfigError
from contourslam.robot.route import SPACING, gently, wanted_twist

Floats = NDArray[np.float64]
Pose = tuple[float, float, float]
_WINDOW = 1.0  # m of the way ahead in which the robot is looked for
_ARRIVED = 0.1  # m


@dataclass(frozen=True, slots=True)
class PilotConfig:
    """How the robot drives along a way."""

    speed: float = 0.3
    """Cruising speed, m/s."""
    turn_limit: float = 0.9
    """No faster turn, rad/s."""
    look_ahead: float = 0.4
    """How far ahead on the way it aims, m."""
    acceleration: float = 0.4
    """m/s²."""
    turn_acceleration: float = 2.5
    """rad/s²."""
    blind_time: float = 1.0
    """Without a scan for this long it stops, s."""
    most_unsure: float = 0.3
    """Where the standard deviation of its position is beyond this, m, it stops."""

    def __post_init__(self) -> None:
        for name in self.__slots__:
            if not getattr(self, name) > 0.0:
                raise ConfigError(f"PilotConfig.{name} must be above 0, got {getattr(self, name)!r}")


class Pilot:
    """Steers along a way; remembers how far it has come and how fast it goes.

    Parameters
    ----------
    way : ndarray, shape (n, 2)
        From :func:`contourslam.robot.route.sample_route`, m, in the frame of the map.
    closed : bool
        The way leads back to its beginning, and the robot drives lap after lap.
    config : PilotConfig
    """

    def __init__(self, way: Floats, *, closed: bool, config: PilotConfig) -> None:
        self._way, self._closed, self._config = way, closed, config
        self._index: int | None = None
        self._spacing = float(np.hypot(*(way[1] - way[0]))) or SPACING
        self._v = self._omega = 0.0
        self._gone = 0

    @property
    def travelled(self) -> float:
        """Way along the route until now, m."""
        return self._gone * self._spacing

    @property
    def laps(self) -> float:
        """The same in laps."""
        return self._gone / len(self._way)

    @property
    def arrived(self) -> bool:
        """Whether the end of an open way is reached."""
        return not self._closed and self._index is not None and self._left() * self._spacing < _ARRIVED

    def _left(self) -> int:
        return len(self._way) - 1 - (self._index or 0)

    def steer(self, pose: Pose | None, dt: float, *, blind: float = 0.0, sigma: float = 0.0) -> tuple[float, float]:
        """Forward speed (m/s) and turn rate (rad/s) for now.

        Parameters
        ----------
        pose : tuple of (float, float, float), optional
            Where the robot takes itself to be: m, m, rad; None where it does not know.
        dt : float
            Time since it was asked last, s.
        blind : float
            Time since the last scan, s.
        sigma : float
            Standard deviation of the position, m.
        """
        config = self._config
        lost = pose is None or blind > config.blind_time or sigma > config.most_unsure
        v, omega = (0.0, 0.0) if pose is None or lost or self.arrived else self._wanted(pose)
        self._v = gently(self._v, v, (3.0 if lost else 1.0) * config.acceleration * dt)
        self._omega = gently(self._omega, omega, config.turn_acceleration * dt)
        return self._v, self._omega

    def _wanted(self, pose: Pose) -> tuple[float, float]:
        config, count = self._config, len(self._way)
        span = round(_WINDOW / self._spacing)
        if self._index is None:  # it begins at the way's nearest point; an open one's end may be near its beginning
            first = self._way if self._closed else self._way[:span]
            self._index = int(np.argmin(np.hypot(first[:, 0] - pose[0], first[:, 1] - pose[1])))
        ahead = self._index + np.arange(span)
        ahead = ahead % count if self._closed else ahead[ahead < count]
        near = int(np.argmin(np.hypot(self._way[ahead, 0] - pose[0], self._way[ahead, 1] - pose[1])))
        self._index, self._gone = int(ahead[near]), self._gone + near
        aim = self._index + round(config.look_ahead / self._spacing)
        target = self._way[aim % count if self._closed else min(aim, count - 1)]
        cruise = config.speed
        if not self._closed:  # slow down towards the end
            cruise = min(cruise, max(math.sqrt(2.0 * config.acceleration * self._left() * self._spacing), 0.05))
        return wanted_twist(pose, (float(target[0]), float(target[1])), cruise, config.turn_limit)
