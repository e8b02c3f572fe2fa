"""The lens of a fisheye camera from corners of a checkerboard, and how well they tell it."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contourslam.errors import ConfigError, ContourslamError
from contourslam.geometry.fisheye import FisheyeModel
from contourslam.robot.camera.board import Board
from contourslam.robot.camera.bundle import NAMES, Bundle, Fit, fit, project
from contourslam.robot.camera.start import first_guess

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

LEAST_VIEWS = 4
_RING_DEG = 10.0
_FAR_OFF = 4.0  # times the usual error of a view, and at least
_LEAST_FAR_OFF = 0.7  # pixels: then its corners are not where they are said to be
_GOOD_RMS, _FEW_VIEWS, _SURE_DEG = 0.5, 12, 0.25


class CalibrationError(ContourslamError):
    """Too little was seen to calibrate with, or what was seen fits no lens; the message says what to do."""


@dataclass(frozen=True)
class View:
    """The board as one picture shows it.

    Attributes
    ----------
    name : str
        Of the picture.
    corners : ndarray, shape (columns * rows, 2)
        Pixels, in the order of :attr:`Board.points`.
    """

    name: str
    corners: Floats


@dataclass(frozen=True)
class FittedView:
    """A view beside what the lens says of it.

    Attributes
    ----------
    name : str
    used : bool
        False where it was left out, for it is far off what all the others say.
    rms : float
        Root mean square distance of a corner from where it is expected, pixels.
    corners, residuals : ndarray, shape (n, 2)
        Where the corners were seen, and that less where they are expected, pixels.
    angles_deg : tuple of (float, float)
        Nearest and farthest corner off the axis, degrees.
    T_camera_board : ndarray, shape (4, 4)
        m.
    """

    name: str
    used: bool
    rms: float
    corners: Floats
    residuals: Floats
    angles_deg: tuple[float, float]
    T_camera_board: Floats


@dataclass(frozen=True)
class Calibration:
    """A calibrated lens.

    Attributes
    ----------
    model : FisheyeModel
    rms : float
        Root mean square distance of a corner from where it is expected, pixels, over the views used.
    views : tuple of FittedView
    ring_corners : tuple of int
        Corners seen in each 10 degrees off the axis, up to half the field of view.
    ring_sigma_deg : tuple of float
        How well each of these rings is known, degrees: the largest standard deviation of a ray, for the noise of the
        corners alone. Where no corner was seen, the true lens may be off by more.
    warnings : tuple of str
        What to do better.
    """

    model: FisheyeModel
    rms: float
    views: tuple[FittedView, ...]
    ring_corners: tuple[int, ...]
    ring_sigma_deg: tuple[float, ...]
    warnings: tuple[str, ...]


def calibrate(
    width: int, height: int, board: Board, views: Sequence[View], *, field_of_view_deg: float = 220.0
) -> Calibration:
    """Calibrate a lens.

    Parameters
    ----------
    width, height : int
        Of the pictures, pixels.
    board : Board
    views : sequence of View
        At least 4; 20 to 40 all over the picture are good.
    field_of_view_deg : float
        Full angle of the cone that the lens sees, degrees.

    Returns
    -------
    Calibration

    Raises
    ------
    CalibrationError
        If there are too few views, or no lens of this kind fits them.
    """
    if len(views) < LEAST_VIEWS:
        raise CalibrationError(
            f"the board was found in {len(views)} pictures, and {LEAST_VIEWS} are the least; take 20 to 40, with the "
            "whole board in sight, sharp and evenly lit, and check that --board counts inner corners"
        )
    seen = np.array([view.corners for view in views])
    _, start, usable = first_guess(width, height, board.points, seen, field_of_view_deg)
    if usable.sum() < LEAST_VIEWS:
        raise _fits_none("the corners lie outside of what a lens with this field of view shows")
    used = usable.copy()
    chosen = Bundle(start.lens, start.turns[used], start.places[used])
    found = _fit(chosen, board, seen[used])
    errors = _view_rms(found)
    keep = errors <= max(_FAR_OFF * float(np.median(errors)), _LEAST_FAR_OFF)
    if not keep.all() and keep.sum() >= LEAST_VIEWS:
        used[np.flatnonzero(used)[~keep]] = False
        found = _fit(Bundle(found.bundle.lens, found.bundle.turns[keep], found.bundle.places[keep]), board, seen[used])
    model = _model(width, height, found, field_of_view_deg)
    # The views left out are placed too, to tell by how much they are off.
    lens = found.bundle.lens
    turns, places = start.turns.copy(), start.places.copy()
    turns[used], places[used] = found.bundle.turns, found.bundle.places
    fitted = []
    for i, view in enumerate(views):
        alone = Bundle(lens, turns[i : i + 1], places[i : i + 1])
        fitted.append(_judge(view, bool(used[i]), fit(alone, board.points, seen[i : i + 1], _none()), model))
    rings = _rings(model, fitted)
    sigma = found.rms / math.sqrt(2.0)
    sure = _ray_sigma_deg(found, model, sigma, len(rings))
    return Calibration(model, found.rms, tuple(fitted), rings, sure, _warnings(model, found.rms, fitted, rings, sure))


def _none() -> Bools:
    return np.zeros(len(NAMES), dtype=bool)


def _fit(start: Bundle, board: Board, seen: Floats) -> Fit:
    """Fit the places, then the lens' scale and axis, then all: each from where the last one stopped."""
    scale_and_axis = np.isin(NAMES, ("fx", "fy", "cx", "cy"))
    found = fit(start, board.points, seen, _none(), robust=3.0)
    found = fit(found.bundle, board.points, seen, scale_and_axis, robust=3.0)
    found = fit(found.bundle, board.points, seen, ~_none(), robust=2.0, steps=150)
    return fit(found.bundle, board.points, seen, ~_none(), robust=max(3.0 * _usual(found), 0.05), steps=100)


