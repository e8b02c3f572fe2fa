"""Whether one thing is better than another over the same drives, and how sure a mean over drives is.

The unit of chance is the seed. In a room it makes one drive; its drives in other rooms have the same errors of the
wheels and the same stream of noise, so they are alike, as are measurements of one drive at other noise or with other
beams. So differences are averaged within each seed before anything is tested. Two tested things are exchangeable on
each seed where neither is better, which is all that the signed-rank test asks for. Holm's correction holds the chance
of any false "better" in a table below the level, however many pairs the table has.

Wilcoxon (1945), "Individual comparisons by ranking methods"; Holm (1979), "A simple sequentially rejective multiple
test procedure"; Efron (1987), "Better bootstrap confidence intervals".
"""

import math
from collections.abc import Hashable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from contourslam.evaluation.extras import require

Floats = NDArray[np.float64]
Verdict = Literal["first better", "second better", "no difference shown", "too few seeds"]

LEVEL = 0.05
"""Chance of any false "better" in a table."""
DRAWS = 5000
"""Of a bootstrap."""
FEWEST = 5
"""Values below which a mean gets no interval: a bootstrap of four knows too little."""
_EXACT = 200  # seeds up to which the distribution of the rank sum is taken exactly


@dataclass(frozen=True, slots=True)
class Interval:
    """Mean over drives, and what it lies between.

    Attributes
    ----------
    mean : float
        NaN without a value.
    low, high : float
        Bias-corrected and accelerated (BCa) bootstrap interval; NaN for fewer than five values.
    count : int
        Values that the mean is over.
    """

    mean: float
    low: float
    high: float
    count: int


@dataclass(frozen=True, slots=True)
class PairedTest:
    """First minus second over the seeds that both were measured with; smaller is better.

    Attributes
    ----------
    median : float
        Median difference, one value a seed; infinite where with most seeds one of the two only failed.
    share : float
        Part of the seeds with which the first is the smaller one; equal ones count half.
    seeds : int
        How many there are.
    p : float
        Two-sided, of the signed-rank test; NaN without a seed.
    corrected : float
        `p` after Holm's correction over the table.
    verdict : str
        "too few seeds" where nothing is shown, and so many seeds could not have shown it alone even if all agreed.
    """

    median: float
    share: float
    seeds: int
    p: float
    corrected: float = math.nan
    verdict: Verdict = "no difference shown"


def mean_interval(values: Floats, *, probability: float = 0.95, draws: int = DRAWS, seed: int = 0) -> Interval:
    """Mean of one value a drive with its BCa bootstrap interval.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Those that are not finite are left out.
    probability : float
        Of the interval. With 20 drives it holds the true mean a little less often, the more so the more skewed the
        values are; ``tests/evaluation/test_paired_tests.py`` measures how often.
    draws : int
    seed : int
        The same seed gives the same interval.

    Returns
    -------
    Interval

    Raises
    ------
    MissingExtraError
        If SciPy is not installed.
    """
    known = values[np.isfinite(values)]
    n = len(known)
    if n == 0:
        return Interval(math.nan, math.nan, math.nan, 0)
    mean = float(known.mean())
    if n < FEWEST:
        return Interval(mean, math.nan, math.nan, n)
    if np.ptp(known) == 0.0:  # nothing to draw from
        return Interval(mean, mean, mean, n)
    found = require("scipy.stats").bootstrap(
        (known,),
        np.mean,
        vectorized=True,
        method="BCa",
        n_resamples=draws,
        confidence_level=probability,
        random_state=np.random.default_rng(seed),
    )
    low, high = (float(bound) for bound in found.confidence_interval)
    return Interval(mean, low, high, n)


def by_seed(seeds: Sequence[Hashable], first: Floats, second: Floats) -> Floats:
    """Mean difference of each seed, in the order in which the seeds first come.

    Parameters
    ----------
    seeds : sequence, length n
        Which seed each pair was measured with.
    first, second : ndarray, shape (n,)
        Costs. NaN is not known, and leaves the pair out; infinity is a failed run, which loses against any that was
        finished, and drops out where both failed.

    Returns
    -------
    ndarray, shape (d,)
        A seed without any pair that is known is left out. One with which each of the two failed somewhere is left out,
        too: it does not say which is the better one.
    """
    sums: dict[Hashable, list[float]] = {}
    with np.errstate(invalid="ignore"):
        for seed, difference in zip(seeds, (first - second).tolist(), strict=True):
            if not math.isnan(difference):
                sums.setdefault(seed, []).append(difference)
    means = np.array(
        [math.nan if {math.inf, -math.inf} <= set(one) else math.fsum(one) / len(one) for one in sums.values()]
    )
    return means[~np.isnan(means)] if len(means) else np.empty(0)


