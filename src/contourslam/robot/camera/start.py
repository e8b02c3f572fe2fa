"""A first guess of the lens and of where the boards were, from nothing but the corners seen.

The fit of all at once needs a start that is about right: from a bad one it ends in a lens that maps nothing well.
"""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from contourslam.errors import ConfigError
from contourslam.geometry.fisheye import FisheyeModel
from contourslam.robot.camera.bundle import Bundle

Floats = NDArray[np.float64]

# What radii fisheye lenses have at an angle off the axis, for one pixel a radian at the axis.
_CURVES: tuple[Callable[[Floats], Floats], ...] = (
    lambda angle: angle,
    lambda angle: 2.0 * np.sin(0.5 * angle),
    lambda angle: 2.0 * np.tan(0.5 * angle),
)
_SCALES, _SOME = 12, 6  # of a lens that are tried, and views that they are tried on
_XI = 1.6  # with it and two terms of distortion the unified model follows all of them


def rough_lens(width: int, height: int, f: float, field_of_view_deg: float = 220.0, curve: int = 0) -> FisheyeModel:
    """Give a lens of one of the common kinds with its axis in the middle of the picture.

    Parameters
    ----------
    width, height : int
        Of the picture, pixels.
    f : float
        Pixels for each radian at the axis.
    field_of_view_deg : float
        Degrees.
    curve : int
        0 equidistant, 1 equal area, 2 stereographic.

    Returns
    -------
    FisheyeModel
    """
    angle = np.linspace(0.01, math.radians(0.5 * field_of_view_deg), 200)
    plane = np.sin(angle) / (np.cos(angle) + _XI)
    scale, bend, bend2 = np.linalg.lstsq(
        np.column_stack([plane, plane**3, plane**5]), f * _CURVES[curve](angle), rcond=None
    )[0]
    return FisheyeModel(
        width, height, _XI, scale, scale, 0.0, 0.5 * (width - 1), 0.5 * (height - 1), bend / scale, bend2 / scale,
        field_of_view_deg=field_of_view_deg,
    )  # fmt: skip


def place_board(rays: Floats, board: Floats) -> tuple[Floats, Floats, float]:
    """Find where a board is from the rays on which its corners are seen, up to any angle off the axis.

    Parameters
    ----------
    rays : ndarray, shape (n, 3)
        Camera frame.
    board : ndarray, shape (n, 3)
        The corners, board frame, m.

    Returns
    -------
    turn : ndarray, shape (3, 3)
    place : ndarray, shape (3,)
        ``T_camera_board``, m.
    misfit : float
        Root mean square angle between rays and corners through the homography alone, over the board's own angle.
    """
    middle, size = board.mean(axis=0), float(np.abs(board - board.mean(axis=0)).max())
    plane = np.column_stack([(board - middle)[:, :2] / size, np.ones(len(board))])
    # Ray and corner are parallel: their cross product vanishes.
    x, y, z = (component[:, None] * plane for component in rays.T)
    zero = np.zeros_like(x)
    rows = np.vstack([np.hstack([zero, -z, y]), np.hstack([z, zero, -x]), np.hstack([-y, x, zero])])
    homography = np.linalg.eigh(rows.T @ rows)[1][:, 0].reshape(3, 3)
    seen = plane @ homography.T
    if np.median((seen * rays).sum(axis=1)) < 0.0:
        homography, seen = -homography, -seen
    unit = seen / np.linalg.norm(seen, axis=1, keepdims=True)
    off = np.linalg.norm(unit - rays / np.linalg.norm(rays, axis=1, keepdims=True), axis=1)
    spread = np.linalg.norm(unit - unit.mean(axis=0), axis=1)
    scale = 2.0 / (np.linalg.norm(homography[:, 0]) + np.linalg.norm(homography[:, 1]))
    a, b = homography[:, 0] * scale, homography[:, 1] * scale
    u, _, vt = np.linalg.svd(np.column_stack([a, b, np.cross(a, b)]))
    turn = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
    place = homography[:, 2] * scale * size - turn @ middle
    return turn, place, float(np.sqrt((off**2).mean() / max((spread**2).mean(), 1e-12)))


def place_boards(model: FisheyeModel, board: Floats, seen: Floats) -> tuple[Bundle, Floats]:
    """Place the boards of all views through a lens.

    Returns
    -------
    Bundle
    misfits : ndarray, shape (views,)
        See :func:`place_board`; infinite where a corner is on no ray of the lens.
    """
    turns, places, misfits = [], [], []
    for rays in model.unproject(seen)[0].reshape(*seen.shape[:2], 3):
        known = np.isfinite(rays).all()
        turn, place, misfit = place_board(rays, board) if known else (np.eye(3), np.array([0.0, 0.0, 1.0]), math.inf)
        turns.append(turn)
        places.append(place)
        misfits.append(misfit)
    return Bundle(lens_vector(model), np.array(turns), np.array(places)), np.array(misfits)


def lens_vector(model: FisheyeModel) -> Floats:
    """Parameters of a lens in the order of :data:`contourslam.robot.camera.bundle.NAMES`."""
    return np.array(
        [model.xi, model.fx, model.fy, model.skew, model.cx, model.cy, model.k1, model.k2, model.p1, model.p2]
    )


def first_guess(
    width: int, height: int, board: Floats, seen: Floats, field_of_view_deg: float = 220.0
) -> tuple[FisheyeModel, Bundle, NDArray[np.bool_]]:
    """Find the common lens that maps the boards seen to flat ones best.

    Parameters
    ----------
    width, height : int
        Of the pictures, pixels.
    board : ndarray, shape (corners, 3)
        Board frame, m.
    seen : ndarray, shape (views, corners, 2)
        Pixels.
    field_of_view_deg : float
        Degrees.

    Returns
    -------
    FisheyeModel
    Bundle
        The boards placed through it.
    usable : ndarray of bool, shape (views,)
        The views whose corners all lie on rays of the lens.
    """
    best: tuple[float, FisheyeModel | None] = math.inf, None
    some = seen[:: max(len(seen) // _SOME, 1)]
    rim = 0.5 * max(width, height) / math.radians(0.5 * field_of_view_deg)
    for curve in range(len(_CURVES)):
        for f in rim * np.geomspace(0.45, 2.2, _SCALES):
            try:
                model = rough_lens(width, height, float(f), field_of_view_deg, curve)
            except ConfigError:  # equal area turns back at half a turn
                continue
            misfits = place_boards(model, board, some)[1]
            # A lens on which some views have no rays at all must not win by the few others.
            score = float(np.sqrt(np.mean(np.minimum(misfits, 0.3) ** 2)))
            if score < best[0]:
                best = score, model
    found = best[1]
    if found is None:
        raise ConfigError(f"no common fisheye has a field of view of {field_of_view_deg:g} degrees")
    bundle, misfits = place_boards(found, board, seen)
    return found, bundle, np.isfinite(misfits)
