"""Odometry without the leaps that its driver makes when it is started again, and without what went by unheard."""

import math

from contourslam.config import LiveConfig
from contourslam.contour.contours import Floats
from contourslam.geometry.poses import between, compose, inverse
from contourslam.scan import Odometry

SLACK, TURN_SLACK = 0.2, math.radians(20.0)  # m and rad: what jitter of the stamps may add between two readings
LONGEST = 1.0  # s: nobody is believed to have gone on at the greatest speed for longer


class ContinuousOdometry:
    """Readings passed on in a frame in which a leap is no motion; changed in place.

    Until the first leap, or bridge, a reading is passed on as it is.

    Parameters
    ----------
    config : LiveConfig

    Attributes
    ----------
    T_own_odom : ndarray, shape (3,), or None
        The odometry's frame in that which is passed on; None while they are one.
    """

    def __init__(self, config: LiveConfig) -> None:
        self._speed, self._turn_rate = config.max_speed, math.radians(config.max_turn_rate_deg)
        self.reset()

    def reset(self) -> None:
        """Forget everything: the next reading is passed on as it is."""
        self._last: Odometry | None = None
        self._bridging = False
        self.T_own_odom: Floats | None = None

    @property
    def last(self) -> Odometry | None:
        """The last reading, as it came; None before the first."""
        return self._last

    def bridge(self) -> None:
        """Let the next reading be no motion: scans have carried the pose over the gap before it."""
        self._bridging = True

    def take(self, reading: Odometry) -> tuple[Odometry, float]:
        """Take in a reading.

        Parameters
        ----------
        reading : Odometry

        Returns
        -------
        reading : Odometry
            To be passed on.
        leap : float
            By how much the odometry leapt, m, with 1 rad counted as 1 m; 0 where it did not.
        """
        leap = self._leap(reading)
        bridging, self._bridging = self._bridging, False
        if (leap or bridging) and self._last is not None:
            own = self._last.pose if self.T_own_odom is None else compose(self.T_own_odom, self._last.pose)
            self.T_own_odom = compose(own, inverse(reading.pose))
        self._last = reading
        if self.T_own_odom is None:
            return reading, leap
        return Odometry(reading.stamp, compose(self.T_own_odom, reading.pose)), leap

    def raw(self, own: Floats) -> Floats:
        """Give a pose in the frame that is passed on as the odometry itself has it (``T_odom_base``)."""
        return own if self.T_own_odom is None else between(self.T_own_odom, own)

    def _leap(self, reading: Odometry) -> float:
        if self._last is None:
            return 0.0
        (x0, y0, heading0), (x, y, heading) = self._last.pose.tolist(), reading.pose.tolist()
        way, turn = math.hypot(x - x0, y - y0), abs(math.remainder(heading - heading0, 2.0 * math.pi))
        elapsed = min(max(reading.stamp - self._last.stamp, 0.0), LONGEST)
        leaps = way > self._speed * elapsed + SLACK or turn > self._turn_rate * elapsed + TURN_SLACK
        return way + turn if leaps else 0.0
