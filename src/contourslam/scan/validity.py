"""Which beams of a scan are measurements."""

import numpy as np
from numpy.typing import NDArray

from contourslam.scan.laser_scan import LaserScan


def valid_beams(scan: LaserScan, max_range: float) -> NDArray[np.bool_]:
    """Mark the beams that hit something: NaN, inf, zero and ranges outside the limits do not.

    Parameters
    ----------
    scan : LaserScan
    max_range : float
        Ranges beyond this are ignored even where the scan's own limit is wider, m.

    Returns
    -------
    ndarray of bool, shape (n,)
    """
    ranges = scan.ranges
    limit = min(scan.range_max, max_range)
    # Comparisons with NaN are false, so NaN needs no test of its own; a range at the limit is "no return" for
    # the many drivers that clamp.
    return (ranges > 0.0) & (ranges >= scan.range_min) & (ranges < limit)
