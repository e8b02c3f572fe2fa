"""How bright each picture is against the others, and how much darker the lens is off its axis."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contourslam.scene.choice import SLOTS, Choice
from contourslam.scene.sampling import Samples

Floats = NDArray[np.float64]

_DARK, _BRIGHT = 12.0, 243.0  # values beyond these say nothing of the light
_ROUNDS = 4
_KERNEL = 0.1  # of the Cauchy weights, in logarithms: what disagrees by more hardly counts
_TEXELS = 8  # of a cell's texels that must be seen
_PRIOR_GAIN, _PRIOR_LENS = 0.5, 0.3  # standard deviations of the unknowns, in logarithms
_COMMON = 0.02  # cells: how strongly one cell binds, against the priors


@dataclass(frozen=True, slots=True)
class Exposure:
    """What colours are to be divided by.

    Attributes
    ----------
    gains : ndarray, shape (views, 3)
        Logarithms of each picture's gain in red, green and blue, their mean 0.
    falloff : ndarray, shape (2,)
        Logarithm of the lens' light for the square and the fourth power of the angle, in parts of the greatest.
    disagreement : ndarray, shape (views,)
        How far a picture differs from the others that see the same, robust mean, in logarithms; NaN where none does.
    """

    gains: Floats
    falloff: Floats
    disagreement: Floats

    def factors(self, choice: Choice) -> NDArray[np.float32]:
        """What to multiply the colours of each cell and slot by, shape (cells, SLOTS, 3); 0 where there is no view."""
        square = choice.angles.astype(np.float64) ** 2
        lens = square * self.falloff[0] + square**2 * self.falloff[1]
        logs = -self.gains[choice.views] - lens[..., None]
        return np.where(choice.views[..., None] >= 0, np.exp(logs), 0.0).astype(np.float32)


def trust(exposure: Exposure) -> Floats:
    """How far each picture is to be trusted, in (0, 1]: less where it disagrees much more than pictures usually do."""
    usual = np.nanmedian(exposure.disagreement) if np.isfinite(exposure.disagreement).any() else 0.0
    beyond = np.nan_to_num(exposure.disagreement, nan=usual) / max(float(usual), 0.01)
    return np.asarray(1.0 / (1.0 + np.maximum(beyond - 1.0, 0.0) ** 2))


def solve_exposure(choice: Choice, samples: Samples, views: int) -> Exposure:
    """Find gains and the lens' falloff by which pictures agree best wherever they see the same cells.

    Least squares in the logarithms, each cell's own colour eliminated, outliers weighed down (Cauchy weights).

    Parameters
    ----------
    choice : Choice
    samples : Samples
    views : int
        How many there are.
    """
    logs, angles, numbers, weights = _observations(choice, samples)
    gains, falloff = np.zeros((views, 3)), np.zeros(2)
    robust = weights
    residuals = np.zeros_like(logs)
    for _ in range(_ROUNDS):
        gains, falloff = _solve(logs, angles, numbers, robust, views)
        square = angles**2
        lens = square * falloff[0] + square**2 * falloff[1]
        left = logs - gains[numbers] - lens[..., None]
        mean = (robust[..., None] * left).sum(axis=1) / np.maximum(robust.sum(axis=1), 1e-9)[:, None]
        residuals = left - mean[:, None]
        robust = weights / (1.0 + np.mean(residuals**2, axis=2) / _KERNEL**2)
    size = np.minimum(np.abs(residuals).mean(axis=2), 5.0 * _KERNEL)
    total = np.bincount(numbers.ravel(), weights.ravel(), views)
    summed = np.bincount(numbers.ravel(), (weights * size).ravel(), views)
    with np.errstate(invalid="ignore", divide="ignore"):
        return Exposure(gains, falloff, np.where(total > 0.0, summed / total, np.nan))


def _observations(choice: Choice, samples: Samples) -> tuple[Floats, Floats, NDArray[np.int64], Floats]:
    """Mean colour of each cell in each slot, as logarithms (c, SLOTS, 3), with angles, views and weights (c, SLOTS).

    Only texels that all of a cell's pictures show are compared, so that they compare the same thing.
    """
    seen = samples.weights > 0
    whole = seen.sum(axis=1) >= _TEXELS
    some = whole.sum(axis=1) >= 2
    common = np.all(seen[some] | ~whole[some][:, None, :], axis=2)
    enough = common.sum(axis=1) >= _TEXELS
    some[np.flatnonzero(some)[~enough]] = False
    share = common[enough] / common[enough].sum(axis=1, keepdims=True)
    means = np.einsum("ctsk,ct->csk", samples.colours[some].astype(np.float32), share.astype(np.float32))
    fair = whole[some] & (means.min(axis=2) > _DARK) & (means.max(axis=2) < _BRIGHT)
    scores = np.einsum("cts,ct->cs", samples.weights[some].astype(np.float32), share.astype(np.float32)) / 255.0
    return (
        np.log(np.maximum(means, 1.0)).astype(np.float64),
        choice.angles[some].astype(np.float64),
        np.maximum(choice.views[some], 0).astype(np.int64),
        np.where(fair, scores, 0.0).astype(np.float64),
    )


def _solve(
    logs: Floats, angles: Floats, numbers: NDArray[np.int64], weights: Floats, views: int
) -> tuple[Floats, Floats]:
    """Weighted least squares for gains and falloff; the cells' own colours are eliminated one by one."""
    total = np.maximum(weights.sum(axis=1), 1e-9)
    lens = np.stack([angles**2, angles**4], axis=2)
    centred = logs - ((weights[..., None] * logs).sum(axis=1) / total[:, None])[:, None]
    middle = lens - ((weights[..., None] * lens).sum(axis=1) / total[:, None])[:, None]
    normal, right = np.zeros((views + 2, views + 2)), np.zeros((views + 2, 3))
    for a in range(SLOTS):
        np.add.at(normal, (numbers[:, a], numbers[:, a]), weights[:, a])
        for b in range(SLOTS):
            np.add.at(normal, (numbers[:, a], numbers[:, b]), -weights[:, a] * weights[:, b] / total)
        np.add.at(right, numbers[:, a], weights[:, a, None] * centred[:, a])
        for k in range(2):
            normal[:views, views + k] += np.bincount(numbers[:, a], weights[:, a] * middle[:, a, k], views)
    normal[views:, :views] = normal[:views, views:].T
    normal[views:, views:] = np.einsum("cs,csj,csk->jk", weights, middle, middle)
    right[views:] = np.einsum("cs,csj,csk->jk", weights, middle, centred)
    strength = _COMMON * np.concatenate([np.full(views, _PRIOR_GAIN**-2.0), np.full(2, _PRIOR_LENS**-2.0)])
    # The lens is one for all colours: solve for its falloff on their mean, then for the gains of each.
    both = np.linalg.solve(normal + np.diag(strength), right.mean(axis=1))
    falloff = both[views:]
    gains = np.linalg.solve(
        normal[:views, :views] + np.diag(strength[:views]), right[:views] - (normal[:views, views:] @ falloff)[:, None]
    )
    return gains - gains.mean(axis=0), falloff
