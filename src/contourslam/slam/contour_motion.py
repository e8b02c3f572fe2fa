"""The motion between two scans as their contours have it, in place of the wheels' alone."""

import math

import numpy as np

from contourslam.contour.contours import Floats
from contourslam.geometry.poses import between_one
from contourslam.matching.odometry import FLOOR, ContourOdometry
from contourslam.matching.rescue import LOOSE
from contourslam.matching.small import invert, turned
from contourslam.scan import LaserScan
from contourslam.slam.wheels import Wheels

PER_STEP = 0.1  # m, or rad, of motion that `FLOOR` is meant for


class ContourMotion:
    """Contour odometry beside a filter: what it says of each step, with a covariance to predict with.

    Both scans of a step were aligned to the same contours of the last metres, so their errors are small and do not add
    up along it; a filter takes them as independent from step to step all the same, which errs on the safe side.

    Parameters
    ----------
    max_range : float
        No contour point lies farther from the robot than this, m.
    """

    def __init__(self, max_range: float) -> None:
        self._odometry = ContourOdometry(max_range)
        self._last_step: Floats = np.zeros(3)
        self._last_elapsed, self._stamp = 0.0, -math.inf

    def step(
        self, scan: LaserScan, oriented: Floats, wheels: Wheels, motion: tuple[Floats, Floats]
    ) -> tuple[Floats, Floats, float]:
        """Motion since the last scan, its covariance, and how well the contours fitted.

        Parameters
        ----------
        scan : LaserScan
        oriented : ndarray, shape (n, 4)
            Its contour points and normals in the frame of the base.
        wheels : Wheels
            Their word is the prior; where they are silent, the robot is taken to go on as it did.
        motion : (ndarray, ndarray)
            What :meth:`Wheels.during` gave for the scan.

        Returns
        -------
        increment : ndarray, shape (3,)
            In the frame of the base at the last scan: m, m, rad.
        covariance : ndarray, shape (3, 3)
            In that frame. Directions that the contours fix are known by them, those that they leave open by the wheels.
        quality : float
            0 where nothing could be aligned, then the increment is the wheels', to 1.
        """
        increment, noise = wheels.step_or_guess(scan.stamp, motion, self._last_step, self._last_elapsed)
        before = self._odometry.pose
        found = self._odometry.push(oriented, increment, noise)
        step = between_one(before, found.pose)
        self._last_step, self._last_elapsed, self._stamp = step, scan.stamp - self._stamp, scan.stamp
        if found.alignment is None:
            return step, noise, found.quality
        prior = turned(LOOSE, -before[2]) if found.slipped else invert(noise)
        moved = (math.hypot(step[0], step[1]) + abs(float(step[2]))) / PER_STEP
        covariance = invert(prior + turned(found.alignment.information, -before[2])) + min(moved, 1.0) * FLOOR
        return step, covariance, found.quality
