"""What is kept of each scan so that it can be drawn at any later time, as it was known then."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contourslam.contour.contours import Contours, Floats
from contourslam.geometry.poses import compose_one
from contourslam.slam.look import Look
from contourslam.slam.result import ScanUpdate

Floats32 = NDArray[np.float32]
BYTES_BESIDE = 1500  # what a moment of one detector takes beside its arrays


@dataclass(frozen=True, slots=True)
class Trace:
    """Contours of a scan in half the space, in the lidar's frame.

    Attributes
    ----------
    points : ndarray of float32, shape (m, 2)
    starts : ndarray of int32, shape (c + 1,)
    closed : ndarray of bool, shape (c,)
    """

    points: Floats32
    starts: NDArray[np.int32]
    closed: NDArray[np.bool_]

    def contours(self) -> Contours:
        """Give them as the detectors take them."""
        points = self.points.astype(np.float64)
        return Contours(points, self.starts.astype(np.int64), self.closed, 0.0, np.arange(len(points), dtype=float))


def trace_of(contours: Contours) -> Trace:
    """Keep raw contours."""
    return Trace(contours.points.astype(np.float32), contours.starts.astype(np.int32), contours.closed)


@dataclass(frozen=True, slots=True)
class Sighting:
    """What a look at the landmarks gave.

    Attributes
    ----------
    stamp : float
        Of its scan, s.
    corners : int
        How many of the rows are corners; the others are walls.
    ids : ndarray of int32, shape (n,)
        Landmark of each, -1 for none.
    points : ndarray of float32, shape (n, 2)
        Where it was seen, a wall by its middle, in the world, m.
    innovations : ndarray of float32, shape (n, 2)
        Of corners, m; see :class:`contourslam.slam.look.Look`.
    """

    stamp: float
    corners: int
    ids: NDArray[np.int32]
    points: Floats32
    innovations: Floats32


def sighting_of(look: Look, pose: Floats, mount: Floats) -> Sighting:
    """Keep what a look gave; `pose` is that of the base at its scan."""
    seen = look.detection
    ends = seen.walls.end_points
    points = np.concatenate([seen.corners.positions, 0.5 * (ends[:, 0] + ends[:, 1])])
    x, y, heading = compose_one(pose, mount).tolist()
    c, s = math.cos(heading), math.sin(heading)
    return Sighting(
        look.stamp,
        len(seen.corners),
        look.ids.astype(np.int32),
        (points @ np.array([[c, s], [-s, c]]) + (x, y)).astype(np.float32),
        look.innovations.astype(np.float32),
    )


@dataclass(frozen=True, slots=True)
class LaneMoment:
    """What one back end with one detector said of a scan.

    Attributes
    ----------
    update : ScanUpdate
    sighting : Sighting or None
        The newest until then.
    stages : tuple of (str, float)
        CPU time per scan of each stage of late, ms.
    localized : bool
        Whether it knows where the robot is; else the pose is no more than a guess.
    """

    update: ScanUpdate
    sighting: Sighting | None
    stages: tuple[tuple[str, float], ...]
    localized: bool = True


@dataclass(frozen=True, slots=True)
class Moment:
    """One scan.

    Attributes
    ----------
    index : int
        Number of the scan, from 0.
    elapsed : float
        s, of a recording since its first scan, of a robot since it began to be followed; never less than that of the
        scan before, whatever the stamps are.
    made : float
        When it was done, on the clock of ``time.monotonic``, s.
    trace : Trace
    odometry : ndarray, shape (3,)
        Raw odometry, moved so that it starts where the estimate starts.
    truth : ndarray, shape (3,), or None
    lanes : tuple of LaneMoment
    """

    index: int
    elapsed: float
    made: float
    trace: Trace
    odometry: Floats
    truth: Floats | None
    lanes: tuple[LaneMoment, ...]

    @property
    def bytes(self) -> int:
        """About how much memory it takes; sightings are shared by several."""
        return self.trace.points.nbytes + BYTES_BESIDE * len(self.lanes)
