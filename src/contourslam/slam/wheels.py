"""The wheels' word between two scans; without wheels, that the robot goes on as it did."""

import math

import numpy as np

from contourslam.config import SlamConfig
from contourslam.contour.contours import Floats
from contourslam.geometry.poses import between_one
from contourslam.scan import LaserScan, Odometry
from contourslam.slam.motion import motion_noise
from contourslam.slam.odometry_buffer import OdometryBuffer

SHORTEST = 0.1  # two scans are taken to lie at least this far apart (s) where a speed is asked for: stamps jitter
LONGEST = 1.0  # nor do they count as farther apart than this (s) where motion is guessed: nobody goes on for long
MOST_CHANGE = 1.5  # nor is a step guessed more than this much longer or shorter than the last one
STALE = 0.5  # readings that end this long before the scan (s) say nothing about it ...
SILENT, MOST_SILENT = 0.5, 10.0  # ... unless that is less than this part of the time between scans far apart (s)
# Without wheels, standard deviations of the velocity that a robot has beside that of the last step: m/s, m/s, rad/s.
CRUISE = np.array([0.2, 0.2, 0.5])
# Wheels that report no motion at all (less than this: m, rad) are dead, not at rest, if the robot moves by so much.
STILL, MOVES, TURNS = 1e-9, 0.02, math.radians(1.0)


class Wheels:
    """Odometry readings, asked for the motion up to a scan and during it; changed in place.

    Parameters
    ----------
    config : SlamConfig
    """

    def __init__(self, config: SlamConfig) -> None:
        self._config = config
        self._readings = OdometryBuffer()
        self._at_scan: Floats | None = None
        self._stamp, self._twist = -math.inf, np.zeros(3)
        self._usual = SHORTEST  # time between two scans, s
        self._last_step: Floats = np.zeros(3)
        self._last_elapsed = 0.0
        self._still = self._dead = True  # until they are seen to turn: many a log without wheels has zeros for odometry

    def push(self, odometry: Odometry) -> None:
        """Take in one reading."""
        self._readings.push(odometry)

    @property
    def pose(self) -> Floats:
        """Raw odometry at the stamp of the last scan (``T_odom_base``), shape (3,); zeros before the first reading."""
        return np.zeros(3) if self._at_scan is None else self._at_scan

    def during(self, scan: LaserScan) -> tuple[Floats, Floats]:
        """Readings around a scan: times after its stamp, s, and poses of the base in the odometry's frame."""
        start = scan.stamp - self._config.odometry_lag
        duration = float(scan.offsets.max()) if scan.offsets.size else 0.0
        return self._readings.during(start, start + duration)

    def step(self, stamp: float, motion: tuple[Floats, Floats]) -> tuple[Floats, Floats] | None:
        """Motion since the last scan and its covariance, in the frame of the base then; None where nothing is known.

        Parameters
        ----------
        stamp : float
            Of the scan, s.
        motion : (ndarray, ndarray)
            What :meth:`during` gave for it.
        """
        if len(motion[0]) == 0:
            self._stamp = stamp
            return None
        now = self._readings.pose_at_start(*motion)
        before = now if self._at_scan is None else self._at_scan
        self._at_scan = now
        increment = between_one(before, now)
        elapsed = stamp - self._stamp
        twist = increment / max(elapsed, SHORTEST) if 0.0 < elapsed < math.inf else self._twist
        noise = motion_noise(increment, self._config.motion, twist - self._twist)
        self._stamp, self._twist = stamp, twist
        return increment, noise

    def went(self, step: Floats) -> None:
        """Say how the robot moved up to the last scan after all: where the wheels fall silent it is taken to go on so.

        Parameters
        ----------
        step : ndarray, shape (3,)
            In the frame of the base at the scan before.
        """
        self._last_step = step
        self._dead |= self._still and (math.hypot(step[0], step[1]) > MOVES or abs(step[2]) > TURNS)

    def step_or_guess(self, stamp: float, motion: tuple[Floats, Floats]) -> tuple[Floats, Floats]:
        """Motion since the last scan: the wheels', or where they are silent, that of the last step once more.

        Parameters
        ----------
        stamp : float
            Of the scan, s.
        motion : (ndarray, ndarray)
            What :meth:`during` gave for it.
        """
        elapsed, before = stamp - self._stamp, self._last_elapsed
        self._last_elapsed = elapsed
        known = self.step(stamp, motion)
        self._still = known is None or bool((np.abs(known[0]) < STILL).all())
        self._dead &= self._still
        if known is not None and not self._dead and motion[0][-1] > -max(STALE, SILENT * min(elapsed, MOST_SILENT)):
            return known
        if not math.isfinite(elapsed):
            return np.zeros(3), np.diag((CRUISE * SHORTEST) ** 2)
        # Stamps given late come in bunches: five scans within a millisecond were not taken so.
        self._usual += 0.05 * (min(max(elapsed, 0.0), LONGEST) - self._usual)
        ahead = min(max(elapsed, self._usual, SHORTEST), LONGEST)
        ratio = min(max(ahead / max(before, self._usual, SHORTEST), 1.0 / MOST_CHANGE), MOST_CHANGE)
        return self._last_step * ratio, np.diag((CRUISE * ahead) ** 2)
