"""Corners of a checkerboard found in a fisheye picture, out to where the board looks bent and thin.

OpenCV's search expects lines that are about straight. So places with many saddle points are sought first, as the
corners of squares are; around each a flat view is cut out by a rough lens, searched, and what is found is taken back
to the picture by the same lens. That lens need not be right: it is undone exactly.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contourslam.geometry.fisheye import FisheyeModel
from contourslam.robot.camera.board import Board
from contourslam.robot.camera.opencv import opencv

Floats = NDArray[np.float64]
Grey = NDArray[np.uint8]

_VIEWS_DEG = (75.0, 110.0, 45.0)  # full angles of the flat views, the likeliest first
_PLACES = 3  # where most saddle points are
_MUCH_LESS = 0.3  # of what the best place has, and a place is not worth a search, which takes long where none is
_COARSER = 4  # pixels for one of the map of how dense they are
_FINER = 1.3  # pixels of a flat view for one of the picture's, on the axis
_LARGEST_VIEW = 1400  # pixels


def find_corners(picture: Grey, board: Board, rough: FisheyeModel) -> Floats | None:
    """Find the inner corners of a board.

    Parameters
    ----------
    picture : ndarray of uint8, shape (height, width)
    board : Board
    rough : FisheyeModel
        A lens that is about right, of the picture's size.

    Returns
    -------
    ndarray, shape (columns * rows, 2), or None
        Pixels, in the order of :attr:`Board.points`; None where the board is not seen whole.
    """
    cv2 = opencv()
    for rank, place in enumerate(_likely_places(picture, cv2)):
        rays, _ = rough.unproject(place[None])
        if not np.isfinite(rays).all():
            continue
        for angle in _VIEWS_DEG if rank == 0 else _VIEWS_DEG[:1]:
            found = _search_view(cv2, picture, board, rough, rays[0], math.radians(angle))
            if found is not None:
                return found
    return None


def circle_radius(picture: Grey) -> float:
    """Radius of the lens' lit circle, pixels, as far as the picture shows it."""
    lit = picture > max(16.0, 0.15 * float(np.percentile(picture, 90)))
    columns, rows = np.flatnonzero(lit.mean(axis=0) > 0.02), np.flatnonzero(lit.mean(axis=1) > 0.02)
    if not columns.size or not rows.size:
        return 0.5 * float(max(picture.shape))
    return max(0.5 * float(np.ptp(columns)), 0.5 * float(np.ptp(rows)), 0.25 * float(min(picture.shape)))


def _likely_places(picture: Grey, cv2: Any) -> list[Floats]:
    """Pixels around which saddle points are densest."""
    smooth = cv2.GaussianBlur(picture, (0, 0), 2.0).astype(np.float32)
    xx, yy, xy = (cv2.Sobel(smooth, cv2.CV_32F, *order, ksize=3) for order in ((2, 0), (0, 2), (1, 1)))
    saddle = np.sqrt(np.maximum(xy * xy - xx * yy, 0.0))
    saddle = np.minimum(saddle, float(np.percentile(saddle, 99.7)))  # so that one bright edge does not outshine a board
    saddle[saddle < 0.25 * saddle.max()] = 0.0
    width = 0.035 * max(picture.shape) / _COARSER
    coarse = cv2.resize(saddle, None, fx=1.0 / _COARSER, fy=1.0 / _COARSER, interpolation=cv2.INTER_AREA)
    density = cv2.GaussianBlur(coarse, (0, 0), width)
    places: list[Floats] = []
    most = float(density.max())
    for _ in range(_PLACES):
        row, column = np.unravel_index(int(np.argmax(density)), density.shape)
        if density[row, column] <= _MUCH_LESS * most:
            break
        places.append(_COARSER * (np.array([float(column), float(row)]) + 0.5) - 0.5)
        cv2.circle(density, (int(column), int(row)), int(3.0 * width), 0.0, -1)
    return places


def _search_view(
    cv2: Any, picture: Grey, board: Board, rough: FisheyeModel, axis: Floats, angle: float
) -> Floats | None:
    """Search a flat view along an axis; corners in pixels of the picture."""
    f = _FINER * rough.fx / (1.0 + rough.xi)
    size = min(round(2.0 * f * math.tan(0.5 * angle)), _LARGEST_VIEW)
    f = 0.5 * size / math.tan(0.5 * angle)
    # Any turn about the axis will do; this one keeps what is upright in the picture so where the lens looks ahead.
    right = np.cross([0.0, 1.0, 0.0], axis)
    right = right if np.linalg.norm(right) > 0.1 else np.cross([0.0, 0.0, -1.0], axis)
    right /= np.linalg.norm(right)
    turn = np.column_stack([right, np.cross(axis, right), axis])
    middle = 0.5 * (size - 1)
    # The lens bends slowly: its map is computed at every fourth pixel and, between, by straight lines for the search.
    grid = np.arange(0, size + 4, 4, dtype=np.float64)
    columns, rows = np.meshgrid(grid, grid)
    pixels, _ = rough.project(_flat_rays(np.column_stack([columns.ravel(), rows.ravel()]), middle, f) @ turn.T)
    coarse = np.nan_to_num(pixels, nan=-1e4).reshape(*columns.shape, 2).astype(np.float32)
    x, y = (np.arange(size, dtype=np.float32) / 4.0 for _ in range(2))
    where = np.meshgrid(x, y)
    at = cv2.remap(coarse, where[0], where[1], cv2.INTER_LINEAR)
    view = cv2.remap(picture, at, None, cv2.INTER_CUBIC, borderMode=cv2.BORDER_CONSTANT, borderValue=0)
    flags = cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_EXHAUSTIVE | cv2.CALIB_CB_ACCURACY
    good, corners = cv2.findChessboardCornersSB(view, (board.columns, board.rows), flags=flags)
    if not good:
        return None
    flat = corners.reshape(-1, 2).astype(np.float64)
    found, seen = rough.project(_flat_rays(flat, middle, f) @ turn.T)
    inside = seen.all() and (np.abs(flat - middle) < middle - 2.0).all()
    return found if inside else None


def _flat_rays(pixels: Floats, middle: float, f: float) -> Floats:
    """Rays of a flat view's pixels, in its own frame."""
    return np.column_stack([(pixels - middle) / f, np.ones(len(pixels))])
