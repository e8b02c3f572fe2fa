"""How often the detector missed a landmark it should have seen (Fig. 7)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contourslam.slam.landmark_map import CornerMap, WallMap

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class FalseNegatives:
    """Record of every landmark of a map, in the map's order.

    Attributes
    ----------
    ids : ndarray of int, shape (n,)
    observed, failed : ndarray of int, shape (n,)
        How often it was seen (o), and how often it should have been but was not (f).
    rates : ndarray, shape (n,)
        f/(f+o); NaN where there was no chance to see it.
    """

    ids: NDArray[np.int64]
    observed: NDArray[np.int64]
    failed: NDArray[np.int64]
    rates: Floats

    @property
    def count(self) -> int:
        """Number of landmarks."""
        return len(self.ids)

    @property
    def median(self) -> float:
        """Median of the rates over the landmarks; NaN for an empty map."""
        known = self.rates[np.isfinite(self.rates)]
        return float(np.median(known)) if len(known) else np.nan

    @property
    def mean(self) -> float:
        """Mean of the rates, each weighted by its chances: sum f over sum (f + o); NaN for an empty map."""
        chances = int(self.observed.sum() + self.failed.sum())
        return float(self.failed.sum() / chances) if chances else np.nan


def false_negatives(landmarks: CornerMap | WallMap) -> FalseNegatives:
    """Per-landmark false-negative rate, f/(f+o).

    Parameters
    ----------
    landmarks : CornerMap or WallMap
        The final map of a run.

    Returns
    -------
    FalseNegatives
    """
    chances = landmarks.observed + landmarks.failed
    rates = np.full(len(chances), np.nan)
    np.divide(landmarks.failed, chances, out=rates, where=chances > 0)
    return FalseNegatives(landmarks.ids, landmarks.observed, landmarks.failed, rates)
