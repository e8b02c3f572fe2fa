"""What one scan gave in live use, and the map between two."""

from collections.abc import Mapping
from dataclasses import dataclass

from contourslam.contour.contours import Floats
from contourslam.live.events import Incident
from contourslam.scan import LaserScan
from contourslam.slam.landmark_map import CornerMap, WallMap
from contourslam.slam.result import ScanUpdate


@dataclass(frozen=True, slots=True)
class Processed:
    """What one scan gave.

    Attributes
    ----------
    stamp : float
        Of the scan, s; the poses are those at this time.
    T_map_base : ndarray, shape (3,)
        m, m, rad.
    covariance : ndarray, shape (3, 3)
        Its covariance, in the axes of the map.
    T_odom_base : ndarray, shape (3,)
        Raw odometry at the stamp; zeros where none has ever come.
    T_map_odom : ndarray, shape (3,)
        The correction as it is: ``T_map_base = T_map_odom @ T_odom_base``.
    T_map_odom_smooth : ndarray, shape (3,)
        The correction to be published, see :class:`contourslam.live.smoothing.Smoother`.
    localized : bool
        False while the robot has not been found in a known map: the pose is then no more than a guess.
    update : ScanUpdate
        All that the mapper said.
    map_version : int
        Greater than before where the map may have changed.
    incidents : tuple of Incident
        What was dropped, or had no odometry, since the scan before; this scan's own lack among them.
    scan : LaserScan
    latency : float
        From the scan's coming to its pose, on the caller's clock, s.
    seconds : mapping
        CPU time of each stage of the mapping, s.
    """

    stamp: float
    T_map_base: Floats
    covariance: Floats
    T_odom_base: Floats
    T_map_odom: Floats
    T_map_odom_smooth: Floats
    localized: bool
    update: ScanUpdate
    map_version: int
    incidents: tuple[Incident, ...]
    scan: LaserScan
    latency: float
    seconds: Mapping[str, float]


@dataclass(frozen=True, slots=True)
class Drawn:
    """A map of landmarks as it stood at one moment.

    Attributes
    ----------
    version : int
        That of the session at that moment.
    corners : CornerMap
    walls : WallMap
    """

    version: int
    corners: CornerMap
    walls: WallMap
