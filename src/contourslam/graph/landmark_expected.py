"""Which landmarks of the graph a scan should have shown: the filter's own rule, asked with the graph's rows."""

import numpy as np
from numpy.typing import NDArray

from contourslam.config import Config
from contourslam.contour.contours import Floats, Ints
from contourslam.graph.sightings import CONVEX, DIRECTION, END, KIND, OPENING, START, X, Y
from contourslam.kernels import kernel
from contourslam.scan import LaserScan
from contourslam.slam import measurement
from contourslam.slam.measurement import CORNER
from contourslam.slam.visibility import by_angle, expected_in_scan


@kernel
def _for_visibility(table: Floats, rows: Ints) -> tuple[Floats, Floats]:
    """These landmarks as :func:`expected_in_scan` takes them."""
    mean, out = np.zeros(3 + 2 * rows.size), np.zeros((rows.size, measurement.COLUMNS))
    for k in range(rows.size):
        row = table[rows[k]]
        out[k, measurement.KIND], out[k, measurement.DIRECTION] = row[KIND], row[DIRECTION]
        out[k, measurement.OPENING], out[k, measurement.CONVEX] = row[OPENING], row[CONVEX]
        out[k, measurement.START], out[k, measurement.END] = row[START], row[END]
        if row[KIND] == CORNER:
            mean[3 + 2 * k], mean[4 + 2 * k] = row[X], row[Y]
        else:
            mean[3 + 2 * k] = row[DIRECTION]
            out[k, measurement.ANCHOR_X], out[k, measurement.ANCHOR_Y] = row[X], row[Y]
    return mean, out


def expected(table: Floats, rows: Ints, scan: LaserScan, lidar: Floats, config: Config) -> NDArray[np.bool_]:
    """Mark the landmarks that should be found in a scan.

    Parameters
    ----------
    table : ndarray, shape (n, COLUMNS)
        Landmarks in the world.
    rows : ndarray of int, shape (k,)
        Those that are asked about.
    scan : LaserScan
    lidar : ndarray, shape (3,)
        ``T_world_lidar``.
    config : Config

    Returns
    -------
    ndarray of bool, shape (k,)
    """
    least, (mean, looks) = config.landmarks, _for_visibility(table, rows)
    return expected_in_scan(
        mean, looks, len(rows), lidar, *by_angle(scan), min(config.lidar.max_range, scan.range_max), least.min_side,
        least.min_side_points, least.min_wall, least.min_wall_points,
    )  # fmt: skip
