"""Corners and walls of one scan as the constellation that is looked for in a map."""

import numpy as np

from contourslam.contour.contours import Floats
from contourslam.geometry.angles import wrap
from contourslam.geometry.poses import transform
from contourslam.landmarks import Corners, Walls
from contourslam.matching.constellation import Constellation


def constellation_of(corners: Corners, walls: Walls, lidar: Floats) -> Constellation:
    """Give the landmarks of a scan in the frame of the base.

    Parameters
    ----------
    corners : Corners
    walls : Walls
        Both in the lidar's frame.
    lidar : ndarray, shape (3,)
        ``T_base_lidar``: m, m, rad.
    """
    mount = np.asarray(lidar, np.float64)
    return Constellation(
        transform(mount, corners.positions),
        wrap(corners.directions + mount[2]),
        corners.openings,
        corners.convex,
        wrap(walls.lines[:, 0] + mount[2]),
        transform(mount, walls.end_points),
    )
