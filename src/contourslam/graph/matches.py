"""What an alignment is worth to the graph."""

import numpy as np

from contourslam.contour.contours import Floats
from contourslam.matching.odometry import FLOOR
from contourslam.matching.small import invert, turned

# A match leaves this much open where the contours say nothing (m, m, rad), so that its covariance is finite.
OPEN = np.diag([1.0 / 10.0**2, 1.0 / 10.0**2, 1.0 / 1.0**2])
ROBUST_TIES = 3.0  # width of the Cauchy kernel of a tie to a place seen before, in standard deviations


def match_information(information: Floats, heading: float) -> Floats:
    """Information of an alignment in the frame of what was aligned, with what a match never knows better than.

    Parameters
    ----------
    information : ndarray, shape (3, 3)
        Of the contours, in the axes of what it was aligned to.
    heading : float
        Of what was aligned, in those axes, rad.
    """
    return invert(invert(turned(information, -heading) + OPEN) + FLOOR)