def _usual(found: Fit) -> float:
    """Usual distance of a corner from where it is expected, pixels, which a few false ones do not change."""
    return float(np.median(np.sqrt((found.residuals**2).sum(axis=-1))))


def _view_rms(found: Fit) -> Floats:
    rms: Floats = np.sqrt((found.residuals**2).sum(axis=-1).mean(axis=-1))
    return rms


def _model(width: int, height: int, found: Fit, field_of_view_deg: float) -> FisheyeModel:
    values = {name: float(value) for name, value in zip(NAMES, found.bundle.lens, strict=True)}
    if not math.isfinite(found.rms) or found.rms > 20.0:
        raise _fits_none(f"the best lens is off by {found.rms:.1f} pixels")
    try:
        return FisheyeModel(width, height, **values, field_of_view_deg=field_of_view_deg)
    except ConfigError as error:
        raise CalibrationError(
            f"the pictures do not tell the lens out to its rim ({error}); add pictures with the board at the rim all "
            "around, or give the field of view that is used with --field-of-view"
        ) from error


def _fits_none(why: str) -> CalibrationError:
    return CalibrationError(
        f"no fisheye lens fits what was seen: {why}; check --board and --field-of-view, that all pictures are of one "
        "camera and size, and that the board is flat"
    )


def _judge(view: View, used: bool, alone: Fit, model: FisheyeModel) -> FittedView:
    rays, _ = model.unproject(view.corners)
    angles = np.degrees(np.arccos(np.clip(rays[:, 2], -1.0, 1.0)))
    known = angles[np.isfinite(angles)]
    nearest, farthest = (float(known.min()), float(known.max())) if known.size else (math.nan, math.nan)
    place = np.eye(4)
    place[:3, :3], place[:3, 3] = alone.bundle.turns[0], alone.bundle.places[0]
    return FittedView(view.name, used, alone.rms, view.corners, alone.residuals[0], (nearest, farthest), place)


