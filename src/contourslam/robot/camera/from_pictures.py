"""A lens calibrated straight from pictures: the board is found in each, then found again where it was missed."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contourslam.errors import ContourslamError
from contourslam.geometry.fisheye import FisheyeModel
from contourslam.recordings.picture import Picture
from contourslam.robot.camera.board import Board
from contourslam.robot.camera.calibration import LEAST_VIEWS, Calibration, CalibrationError, View, calibrate
from contourslam.robot.camera.corners import circle_radius, find_corners
from contourslam.robot.camera.opencv import decode
from contourslam.robot.camera.start import rough_lens

_MOVED = 0.02  # of the size at which a board is seen: one that moved by less tells nothing new
_ALIKE = 0.12  # of the distance from the axis: by so much a lens may be off, and its flat views still be flat enough


@dataclass(frozen=True)
class PicturesCalibrated:
    """A calibration and what became of the pictures.

    Attributes
    ----------
    calibration : Calibration
    without_board, damaged, repeated : tuple of str
        Names of pictures in which no board was found, that could not be decoded, and whose board stood as in one
        before.
    """

    calibration: Calibration
    without_board: tuple[str, ...]
    damaged: tuple[str, ...]
    repeated: tuple[str, ...]


def calibrate_from_pictures(
    pictures: Iterable[tuple[str, Picture]], board: Board, *, field_of_view_deg: float = 220.0
) -> PicturesCalibrated:
    """Calibrate a lens from pictures of a board.

    Parameters
    ----------
    pictures : iterable of (str, Picture)
        Name and picture; all of one size.
    board : Board
    field_of_view_deg : float
        Full angle of the cone that the lens sees, degrees.

    Returns
    -------
    PicturesCalibrated

    Raises
    ------
    CalibrationError
        If the pictures differ in size, or tell too little; see :func:`calibrate`.
    MissingExtraError
        If OpenCV is not installed.
    """
    views: list[View] = []
    missed: list[tuple[str, Picture]] = []
    damaged: list[str] = []
    repeated: list[str] = []
    rough: FisheyeModel | None = None
    for name, picture in pictures:
        grey = decode(picture, grey=True)
        if grey is None:
            damaged.append(name)
            continue
        if rough is None:
            rough = _rough(grey, field_of_view_deg)
        if grey.shape != (rough.height, rough.width):
            raise CalibrationError(
                f"{name}: is {grey.shape[1]} by {grey.shape[0]} pixels, those before it {rough.width} by "
                f"{rough.height}; take all pictures at the size that the robot will use"
            )
        _take(views, missed, repeated, name, picture, find_corners(grey, board, rough))
    if rough is None:
        raise CalibrationError("there is no picture that can be read; take 20 to 40 of the board")
    if missed and len(views) >= LEAST_VIEWS:
        views, missed = _again(views, missed, repeated, board, rough)
    found = calibrate(rough.width, rough.height, board, views, field_of_view_deg=field_of_view_deg)
    return PicturesCalibrated(found, tuple(name for name, _ in missed), tuple(damaged), tuple(repeated))


def _rough(grey: NDArray[np.uint8], field_of_view_deg: float) -> FisheyeModel:
    """A lens by the size of its lit circle alone."""
    f = circle_radius(grey) / math.radians(0.5 * field_of_view_deg)
    return rough_lens(grey.shape[1], grey.shape[0], f, field_of_view_deg)


def _again(
    views: list[View], missed: list[tuple[str, Picture]], repeated: list[str], board: Board, rough: FisheyeModel
) -> tuple[list[View], list[tuple[str, Picture]]]:
    """Search the pictures without a board again, with the lens that the others tell."""
    views = list(views)
    try:
        model = calibrate(rough.width, rough.height, board, views, field_of_view_deg=rough.field_of_view_deg).model
    except ContourslamError:  # too few or too odd: the same pictures fail again at the end, with a reason
        return views, missed
    if _alike(model, rough):
        return views, missed
    still: list[tuple[str, Picture]] = []
    for name, picture in missed:
        grey = decode(picture, grey=True)
        if grey is not None:
            _take(views, still, repeated, name, picture, find_corners(grey, board, model))
    return views, still


def _alike(model: FisheyeModel, rough: FisheyeModel) -> bool:
    """Whether the flat views that a picture is searched in would look about the same by both lenses."""
    angles, around = np.meshgrid(np.linspace(0.2, 0.95, 6) * rough.half_view, np.linspace(0.0, 2.0 * math.pi, 9)[:-1])
    across = np.sin(angles.ravel())
    rays = np.column_stack([across * np.cos(around.ravel()), across * np.sin(around.ravel()), np.cos(angles.ravel())])
    one, other = model.project(rays)[0], rough.project(rays)[0]
    radius = np.linalg.norm(one - (model.cx, model.cy), axis=1)
    return bool((np.linalg.norm(one - other, axis=1) < _ALIKE * radius).all())


def _take(
    views: list[View], missed: list[tuple[str, Picture]], repeated: list[str], name: str, picture: Picture,
    corners: NDArray[np.float64] | None,
) -> None:  # fmt: skip
    if corners is None:
        missed.append((name, picture))
    elif any(np.abs(view.corners - corners).max() < _MOVED * np.ptp(corners, axis=0).max() for view in views):
        repeated.append(name)
    else:
        views.append(View(name, corners))
