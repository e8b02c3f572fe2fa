"""The correction of the odometry, handed on no faster than a robot's controller can bear."""

import math

import numpy as np

from contourslam.config import LiveConfig
from contourslam.contour.contours import Floats


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
        self._config = config
        self.reset()

    def reset(self) -> None:
        """Forget everything: the next raw value is taken over at once."""
        self._raw: Floats | None = None
        self._smooth: Floats = np.zeros(3)
        self._T_odom_base: Floats = np.zeros(3)
        self._time = -math.inf
        self._speed, self._turn_rate = 0.0, 0.0

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
        raise NotImplementedError

    def at(self, time: float) -> Floats | None:
        """Give the smooth value at a time; None before the first raw one.

        Parameters
        ----------
        time : float
            s; a time before the last one asked for gives what was given then.
        """
        raise NotImplementedError
