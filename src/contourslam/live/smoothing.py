"""The correction of the odometry, handed on no faster than a robot's controller can bear."""

import math

import numpy as np

from contourslam.config import LiveConfig
from contourslam.contour.contours import Floats
from contourslam.geometry.poses import between_one, compose_one

ORIGIN = np.zeros(3)


class Smoother:
    """``T_map_odom`` that follows its raw value at a bounded rate.

    What is bounded is the motion of the robot's pose in the map that a correction makes: at ``T_odom_base``, not at the
    odometry's origin, where a degree of heading may be metres. Each step goes straight towards the raw value; a raw
    value within reach is taken over to the bit.

    A correction beyond `large_correction` or `large_correction_deg` (a loop closed) is made at the rates that end it
    `smooth_within` after it came.

    Parameters
    ----------
    config : LiveConfig
    """

    def __init__(self, config: LiveConfig) -> None:
        self._usual = np.array([config.smooth_speed, math.radians(config.smooth_turn_rate_deg)])
        self._large = np.array([config.large_correction, math.radians(config.large_correction_deg)])
        self._within, self._jump_back = config.smooth_within, config.jump_back
        self.reset()

    def reset(self) -> None:
        """Forget everything: the next raw value is taken over at once."""
        self._raw: Floats | None = None
        self._smooth: Floats = np.zeros(3)
        self._T_odom_base: Floats = np.zeros(3)
        self._time = -math.inf
        self._rates = self._usual

    def correct(self, T_map_odom: Floats, T_odom_base: Floats, time: float) -> Floats:
        """Take in a new raw value, and give the smooth one.

        Parameters
        ----------
        T_map_odom : ndarray, shape (3,)
            The raw value: m, m, rad.
        T_odom_base : ndarray, shape (3,)
            Where the odometry has the robot now.
        time : float
            On the clock that the rates are meant in, s; that of the stamps.

        Returns
        -------
        ndarray, shape (3,)
        """
        if self._raw is None:
            self._smooth, self._time = np.array(T_map_odom), time
        self._raw, self._T_odom_base = np.array(T_map_odom), np.array(T_odom_base)
        _, _, error = self._poses(self._raw)
        if (error > self._large).any():
            self._rates = np.maximum(self._rates, error / self._within)
        self.at(time)
        return self._smooth

    def at(self, time: float) -> Floats | None:
        """Give the smooth value at a time; None before the first raw one.

        Parameters
        ----------
        time : float
            s; for a time before the last one asked for, what was given then.
        """
        if self._raw is None:
            return None
        elapsed = time - self._time
        if elapsed < -self._jump_back:  # the clock was set back
            self._time = time
        if elapsed > 0.0:
            self._time = time
            self._advance(self._raw, elapsed)
        return self._smooth

    def _poses(self, raw: Floats) -> tuple[Floats, Floats, Floats]:
        """The robot's smooth pose, its raw one, and how far these are apart, m and rad."""
        smooth, wanted = compose_one(self._smooth, self._T_odom_base), compose_one(raw, self._T_odom_base)
        turn = abs(math.remainder(wanted[2] - smooth[2], 2.0 * math.pi))
        return smooth, wanted, np.array([math.hypot(wanted[0] - smooth[0], wanted[1] - smooth[1]), turn])

    def _advance(self, raw: Floats, elapsed: float) -> None:
        smooth, wanted, error = self._poses(raw)
        reach = self._rates * elapsed
        if self._usual[0] == 0.0 or (error <= reach).all():
            self._smooth, self._rates = raw, self._usual
            return
        part = float((reach / np.maximum(error, reach)).min())
        pose = compose_one(smooth, part * between_one(smooth, wanted))
        self._smooth = compose_one(pose, between_one(self._T_odom_base, ORIGIN))
