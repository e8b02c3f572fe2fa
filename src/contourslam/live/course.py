"""A mapper and the odometry that is handed to it: scan by scan, and on to another mapper where the robot is lost."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from contourslam.config import LiveConfig
from contourslam.contour.contours import Floats
from contourslam.geometry.poses import between, between_one, compose_one
from contourslam.live.backing import Backing
from contourslam.live.continuous import ContinuousOdometry
from contourslam.live.events import Released, TimeJump
from contourslam.scan import Odometry
from contourslam.slam.mapper import Mapper
from contourslam.slam.result import ScanUpdate
from contourslam.slam.wheels import STALE

# Odometry that has moved by less while time ran back shows that only the clock was set: m, rad.
SAME_PLACE = np.array([0.5, math.radians(30.0)])


@dataclass(frozen=True, slots=True)
class Step:
    """What the mapper said of one scan, and where the odometry had the robot.

    Attributes
    ----------
    update : ScanUpdate
    T_own_base : ndarray, shape (3,)
        Odometry at the scan's stamp, in the frame in which it neither leaps nor has gaps.
    T_own_odom : ndarray, shape (3,), or None
        The odometry's frame in that frame; None where they are one.
    localized : bool
        Whether the mapper knows where the robot is.
    blind : bool
        There was no odometry for this scan.
    seconds : mapping
        CPU time of each stage, s.
    """

    update: ScanUpdate
    T_own_base: Floats
    T_own_odom: Floats | None
    localized: bool
    blind: bool
    seconds: Mapping[str, float]

    @property
    def correction(self) -> Floats:
        """The odometry's own frame in the map (``T_map_own``), shape (3,)."""
        return compose_one(np.array(self.update.pose), between_one(self.T_own_base, np.zeros(3)))

    @property
    def raw_odometry(self) -> Floats:
        """Odometry at the scan's stamp as it came (``T_odom_base``), shape (3,); zeros where none has ever come."""
        return self.T_own_base if self.T_own_odom is None else between_one(self.T_own_odom, self.T_own_base)

    def to_odom(self, T_map_own: Floats) -> Floats:
        """Give the ``T_map_odom`` that belongs to a correction in the frame without leaps."""
        return T_map_own if self.T_own_odom is None else compose_one(T_map_own, self.T_own_odom)


class Course:
    """A mapper with its odometry; changed in place by every scan.

    Parameters
    ----------
    backing : Backing
    config : LiveConfig
    odometry_lag : float
        The odometry that belongs to a scan is stamped this much earlier, s.

    Attributes
    ----------
    mapper : Mapper
    leap : float
        By how much the odometry has leapt since :meth:`step` was last called, m, with 1 rad counted as 1 m.
    """

    def __init__(self, backing: Backing, config: LiveConfig, odometry_lag: float) -> None:
        self._backing, self._lag = backing, odometry_lag
        self.mapper = (backing.first or backing.begin)()
        self._odometry = ContinuousOdometry(config)
        self.leap = 0.0

    def step(self, item: Released) -> Step:
        """Hand a scan and its odometry to the mapper.

        Raises
        ------
        ContourslamError
            If the mapper cannot use the scan.
        """
        leaps = [self._push(reading) for reading in item.readings]
        self.leap = max(leaps, default=0.0)
        last = self._odometry.last
        blind = last is None or item.scan.stamp - self._lag - last.stamp > STALE
        if blind and self._backing.guesses:
            self._odometry.bridge()  # or else the motion found without it would count twice when it returns
        watch = self._backing.stopwatch
        watch.seconds.clear()
        watch.start()
        update = self.mapper.push_scan(item.scan)
        odometry, T_own_odom = np.array(self.mapper.odometry_pose), self._odometry.T_own_odom
        return Step(update, odometry, T_own_odom, self.localized, blind, dict(watch.seconds))

    @property
    def localized(self) -> bool:
        """Whether the mapper knows where the robot is."""
        return self._backing.localized(self.mapper)

    def was_only_the_clock(self, item: Released) -> bool:
        """Whether the odometry that comes with the first scan after time ran back goes on from where it was before."""
        last = self._odometry.last
        if last is None or not item.readings:
            return False
        step = between(last.pose, item.readings[0].pose)
        return bool((np.array([math.hypot(step[0], step[1]), abs(step[2])]) < SAME_PLACE).all())

    def go_on_with(self, mapper: Mapper, jump: TimeJump | None = None) -> None:
        """Take another mapper, and tell it where the odometry stands, unless time has run back since."""
        last = self._odometry.last
        if mapper is self.mapper:
            return
        self.mapper = mapper
        self._odometry.reset()
        if last is not None and jump is None:
            self._push(last)

    def _push(self, reading: Odometry) -> float:
        passed_on, leap = self._odometry.take(reading)
        self.mapper.push_odometry(passed_on)
        return leap