def signed_rank(differences: Floats) -> PairedTest:
    """Test whether one of two things is better, by the Wilcoxon signed-rank test, without correction.

    Seeds with which both are equal say nothing and are dropped from the ranks, as Wilcoxon did. For up to 200 seeds the
    test is exact, also where some are tied, as those are with which one of the two failed; above, it is approximated.

    Parameters
    ----------
    differences : ndarray, shape (d,)
        One a seed (:func:`by_seed`).

    Returns
    -------
    PairedTest

    Raises
    ------
    MissingExtraError
        If SciPy is not installed.
    """
    n = len(differences)
    if n == 0:
        return PairedTest(math.nan, math.nan, 0, math.nan)
    share = float(np.mean(differences < 0.0) + 0.5 * np.mean(differences == 0.0))
    left = differences[differences != 0.0]
    return PairedTest(_median(differences), share, n, _p_value(left) if len(left) else 1.0)


def holm(p: Sequence[float]) -> list[float]:
    """Correct p-values for their number (Holm 1979); NaN stays, and does not count."""
    values = np.asarray(p, dtype=np.float64)
    corrected = np.full(len(values), math.nan)
    known = np.flatnonzero(~np.isnan(values))
    order = known[np.argsort(values[known], kind="stable")]
    factors = len(order) - np.arange(len(order))
    corrected[order] = np.minimum(np.maximum.accumulate(factors * values[order]), 1.0)
    return corrected.tolist()


def judged(tests: Sequence[PairedTest], *, level: float = LEVEL) -> list[PairedTest]:
    """Correct the tests of one table for their number, and say of each what it shows.

    Parameters
    ----------
    tests : sequence of PairedTest
        All pairs of the table.
    level : float
        Chance of any false "better" in it.

    Returns
    -------
    list of PairedTest
        In the same order. "Better" needs more than half of the seeds to agree, too.
    """
    corrected = holm([test.p for test in tests])
    tested = sum(not math.isnan(test.p) for test in tests)
    return [
        replace(test, corrected=p, verdict=_verdict(test, p, level, tested))
        for test, p in zip(tests, corrected, strict=True)
    ]


def _verdict(test: PairedTest, corrected: float, level: float, tested: int) -> Verdict:
    if corrected <= level:
        if test.share > 0.5 and test.median < 0.0:
            return "first better"
        if test.share < 0.5 and test.median > 0.0:
            return "second better"
        return "no difference shown"
    return "too few seeds" if 2.0 ** (1 - test.seeds) * max(tested, 1) > level else "no difference shown"


def _median(differences: Floats) -> float:
    middle = np.sort(differences)[(len(differences) - 1) // 2 : len(differences) // 2 + 1]
    return 0.0 if {math.inf, -math.inf} <= set(middle.tolist()) else float(middle.mean())


def _p_value(differences: Floats) -> float:
    """Two-sided p of the sum of the ranks of one sign.

    The distribution over all signs is built up rank by rank, which is exact where ranks are tied, too; SciPy's own is
    exact only where none are. Ranks are doubled, so that tied ones are whole.
    """
    stats = require("scipy.stats")
    if len(differences) > _EXACT:
        return float(stats.wilcoxon(differences, method="asymptotic", correction=True).pvalue)
    ranks = np.rint(2.0 * stats.rankdata(np.abs(differences))).astype(np.int64)
    chance = np.zeros(int(ranks.sum()) + 1)
    chance[0] = 1.0
    for rank in ranks.tolist():
        chance[rank:] = 0.5 * (chance[rank:] + chance[:-rank])
        chance[:rank] *= 0.5
    positive = int(ranks[differences > 0.0].sum())
    return min(1.0, 2.0 * float(chance[: min(positive, len(chance) - 1 - positive) + 1].sum()))
