"""The contract that every landmark detector keeps."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from contourslam.contour import Contours

Floats = NDArray[np.float64]


class Detector(Protocol):
    """Says how much each point of a contour looks like a corner; suppression and refinement are shared.

    Attributes
    ----------
    equalized : bool
        Whether the detector works on equalized contours; else it gets the raw points of the scan.
    threshold : float
        Responses below it are no corner.
    """

    @property
    def equalized(self) -> bool:
        """See above."""
        ...

    @property
    def threshold(self) -> float:
        """See above."""
        ...

    def respond(self, contours: Contours) -> Floats:
        """Response of each contour point.

        Parameters
        ----------
        contours : Contours
            m points in c contours.

        Returns
        -------
        ndarray, shape (m,)
            Dimensionless, larger for a clearer corner, 0 on a straight wall and where a contour ends.
        """
        ...

    def reach(self, contours: Contours) -> int:
        """Points to either side within which only the largest response stays a candidate."""
        ...
