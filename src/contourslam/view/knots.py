"""Points along the way, each with a glimpse of the walls around it: of them the page draws paths and the building."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contourslam.contour.contours import Floats
from contourslam.slam.result import ScanUpdate
from contourslam.view.moment import Moment

WAY, TURN = 0.25, math.radians(12.0)  # m and rad between two
INK = 220  # contour points kept of each, at most
UNIT = 0.002  # m; a point is kept as two integers of 16 bits, up to 65 m away
FARTHEST = 32767.0  # units
LANE_COLUMNS = 7  # x, y, heading; standard deviation, m; NIS by degrees of freedom; quality; degrees of freedom
UNKNOWN = (math.nan,) * 3


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
        x, y, a = mount.tolist()
        c, s = math.cos(a), math.sin(a)
        self._turn = np.array([[c, s], [-s, c]], dtype=np.float32) / np.float32(UNIT)  # rows on the left of it
        self._shift = np.array([x, y], dtype=np.float32) / np.float32(UNIT)
        self._last: list[float] | None = None
        self.spacing = 1.0

    def take(self, moment: Moment) -> Knot | None:
        """Give the knot that a scan makes, or None where it is too near to the one before."""
        pose = moment.lanes[0].update.pose.tolist()
        if self._last is not None:
            x, y, heading = self._last
            if math.hypot(pose[0] - x, pose[1] - y) < WAY * self.spacing:
                turned = abs(math.remainder(pose[2] - heading, math.tau))
                if turned < TURN * self.spacing:
                    return None
        self._last = pose
        return self._knot(moment)

    def _knot(self, moment: Moment) -> Knot:
        truth = UNKNOWN if moment.truth is None else moment.truth.tolist()
        row = np.array([moment.elapsed, *moment.odometry.tolist(), *truth], dtype=np.float32)
        lanes = np.array([_columns(lane.update) for lane in moment.lanes], dtype=np.float32)
        points = moment.trace.points
        ink = points[:: -(-len(points) // INK) or 1] @ self._turn + self._shift
        if len(ink) and not -FARTHEST < ink.min() <= ink.max() < FARTHEST:
            ink = ink[(np.abs(ink) < FARTHEST).all(axis=1)]
        return Knot(moment.index, row, lanes, np.rint(ink).astype(np.int16))


def _columns(update: ScanUpdate) -> list[float]:
    """One lane's numbers."""
    sigma = math.sqrt(max(update.covariance[0, 0] + update.covariance[1, 1], 0.0))
    nis = update.nis / update.nis_dof if update.nis_dof else math.nan
    quality = math.nan if update.quality is None else update.quality
    return [*update.pose.tolist(), sigma, nis, quality, update.nis_dof]
