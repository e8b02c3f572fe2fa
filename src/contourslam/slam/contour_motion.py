"""The motion between two scans as their contours have it, in place of the wheels' alone."""

import math
from dataclasses import dataclass

import numpy as np

from contourslam.contour.contours import Floats
from contourslam.geometry.poses import between_one
from contourslam.matching.odometry import FLOOR, KEY_DISTANCE, ContourOdometry
from contourslam.matching.rescue import LOOSE
from contourslam.matching.small import invert, turned
from contourslam.scan import LaserScan
from contourslam.slam.wheels import Wheels

LEAST = 0.02  # m, and rad: a robot that moved less may as well have stood still


@dataclass(frozen=True, slots=True)
class ContourStep:
    """Motion from one scan to the next.

    Attributes
    ----------
    increment : ndarray, shape (3,)
        In the frame of the base at the earlier scan: m, m, rad.
    covariance : ndarray, shape (3, 3)
        In that frame.
    quality : float
        How well the contours fitted, at most 1; 0 where nothing could be aligned.
    aligned : bool
        False where there was nothing to align, and all that is known comes from the wheels.
    moved : float
        Length of the motion, m, with 1 rad of turning counted as 1 m.
    """

    increment: Floats
    covariance: Floats
    quality: float
    aligned: bool
    moved: float


class ContourMotion:
    """Contour odometry beside a filter: what it says of each step, with a covariance to predict with.

    Two scans a few centimetres apart are aligned to the same contours: their errors are alike and do not add up from
    scan to scan, but they do from one stretch of contours to the next. So one alignment's covariance, and `FLOOR`, are
    counted once per keyframe distance; the jitter of the single pose within it belongs to the measurements, see
    :func:`contourslam.slam.observation.loosened`.

    Parameters
    ----------
    max_range : float
        No contour point lies farther from the robot than this, m.
    """

    def __init__(self, max_range: float) -> None:
        self._odometry = ContourOdometry(max_range)

    def step(self, scan: LaserScan, oriented: Floats, wheels: Wheels, motion: tuple[Floats, Floats]) -> ContourStep:
        """Motion since the last scan; none at the first.

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
        ContourStep
            Directions that the contours fix are known as well as these say, those that they leave open as well as the
            wheels say. Where nothing could be aligned it is the wheels' step with the wheels' covariance.
        """
        found = step_by_contours(self._odometry, oriented, *wheels.step_or_guess(scan.stamp, motion))
        wheels.went(found.increment)
        return found


def step_by_contours(
    odometry: ContourOdometry, oriented: Floats, increment: Floats, noise: Floats, exposure: float = 0.0
) -> ContourStep:
    """Motion since the last scan, as :meth:`ContourMotion.step` gives it.

    Parameters
    ----------
    odometry : ContourOdometry
        Takes the scan in.
    oriented, increment, noise, exposure
        As of :meth:`ContourOdometry.push`.
    """
    before, first = odometry.pose, odometry.keyframes == 0
    found = odometry.push(oriented, increment, noise, exposure)
    step = between_one(before, found.pose)
    moved = math.hypot(step[0], step[1]) + abs(float(step[2]))
    if first:
        return ContourStep(step, 1e-10 * np.eye(3), found.quality, False, moved)
    if found.alignment is None:
        return ContourStep(step, noise, found.quality, False, moved)
    prior = turned(LOOSE, -before[2]) if found.slipped else invert(noise)
    keyframes = moved / KEY_DISTANCE
    information = turned(found.alignment.information, -before[2]) / min(max(keyframes, LEAST / KEY_DISTANCE), 1.0)
    return ContourStep(step, invert(prior + information) + keyframes * FLOOR, found.quality, True, moved)
