"""What every back end is to those who feed it."""

from dataclasses import dataclass
from typing import Protocol

from contourslam.contour.contours import Floats
from contourslam.scan import LaserScan, Odometry
from contourslam.slam.landmark_map import CornerMap, WallMap
from contourslam.slam.result import Loop, ScanUpdate


@dataclass(frozen=True, slots=True)
class Finished:
    """What a back end knows of the whole drive once the last scan is in.

    Attributes
    ----------
    poses : ndarray, shape (t, 3)
        Base in the world at each scan, as it is seen now: m, m, rad.
    covariances : ndarray, shape (t, 3, 3)
    loops : tuple of Loop
    """

    poses: Floats
    covariances: Floats
    loops: tuple[Loop, ...]


class Mapper(Protocol):
    """Odometry and scans go in, poses and a map of corners and walls come out."""

    @property
    def start_pose(self) -> Floats:
        """Base in the world where it started, shape (3,)."""

    @property
    def odometry_pose(self) -> Floats:
        """Raw odometry at the stamp of the last scan (``T_odom_base``), shape (3,); zeros before the first reading."""

    def push_odometry(self, odometry: Odometry) -> None:
        """Take in one odometry reading."""

    def push_scan(self, scan: LaserScan) -> ScanUpdate:
        """Take in one scan; the odometry up to its last beam should have come before."""

    def corner_map(self) -> CornerMap:
        """Corners of the map as they stand now."""

    def wall_map(self) -> WallMap:
        """Walls of the map as they stand now."""

    def finish(self) -> Finished | None:
        """Revise the whole drive, where the back end can; None where the poses stay what they were at the time."""
