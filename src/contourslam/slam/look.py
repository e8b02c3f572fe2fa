"""What a back end made of the landmarks in one scan, for those who watch; it keeps the newest one."""

from dataclasses import dataclass

from contourslam.contour.contours import Floats, Ints
from contourslam.landmarks import Detection


@dataclass(frozen=True, slots=True)
class Look:
    """Corners and walls seen in one scan, and the landmarks that they were taken for.

    Attributes
    ----------
    stamp : float
        Of the scan, s.
    detection : Detection
        In the lidar's frame.
    ids : ndarray of int, shape (n,)
        Landmark of each corner and then of each wall of the detection, -1 where it has none.
    innovations : ndarray, shape (n, 2)
        From where the map had a corner to where it was seen, before any correction, world axes, m; a wall's, and that
        of what has no landmark, tells nothing.
    """

    stamp: float
    detection: Detection
    ids: Ints
    innovations: Floats
