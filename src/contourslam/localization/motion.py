"""How the robot moved up to a scan, and during it: the wheels' word, and where they are silent, that it goes on."""

import math
from dataclasses import dataclass

import numpy as np

from contourslam.config import SlamConfig
from contourslam.contour.contours import Floats
from contourslam.geometry.angles import wrap_angle
from contourslam.landmarks.detect import NO_MOTION
from contourslam.matching.certainty import exposure
from contourslam.scan import LaserScan, Odometry
from contourslam.slam.wheels import CRUISE, LONGEST, Wheels

SILENT = 0.05  # s before a scan; odometry that ends earlier leaves open how the robot moved
LEARN = 0.01  # weight of the newest scan in what is known of the wheels' turns
SECOND = np.array([0.0, 1.0])


@dataclass(frozen=True, slots=True)
class Step:
    """Motion up to a scan.

    Attributes
    ----------
    increment, noise : ndarray, shape (3,) and (3, 3)
        Since the last scan, in the frame of the base then, and its covariance.
    during : (ndarray, ndarray)
        Motion during the scan, as :func:`contourslam.landmarks.trace` takes it.
    elapsed : float
        Since the last scan, s; infinite at the first one.
    exposure : float
        Part of the noise that blurs the scan, see :func:`contourslam.matching.certainty.exposure`.
    blur : float
        Variance of the scan's heading from turns during it that the wheels do not tell, rad^2.
    """

    increment: Floats
    noise: Floats
    during: tuple[Floats, Floats]
    elapsed: float
    exposure: float
    blur: float


class Motion:
    """Odometry readings in, motion up to each scan out; changed in place.

    Parameters
    ----------
    config : SlamConfig
    """

    def __init__(self, config: SlamConfig) -> None:
        self._wheels = Wheels(config)
        self._stamp = -math.inf
        self._during, self._twist = NO_MOTION, np.zeros(3)  # the motion during a scan, if the robot goes on as it did
        self._newest: Step | None = None
        self.last: Floats = np.zeros(3)
        """The last step as it turned out, shape (3,)."""
        self._turn_excess, self._taught = 1.0, 0  # variance of the wheels' turns as found, as a part of what is stated

    @property
    def odometry_pose(self) -> Floats:
        """Raw odometry at the stamp of the last scan (``T_odom_base``), shape (3,); zeros before the first reading."""
        return self._wheels.pose

    def push(self, odometry: Odometry) -> None:
        """Take in one reading."""
        self._wheels.push(odometry)

    def up_to(self, scan: LaserScan) -> Step:
        """Motion since the scan before; :meth:`went` is to be called before the next one."""
        readings = self._wheels.during(scan)
        elapsed = scan.stamp - self._stamp
        silent = -float(readings[0][-1]) if len(readings[0]) else math.inf  # s between the last reading and the scan
        increment, noise = self._wheels.step_or_guess(scan.stamp, readings)
        if silent > SILENT:
            noise = noise + np.diag((CRUISE * min(silent, max(elapsed, 0.0), LONGEST)) ** 2)
        self._stamp = scan.stamp
        exposed = exposure(scan.offsets, elapsed)
        blur = exposed * float(noise[2, 2]) * self._turn_excess
        during = self._during if silent > SILENT else readings
        self._newest = Step(increment, noise, during, elapsed, exposed, blur)
        return self._newest

    def went(self, step: Floats, *, sure: bool) -> None:
        """Say how the robot moved after all.

        Parameters
        ----------
        step : ndarray, shape (3,)
            Up to the last scan, in the frame of the base at the one before.
        sure : bool
            The map says so: the wheels' turns can be judged by it.
        """
        self._wheels.went(step)
        self.last, newest = step, self._newest
        if newest is None:
            return
        if 0.0 < newest.elapsed < LONGEST:
            # Over two steps: of one alone, an error would come back with the other sign at each scan and not fade.
            twist = step / newest.elapsed
            self._during, self._twist = (SECOND, np.stack([np.zeros(3), 0.5 * (twist + self._twist)])), twist
        stated = float(newest.noise[2, 2])
        if sure and stated > 0.0:
            square = wrap_angle(step[2] - newest.increment[2]) ** 2 / stated
            gain = max(1.0 / (self._taught + 2.0), LEARN)
            self._taught += 1
            self._turn_excess += gain * (min(square, 16.0 * self._turn_excess) - self._turn_excess)
