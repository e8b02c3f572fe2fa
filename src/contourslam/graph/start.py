"""Where a further drive begins in a map that was kept."""

import math
from collections.abc import Callable, Iterable

import numpy as np

from contourslam.config import Config
from contourslam.contour.contours import Floats
from contourslam.geometry.poses import between_one, compose_one
from contourslam.graph.slam import GraphSlam
from contourslam.localization.follow import Localizer
from contourslam.maps.saved_map import SavedMap
from contourslam.matching.small import moved, turned
from contourslam.scan import LaserScan, Odometry

SURE = 5  # scans in a row that find the robot where it is followed to
# A drive that goes on at a wrong place spoils the map, and one corridor looks like another: the robot is followed this
# far (m) from where it was found, or through so many scans where it stands, or to the end.
WAY, SCANS = 10.0, 150


def find_start(
    saved: SavedMap,
    config: Config,
    messages: Iterable[Odometry | LaserScan],
    *,
    guess: Floats | None = None,
    lidar_mount: Floats | None = None,
    on_scan: Callable[[], None] = lambda: None,
) -> tuple[Floats, Floats] | None:
    """Find the pose at the first scan of a drive, as soon as its scans show where it is.

    The drive is followed in the map and, beside that, mapped as if it were a new one: once it is known where the robot
    is by now, the way back to its first scan is known too.

    Parameters
    ----------
    saved : SavedMap
    config : Config
    messages : iterable of Odometry or LaserScan
        The drive from its first scan on; no more of it is taken than is needed.
    guess : ndarray, shape (3,), optional
        About where it begins, in the frame of the map: m, m, rad.
    lidar_mount : ndarray, shape (3,), optional
        ``T_base_lidar``; that of the configuration by default.
    on_scan : callable, optional
        Called after each scan.

    Returns
    -------
    (ndarray, ndarray) or None
        Pose of the base in the frame of the map at the first scan, shape (3,), and its covariance in the map's axes,
        shape (3, 3); None where the messages do not show it.
    """
    localizer = Localizer(saved, config, initial_pose=guess, lidar_mount=lidar_mount)
    drive = GraphSlam(config, localizer.detector, lidar_mount=lidar_mount)
    start: tuple[Floats, Floats] | None = None
    sure, way, last = 0, 0.0, np.zeros(3)
    for message in messages:
        if isinstance(message, Odometry):
            localizer.push_odometry(message)
            drive.push_odometry(message)
            continue
        here, beside = localizer.push_scan(message), drive.push_scan(message)
        on_scan()
        if not localizer.localized:
            start, sure, way = None, 0, 0.0
            continue
        sure, way, last = sure + 1, way + math.dist(beside.pose[:2], last[:2]), beside.pose
        if sure == SURE:
            back = between_one(beside.pose, np.zeros(3))
            noise = turned(beside.covariance, -beside.pose[2])
            start = compose_one(here.pose, back), moved(here.pose, here.covariance, back, noise)[1]
            way = 0.0
        if sure == SCANS or (sure > SURE and way > WAY):
            break
    return start
