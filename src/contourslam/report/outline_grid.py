"""The occupancy grid of a map that is kept or being made: its keyframes' contours, seen from where the lidar was."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from contourslam.geometry.poses import compose, transform
from contourslam.report.occupancy import OccupancyGrid

Floats = NDArray[np.float64]


def outline_grid(
    poses: Floats, points: Iterable[NDArray[np.float32]], *, lidar_mount: Floats, resolution: float = 0.05
) -> OccupancyGrid:
    """Draw keyframes into a grid.

    Beams that hit nothing, or too little to be a contour, are in no keyframe: what they show as free stays unknown.

    Parameters
    ----------
    poses : ndarray, shape (k, 3)
        Base in the map: m, m, rad.
    points : iterable of ndarray, shape (n, 2 or more)
        Contour points of each keyframe in the frame of the base, m; further columns are passed over.
    lidar_mount : ndarray, shape (3,)
        Pose of the lidar in the base frame.
    resolution : float
        Side of a cell, m.

    Returns
    -------
    OccupancyGrid

    Raises
    ------
    ResultError
        If the keyframes span an absurd area.
    """
    grid = OccupancyGrid(resolution)
    for pose, seen in zip(poses, points, strict=True):
        world = transform(pose, seen[:, :2].astype(np.float64))
        grid.add(np.broadcast_to(compose(pose, lidar_mount)[:2], world.shape), world)
    return grid
