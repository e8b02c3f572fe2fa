"""Lens and board places fitted to corners seen, all at once.

The unknowns of a board's place meet only those of the lens, so each step eliminates them (Schur's complement): its cost
grows with the number of pictures and no faster.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from contourslam.geometry.rigid import rotation_from_vector

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

NAMES = ("xi", "fx", "fy", "skew", "cx", "cy", "k1", "k2", "p1", "p2")
"""The lens' parameters in the order of the vector that stands for them."""

_LARGE, _SMALL = 1e12, 1e-12


@dataclass(frozen=True)
class Bundle:
    """A lens and the places of boards.

    Attributes
    ----------
    lens : ndarray, shape (10,)
        See `NAMES`.
    turns : ndarray, shape (views, 3, 3)
    places : ndarray, shape (views, 3)
        ``T_camera_board`` of each view, m.
    """

    lens: Floats
    turns: Floats
    places: Floats


@dataclass(frozen=True)
class Fit:
    """A fitted bundle.

    Attributes
    ----------
    bundle : Bundle
    residuals : ndarray, shape (views, corners, 2)
        Seen less expected, pixels.
    lens_information : ndarray, shape (10, 10)
        Inverse covariance of the lens' parameters for a corner's standard deviation of one pixel, the places of the
        boards being unknown.
    place_information : ndarray, shape (views, 6, 6)
        The same of each board's small turn (rad, about its own origin) and move (m), along and about the camera's axes,
        the lens being known.
    """

    bundle: Bundle
    residuals: Floats
    lens_information: Floats
    place_information: Floats

    @property
    def rms(self) -> float:
        """Root mean square distance of a corner from where it is expected, pixels."""
        return float(np.sqrt((self.residuals**2).sum(axis=-1).mean()))


def project(lens: Floats, points: Floats) -> tuple[Floats, Floats, Floats]:
    """Project points of the camera frame, with the derivatives.

    Parameters
    ----------
    lens : ndarray, shape (10,)
    points : ndarray, shape (..., 3)

    Returns
    -------
    pixels : ndarray, shape (..., 2)
        NaN where the model has none.
    by_lens : ndarray, shape (..., 2, 10)
    by_point : ndarray, shape (..., 2, 3)
    """
    xi, fx, fy, skew, cx, cy, k1, k2, p1, p2 = lens
    length = np.linalg.norm(points, axis=-1)
    depth = points[..., 2] + xi * length
    depth = np.where(depth > 1e-3 * length, depth, np.nan)
    u, v = points[..., 0] / depth, points[..., 1] / depth
    square = u * u + v * v
    radial, slope = 1.0 + square * (k1 + k2 * square), 2.0 * k1 + 4.0 * k2 * square
    x = u * radial + 2.0 * p1 * u * v + p2 * (square + 2.0 * u * u)
    y = v * radial + p1 * (square + 2.0 * v * v) + 2.0 * p2 * u * v
    across = slope * u * v + 2.0 * (p1 * u + p2 * v)
    bend = np.stack(
        [
            np.stack([radial + slope * u * u + 2.0 * p1 * v + 6.0 * p2 * u, across], axis=-1),
            np.stack([across, radial + slope * v * v + 6.0 * p1 * v + 2.0 * p2 * u], axis=-1),
        ],
        axis=-2,
    )
    scale = np.array([[fx, skew], [0.0, fy]])
    to_pixel = scale @ bend
    plane = np.stack([u, v], axis=-1)
    fall = xi * points / length[..., None] + np.array([0.0, 0.0, 1.0])
    by_point = to_pixel @ ((np.eye(2, 3) - plane[..., :, None] * fall[..., None, :]) / depth[..., None, None])
    zero, one = np.zeros_like(u), np.ones_like(u)
    bent = np.stack(
        [
            np.stack([u * square, u * square**2, 2.0 * u * v, square + 2.0 * u * u], axis=-1),
            np.stack([v * square, v * square**2, square + 2.0 * v * v, 2.0 * u * v], axis=-1),
        ],
        axis=-2,
    )
    by_xi = to_pixel @ (-plane * (length / depth)[..., None])[..., None]
    linear = np.stack(
        [np.stack([x, zero, y, one, zero], axis=-1), np.stack([zero, y, zero, zero, one], axis=-1)], axis=-2
    )
    by_lens = np.concatenate([by_xi, linear, scale @ bent], axis=-1)
    return np.stack([fx * x + skew * y + cx, fy * y + cy], axis=-1), by_lens, by_point


