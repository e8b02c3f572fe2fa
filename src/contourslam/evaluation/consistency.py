"""Does the filter know how wrong it is? NEES, NIS and the share of errors inside the sigma bounds.

Bar-Shalom, Li & Kirubarajan (2001), "Estimation with Applications to Tracking and Navigation", section 5.4: for a
consistent filter the normalised error squared of n coordinates is chi-square distributed with n degrees of freedom.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contourslam.evaluation.extras import require

Floats = NDArray[np.float64]

# Variance below which a coordinate counts as known exactly, m² or rad²: a run starts at a pose it defines to be true.
_EXACT = 1e-15


@dataclass(frozen=True, slots=True)
class AverageNees:
    """NEES averaged over runs with its chi-square bounds.

    Attributes
    ----------
    average : ndarray, shape (t,)
        Average over the runs per step; NaN where no run has a value.
    mean : float
        Mean over steps and runs; ideal is `dof`.
    lower, upper : float
        The average of a consistent filter lies between them with the asked probability, at any one step.
    inside : float
        Share of the steps whose average lies between the bounds.
    dof, runs : int
        Degrees of freedom of one NEES, and number of runs.
    """

    average: Floats
    mean: float
    lower: float
    upper: float
    inside: float
    dof: int
    runs: int


@dataclass(frozen=True, slots=True)
class AverageNis:
    """Normalised innovations squared of one run, per degree of freedom; ideal is 1.

    Attributes
    ----------
    mean : float
        Sum of the NIS over the sum of the degrees of freedom; NaN without a correction.
    lower, upper : float
        The mean of a consistent filter lies between them with the asked probability.
    inside : float
        Share of the steps whose own NIS lies between its own chi-square bounds.
    corrections : int
        Number of steps with a correction.
    """

    mean: float
    lower: float
    upper: float
    inside: float
    corrections: int


def nees(errors: Floats, covariances: Floats) -> Floats:
    """Normalised estimation error squared, eᵀ P⁻¹ e, per step.

    Parameters
    ----------
    errors : ndarray, shape (t, n)
        Estimated minus true value; headings wrapped.
    covariances : ndarray, shape (t, n, n)
        The covariance the filter states.

    Returns
    -------
    ndarray, shape (t,)
        NaN where the covariance is singular (the first pose of a run is known by definition) or anything is not finite.
    """
    result = np.full(len(errors), np.nan)
    finite = np.flatnonzero(np.isfinite(errors).all(axis=1) & np.isfinite(covariances).all(axis=(1, 2)))
    usable = finite[np.linalg.eigvalsh(covariances[finite])[:, 0] > _EXACT]
    e = errors[usable]
    result[usable] = np.einsum("ti,ti->t", e, np.linalg.solve(covariances[usable], e[:, :, None])[:, :, 0])
    return result


def chi_square_bounds(dof: ArrayLike, runs: int = 1, probability: float = 0.95) -> tuple[Floats, Floats]:
    """Two-sided bounds of a chi-square variable averaged over independent runs.

    Parameters
    ----------
    dof : array_like
        Degrees of freedom of one variable.
    runs : int
        How many are averaged.
    probability : float
        Probability between the bounds.

    Returns
    -------
    lower, upper : ndarray, shape of `dof`

    Raises
    ------
    MissingExtraError
        If scipy is not installed.
    """
    # Not scipy.stats, whose import takes longer than to map some thousand scans.
    inverse = require("scipy.special").gammaincinv
    total = np.asarray(dof, dtype=np.float64) * runs
    tail = 0.5 * (1.0 - probability)
    lower, upper = (2.0 * inverse(0.5 * total, part) / runs for part in (tail, 1.0 - tail))
    return np.asarray(lower), np.asarray(upper)


def average_nees(values: Floats, dof: int = 3, probability: float = 0.95) -> AverageNees:
    """Average the NEES over runs and hold it against its bounds.

    Parameters
    ----------
    values : ndarray, shape (runs, t)
        NEES of each run (seed) at the same steps; NaN where undefined. A single run is a vector, shape (t,).
    dof : int
        Coordinates behind one value; 3 for a pose.
    probability : float
        Probability between the bounds.

    Returns
    -------
    AverageNees

    Raises
    ------
    MissingExtraError
        If scipy is not installed.
    """
    values = np.atleast_2d(values)
    known = np.isfinite(values)
    count = known.sum(axis=0)
    average = np.full(values.shape[1], np.nan)
    np.divide(np.where(known, values, 0.0).sum(axis=0), count, out=average, where=count > 0)
    lower, upper = chi_square_bounds(dof, len(values), probability)
    full = average[count == len(values)]  # the bounds hold for an average over all runs only
    return AverageNees(
        average,
        float(values[known].mean()) if known.any() else np.nan,
        float(lower),
        float(upper),
        float(np.mean((full >= lower) & (full <= upper))) if len(full) else np.nan,
        dof,
        len(values),
    )


def inside_sigmas(errors: Floats, covariances: Floats, sigmas: float = 2.0) -> Floats:
    """Share of the errors inside the stated bounds, per coordinate (Fig. 6); ideally 0.954 at two sigma.

    Parameters
    ----------
    errors : ndarray, shape (t, n)
    covariances : ndarray, shape (t, n, n)
    sigmas : float
        Half width of the bounds in standard deviations.

    Returns
    -------
    ndarray, shape (n,)
        NaN without a known error. Steps with a variance of zero (the first pose) are left out.
    """
    variances = np.diagonal(covariances, axis1=1, axis2=2)
    usable = np.isfinite(errors).all(axis=1) & (variances > _EXACT).all(axis=1)
    if not usable.any():
        return np.full(errors.shape[1], np.nan)
    return np.asarray(np.mean(np.abs(errors[usable]) <= sigmas * np.sqrt(variances[usable]), axis=0))


def mean_nis(values: Floats, dof: NDArray[np.int64]) -> float:
    """Mean NIS per degree of freedom, sum over sum; ideally 1, NaN without a correction.

    Parameters
    ----------
    values : ndarray, shape (t,)
        Normalised innovation squared of each correction.
    dof : ndarray of int, shape (t,)
        Its degrees of freedom; steps with 0 (nothing matched) are left out.

    Returns
    -------
    float
    """
    used = (dof > 0) & np.isfinite(values)
    return float(values[used].sum() / dof[used].sum()) if used.any() else np.nan


def average_nis(values: Floats, dof: NDArray[np.int64], probability: float = 0.95) -> AverageNis:
    """Hold the mean NIS of corrections of different size against its bounds.

    Parameters
    ----------
    values, dof
        As :func:`mean_nis`.
    probability : float
        Probability between the bounds.

    Returns
    -------
    AverageNis

    Raises
    ------
    MissingExtraError
        If scipy is not installed.
    """
    used = (dof > 0) & np.isfinite(values)
    nis, degrees = values[used], dof[used]
    if len(nis) == 0:
        return AverageNis(np.nan, np.nan, np.nan, np.nan, 0)
    total = int(degrees.sum())
    lower, upper = chi_square_bounds(total, 1, probability)
    low, high = chi_square_bounds(degrees, 1, probability)
    return AverageNis(
        mean_nis(values, dof),
        float(lower / total),
        float(upper / total),
        float(np.mean((nis >= low) & (nis <= high))),
        len(nis),
    )
