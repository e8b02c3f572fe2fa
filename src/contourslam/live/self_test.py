"""Whether the mapping works on this machine: a drive whose true poses are known, mapped and held against them."""

from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np

from contourslam.config import Config
from contourslam.contour.contours import Floats
from contourslam.geometry.poses import between
from contourslam.live.warming import BEAMS, made_up_drive
from contourslam.replay import make_mapper

LAPS = 1.2  # until the corners that were seen first are seen again


@dataclass(frozen=True, slots=True)
class SelfTest:
    """What came out.

    Attributes
    ----------
    scans, beams : int
        How many were mapped, and of how many beams each.
    seconds : float
        That the mapping took, s.
    error, odometry_error : float
        RMS of the distance from the true position, m: of the mapping as known at the time, and of the wheels alone.
    """

    scans: int
    beams: int
    seconds: float
    error: float
    odometry_error: float


def self_test(config: Config) -> SelfTest:
    """Map a made-up drive and hold it against the truth.

    The drive is the same each time, and so is what comes out, but for the time.

    Parameters
    ----------
    config : Config

    Raises
    ------
    MissingExtraError
        If the back end that the configuration names is not installed.
    """
    drive = list(made_up_drive(LAPS))
    at_once = np.zeros(BEAMS)  # the drive stands still while it scans
    mapper = make_mapper(config)
    begun = perf_counter()
    poses = []
    for odometry, scan, _ in drive:
        mapper.push_odometry(odometry)
        poses.append(mapper.push_scan(replace(scan, offsets=at_once)).pose)
    seconds = perf_counter() - begun
    truth = np.array([pose for _, _, pose in drive])
    wheels = np.array([odometry.pose for odometry, _, _ in drive])
    return SelfTest(
        scans=len(drive),
        beams=BEAMS,
        seconds=seconds,
        error=_rms(np.array(poses), truth),
        odometry_error=_rms(wheels, truth),
    )


def _rms(poses: Floats, truth: Floats) -> float:
    """RMS distance of two paths that begin in one place."""
    apart = between(poses[0], poses)[:, :2] - between(truth[0], truth)[:, :2]
    return float(np.sqrt((apart**2).sum(axis=1).mean()))
