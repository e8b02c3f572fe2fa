"""The occupancy grid of a finished run: its scans, read a second time, placed at the poses the filter gave them."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from contourslam.geometry.angles import wrap
from contourslam.geometry.poses import compose, interpolate
from contourslam.report.occupancy import OccupancyGrid
from contourslam.scan import LaserScan
from contourslam.slam.result import RunResult

Floats = NDArray[np.float64]


def run_grid(
    messages: Iterable[object],
    result: RunResult,
    *,
    lidar_mount: Floats,
    resolution: float = 0.05,
    max_range: float = 30.0,
    min_distance: float = 0.1,
    min_turn: float = 0.1,
) -> OccupancyGrid:
    """Build the occupancy grid of a run.

    Parameters
    ----------
    messages : iterable
        The recording's messages, read as a stream; all but the scans are passed over.
    result : RunResult
        Poses by stamp; a scan without a pose is passed over.
    lidar_mount : ndarray, shape (3,)
        Pose of the lidar in the base frame.
    resolution : float
        Side of a cell, m.
    max_range : float
        Beams longer than this are ignored, m.
    min_distance, min_turn : float
        A scan is used once the robot has moved this far (m) or turned this much (rad) since the last one used.

    Returns
    -------
    OccupancyGrid

    Raises
    ------
    ResultError
        If the trajectory spans an absurd area.
    """
    grid = OccupancyGrid(resolution)
    rows = {float(stamp): row for row, stamp in enumerate(result.stamps)}
    last: Floats | None = None
    for message in messages:
        row = rows.get(message.stamp) if isinstance(message, LaserScan) else None
        if row is None or not isinstance(message, LaserScan):
            continue
        pose = result.poses[row]
        if last is not None:
            moved, turned = np.hypot(*(pose - last)[:2]), abs(float(wrap(pose[2:] - last[2])[0]))
            if moved < min_distance and turned < min_turn:
                continue
        last = pose
        grid.add(*_beams(message, result, row, lidar_mount, max_range))
    return grid


def _beams(
    scan: LaserScan, result: RunResult, row: int, lidar_mount: Floats, max_range: float
) -> tuple[Floats, Floats]:
    """Origin and end of every beam that returned, in the world frame, each at the pose of its own time."""
    ranges = scan.ranges
    valid = (ranges > max(scan.range_min, 0.0)) & (ranges <= min(scan.range_max, max_range))  # false for NaN and inf
    following = slice(row, row + 2)
    if row + 1 < len(result.stamps) and result.stamps[row] < result.stamps[row + 1]:
        bases = interpolate(result.stamps[following], result.poses[following], scan.stamp + scan.offsets[valid])
    else:
        bases = result.poses[row][None].repeat(int(valid.sum()), axis=0)
    lidars = compose(bases, lidar_mount)
    directions = lidars[:, 2] + scan.angles[valid]
    origins = lidars[:, :2]
    return origins, origins + ranges[valid, None] * np.stack([np.cos(directions), np.sin(directions)], axis=-1)