def _rings(model: FisheyeModel, views: Sequence[FittedView]) -> tuple[int, ...]:
    corners = np.vstack([view.corners for view in views if view.used])
    rays, _ = model.unproject(corners)
    angles = np.degrees(np.arccos(np.clip(rays[:, 2], -1.0, 1.0)))
    edges = np.arange(0.0, math.ceil(0.5 * model.field_of_view_deg / _RING_DEG) + 1) * _RING_DEG
    return tuple(int(count) for count in np.histogram(angles[np.isfinite(angles)], edges)[0])


def _ray_sigma_deg(found: Fit, model: FisheyeModel, sigma: float, rings: int) -> tuple[float, ...]:
    scale = np.sqrt(np.maximum(np.diag(found.lens_information), 1e-12))
    covariance = np.linalg.pinv(found.lens_information / np.outer(scale, scale), rcond=1e-12) / np.outer(scale, scale)
    around = np.linspace(0.0, 2.0 * math.pi, 8, endpoint=False)
    sigmas = []
    for ring in range(rings):
        angle = min(math.radians((ring + 1) * _RING_DEG), model.half_view)
        rays = np.column_stack(
            [math.sin(angle) * np.cos(around), math.sin(angle) * np.sin(around), np.full(around.size, math.cos(angle))]
        )
        _, by_lens, by_point = project(found.bundle.lens, rays)
        spread = np.linalg.eigvalsh(by_lens @ covariance @ np.swapaxes(by_lens, -1, -2))[:, -1]
        pixels_per_radian = np.linalg.svd(by_point, compute_uv=False)[:, -1]  # in the direction that shows least
        sigmas.append(math.degrees(sigma * float(np.max(np.sqrt(np.maximum(spread, 0.0)) / pixels_per_radian))))
    return tuple(sigmas)


def _warnings(
    model: FisheyeModel, rms: float, views: Sequence[FittedView], rings: Sequence[int], sure: Sequence[float]
) -> tuple[str, ...]:
    said = []
    used = [view for view in views if view.used]
    if rms > _GOOD_RMS:
        said.append(
            f"corners are off by {rms:.2f} pixels: is the board flat, are the pictures sharp and taken at rest?"
        )
    if len(used) < _FEW_VIEWS:
        said.append(f"only {len(used)} pictures were used: take 20 to 40")
    if len(used) < len(views):
        names = ", ".join(view.name for view in views if not view.used)
        said.append(f"left out, for they are far off what all the others say: {names}")
    seen = np.flatnonzero(np.array(rings) > 0)
    reach = float(max(view.angles_deg[1] for view in used))
    if reach < 0.5 * model.field_of_view_deg - _RING_DEG:
        said.append(
            f"no corner was seen farther than {reach:.0f} degrees off the axis: beyond that, up to "
            f"{0.5 * model.field_of_view_deg:.0f}, the lens is a guess; hold the board at the rim of the picture"
        )
    gaps = [ring for ring in range(int(seen[-1])) if rings[ring] == 0]
    if gaps:
        said.append(f"no corner was seen {', '.join(f'{ring * 10} to {ring * 10 + 10}' for ring in gaps)} degrees off")
    if sides := _bare_sides(model, used):
        said.append(f"few corners towards the {' and the '.join(sides)} of the picture: hold the board there, too")
    worst = max(sure[: int(seen[-1]) + 1])
    if worst > _SURE_DEG:
        said.append(f"a ray is known to {worst:.2f} degrees only: take more pictures, tilt the board, hold it nearer")
    return tuple(said)


def _bare_sides(model: FisheyeModel, views: Sequence[FittedView]) -> list[str]:
    """Sides of the picture where, outside of its inner half, too few corners were seen."""
    offset = np.vstack([view.corners for view in views]) - (model.cx, model.cy)
    rim = np.nanmax(np.hypot(offset[:, 0], offset[:, 1]))
    outer = offset[np.hypot(offset[:, 0], offset[:, 1]) > 0.5 * rim]
    sector = np.round(np.arctan2(outer[:, 1], outer[:, 0]) / (0.5 * math.pi)).astype(np.int64) % 4
    counts = np.bincount(sector, minlength=4)
    names = ("right", "bottom", "left", "top")
    return [name for name, count in zip(names, counts, strict=True) if count < 0.08 * max(counts.sum(), 1)]
