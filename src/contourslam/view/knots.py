"""Points along the way, each with a glimpse of the walls around it: of them the page draws paths and the building."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contourslam.contour.contours import Floats
from contourslam.geometry.poses import between_one, transform
from contourslam.view.moment import Moment

WAY, TURN = 0.25, math.radians(12.0)  # m and rad between two
INK = 220  # contour points kept of each, at most
UNIT = 0.002  # m; a point is kept as two integers of 16 bits, up to 65 m away
LANE_COLUMNS = 6  # x, y, heading; standard deviation, m; NIS by degrees of freedom; quality


@dataclass(frozen=True, slots=True)
class Knot:
    """One of them.

    Attributes
    ----------
    index : int
        Number of its scan.
    row : ndarray of float32, shape (7,)
        Elapsed time, s; raw odometry; true pose, NaN where it is not known.
    lanes : ndarray of float32, shape (l, LANE_COLUMNS)
        As known at the time.
    ink : ndarray of int16, shape (n, 2)
        Contour points in the frame of the base, in units of `UNIT`.
    """

    index: int
    row: NDArray[np.float32]
    lanes: NDArray[np.float32]
    ink: NDArray[np.int16]


class Knotter:
    """Says which scans become knots; changed in place by each.

    Parameters
    ----------
    mount : ndarray, shape (3,)
        ``T_base_lidar``.
    """

    def __init__(self, mount: Floats) -> None:
        self._mount = mount
        self._last: Floats | None = None
        self._nis = self._dof = 0.0
        self.spacing = 1.0

    def take(self, moment: Moment) -> Knot | None:
        """Give the knot that a scan makes, or None where it is too near to the one before."""
        pose = moment.lanes[0].update.pose
        if self._last is not None:
            step = between_one(self._last, pose)
            if math.hypot(step[0], step[1]) < WAY * self.spacing and abs(step[2]) < TURN * self.spacing:
                return None
        self._last = np.array(pose)
        return self._knot(moment)

    def _knot(self, moment: Moment) -> Knot:
        truth = np.full(3, np.nan) if moment.truth is None else moment.truth
        row = np.concatenate([[moment.elapsed], moment.odometry, truth]).astype(np.float32)
        lanes = np.empty((len(moment.lanes), LANE_COLUMNS), np.float32)
        for values, lane in zip(lanes, moment.lanes, strict=True):
            u = lane.update
            sigma = math.sqrt(max(u.covariance[0, 0] + u.covariance[1, 1], 0.0))
            values[:] = *u.pose, sigma, u.nis / u.nis_dof if u.nis_dof else np.nan, np.nan
            if u.quality is not None:
                values[5] = u.quality
        points = moment.trace.points
        some = points[:: -(-len(points) // INK) or 1].astype(np.float64)
        ink = transform(self._mount, some) / UNIT
        ink = ink[(np.abs(ink) < 32767.0).all(axis=1)]
        return Knot(moment.index, row, lanes, np.rint(ink).astype(np.int16))