def fit(
    start: Bundle, board: Floats, seen: Floats, free: Bools, *, steps: int = 60, robust: float | None = None
) -> Fit:
    """Fit by Levenberg's and Marquardt's method.

    Parameters
    ----------
    start : Bundle
    board : ndarray, shape (corners, 3)
        Board frame, m.
    seen : ndarray, shape (views, corners, 2)
        Where the corners were seen, pixels.
    free : ndarray of bool, shape (10,)
        Which parameters of the lens are fitted; the others stay.
    steps : int
        At most.
    robust : float, optional
        A corner farther off than this, pixels, counts less and less (Huber).

    Returns
    -------
    Fit
    """
    bundle, damping = start, 1e-3
    residuals, by_lens, by_place = _linearise(bundle, board, seen)
    cost = _cost(residuals, robust)
    for _ in range(steps):
        if damping > _LARGE:
            break
        lens, places, mixed, lens_side, place_side = _normal(residuals, by_lens, by_place, robust)
        moved = _step(bundle, lens, places, mixed, lens_side, place_side, free, damping)
        tried = _linearise(moved, board, seen)
        tried_cost = _cost(tried[0], robust)
        if np.isfinite(tried_cost) and tried_cost < cost:
            settled = cost - tried_cost < 1e-9 * cost
            bundle, (residuals, by_lens, by_place), cost = moved, tried, tried_cost
            damping = max(0.2 * damping, _SMALL)
            if settled:
                break
        else:
            damping *= 8.0
    lens, places, mixed, _, _ = _normal(residuals, by_lens, by_place, None)
    information = lens - np.einsum("vip,vpq,vjq->ij", mixed, np.linalg.pinv(places), mixed)
    return Fit(bundle, residuals, information, places)


def _linearise(bundle: Bundle, board: Floats, seen: Floats) -> tuple[Floats, Floats, Floats]:
    turned = np.einsum("vij,cj->vci", bundle.turns, board)
    with np.errstate(all="ignore"):
        pixels, by_lens, by_point = project(bundle.lens, turned + bundle.places[:, None])
    # A small turn w moves a point p by w x p, that is by -[p]x w.
    x, y, z = np.moveaxis(turned, -1, 0)
    zero = np.zeros_like(x)
    turn = np.stack(
        [np.stack([zero, z, -y], axis=-1), np.stack([-z, zero, x], axis=-1), np.stack([y, -x, zero], axis=-1)], axis=-2
    )
    return seen - pixels, by_lens, np.concatenate([by_point @ turn, by_point], axis=-1)


def _cost(residuals: Floats, robust: float | None) -> float:
    far = np.sqrt((residuals**2).sum(axis=-1))
    if not np.isfinite(far).all():
        return np.inf
    if robust is None:
        return float((far**2).sum())
    return float(np.where(far <= robust, far**2, 2.0 * robust * far - robust**2).sum())


def _normal(
    residuals: Floats, by_lens: Floats, by_place: Floats, robust: float | None
) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    weight = np.ones(residuals.shape[:2])
    if robust is not None:
        weight = robust / np.maximum(np.sqrt((residuals**2).sum(axis=-1)), robust)
    weighed = by_lens * weight[..., None, None]
    lens = np.einsum("vcki,vckj->ij", weighed, by_lens)
    mixed = np.einsum("vcki,vckp->vip", weighed, by_place)
    places = np.einsum("vcki,vckp,vc->vip", by_place, by_place, weight)
    place_side = np.einsum("vckp,vck,vc->vp", by_place, residuals, weight)
    return lens, places, mixed, np.einsum("vcki,vck->i", weighed, residuals), place_side


def _step(
    bundle: Bundle, lens: Floats, places: Floats, mixed: Floats, lens_side: Floats, place_side: Floats,
    free: Bools, damping: float,
) -> Bundle:  # fmt: skip
    places = places + damping * np.einsum("vii,ij->vij", places, np.eye(6)) + _SMALL * np.eye(6)
    inverse = np.linalg.inv(places)
    change = np.zeros(len(NAMES))
    if free.any():
        eliminated = np.einsum("vip,vpq->viq", mixed[:, free], inverse)
        left = lens[np.ix_(free, free)]
        left = left + damping * np.diag(np.diag(left)) - np.einsum("viq,vjq->ij", eliminated, mixed[:, free])
        right = lens_side[free] - np.einsum("viq,vq->i", eliminated, place_side)
        size = np.sqrt(np.maximum(np.diag(left), _SMALL))  # the parameters differ by many orders of magnitude
        change[free] = np.linalg.lstsq(left / np.outer(size, size), right / size, rcond=1e-14)[0] / size
    moves = np.einsum("vpq,vq->vp", inverse, place_side - np.einsum("vip,i->vp", mixed, change))
    turns = np.array([rotation_from_vector(move[:3]) for move in moves]) @ bundle.turns
    return replace(bundle, lens=bundle.lens + change, turns=turns, places=bundle.places + moves[:, 3:])
