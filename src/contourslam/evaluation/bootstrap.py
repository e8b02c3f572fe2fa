"""How sure a difference between two runs of one recording is: a paired bootstrap over blocks.

Errors close to each other in a drive are alike, so whole blocks of neighbours are drawn, and the drive is closed to a
ring so that each error is drawn equally often: Politis & Romano (1992), "A circular block-resampling procedure for
stationary data".
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_FEWEST = 100  # pairs: ten blocks of ten


@dataclass(frozen=True, slots=True)
class PairedDifference:
    """First minus second, pair by pair.

    Attributes
    ----------
    mean : float
        NaN without a pair.
    low, high : float
        The mean lies between them with the asked probability, as far as the drive stands for others like it; NaN for
        fewer than 100 pairs, whose blocks are too few to tell.
    share : float
        Part of the pairs in which the first is the smaller one; equal ones count half.
    count, block : int
        Pairs, and how many neighbours were drawn together.
    """

    mean: float
    low: float
    high: float
    share: float
    count: int
    block: int


def paired_difference(
    first: Floats, second: Floats, *, draws: int = 2000, seed: int = 0, probability: float = 0.95
) -> PairedDifference:
    """Mean difference of two series of errors, with its percentile interval.

    Parameters
    ----------
    first, second : ndarray, shape (n,)
        Errors of the same things, in the order of the drive; pairs that are not finite are left out.
    draws : int
        How many drives are put together from blocks of this one.
    seed : int
        The same seed gives the same interval.
    probability : float
        Of the interval.

    Returns
    -------
    PairedDifference

    Raises
    ------
    ValueError
        If the series differ in length.
    """
    if first.shape != second.shape:
        raise ValueError(f"the errors must be pairs, got {first.shape} and {second.shape}")
    differences = first - second
    differences = differences[np.isfinite(differences)]
    n = len(differences)
    if n == 0:
        return PairedDifference(math.nan, math.nan, math.nan, math.nan, 0, 0)
    mean = float(differences.mean())
    smaller = float(np.mean(differences < 0.0) + 0.5 * np.mean(differences == 0.0))
    block = math.ceil(math.sqrt(n))
    if n < _FEWEST:
        return PairedDifference(mean, math.nan, math.nan, smaller, n, block)
    ring = np.concatenate([[0.0], np.cumsum(np.concatenate([differences, differences[:block]]))])
    begins = np.random.default_rng(seed).integers(0, n, (draws, math.ceil(n / block)))
    means = (ring[begins + block] - ring[begins]).mean(axis=1) / block
    tail = 0.5 * (1.0 - probability)
    low, high = np.quantile(means, (tail, 1.0 - tail)).tolist()
    return PairedDifference(mean, low, high, smaller, n, block)
