"""Where in a recording a board stands still before both camera and lidar."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contourslam.geometry.fisheye import FisheyeModel
from contourslam.geometry.rigid import rigid
from contourslam.recordings.picture import Picture
from contourslam.recordings.recording import Message
from contourslam.robot.camera.board import Board
from contourslam.robot.camera.bundle import NAMES, fit
from contourslam.robot.camera.calibration import CalibrationError
from contourslam.robot.camera.corners import find_corners
from contourslam.robot.camera.extrinsics import Stand
from contourslam.robot.camera.opencv import decode
from contourslam.robot.camera.start import place_boards
from contourslam.scan import LaserScan

Floats = NDArray[np.float64]

_STILL_DEG = 0.3  # that the corners may wander between two pictures
_ALONE = 3.0  # s without another picture before and after: then one picture is a stand
_AROUND = 0.15  # s before the first and after the last picture in which the board still stood
_SCANS = 20  # of a stand, at most
_LEAST_NOISE = 0.1  # pixels
_LENS_ERROR = 0.0025  # rad: by so much the rays of a lens as it is calibrated are off, the same over a board
_POOR = 1.5  # pixels: then the lens is not this one, or the corners are another thing's


@dataclass(frozen=True)
class Sight:
    """A board as one picture shows it: its stamp, s, and corners, pixels, shape (n, 2)."""

    stamp: float
    corners: Floats


def find_sights(pictures: Iterable[Picture], board: Board, lens: FisheyeModel) -> Iterator[Sight]:
    """Find the board in pictures; those without it, and damaged ones, are left out.

    Raises
    ------
    CalibrationError
        If a picture is not of the lens' size.
    """
    for picture in pictures:
        grey = decode(picture, grey=True)
        if grey is None:
            continue
        if grey.shape != (lens.height, lens.width):
            raise CalibrationError(
                f"the picture at {picture.stamp:.2f} s is {grey.shape[1]} by {grey.shape[0]} pixels, the lens was "
                f"calibrated at {lens.width} by {lens.height}; record at that size, or calibrate the lens at this one"
            )
        corners = find_corners(grey, board, lens)
        if corners is not None:
            yield Sight(picture.stamp, corners)


def find_stands(
    sights: Sequence[Sight], stamps: Sequence[float], messages: Iterable[Message], board: Board, lens: FisheyeModel
) -> list[Stand]:
    """Put together what camera and lidar see while a board stands still.

    Parameters
    ----------
    sights : sequence of Sight
        In the order of their stamps.
    stamps : sequence of float
        Of all pictures that were searched, s.
    messages : iterable of Message
        Of the recording; its scans count.
    board : Board
    lens : FisheyeModel

    Returns
    -------
    list of Stand
        Those with at least one scan.
    """
    groups = [group for group in _still(sights, lens) if len(group) > 1 or _alone(group[0].stamp, stamps)]
    spans = np.array([(group[0].stamp - _AROUND, group[-1].stamp + _AROUND) for group in groups]).reshape(-1, 2)
    scans: list[list[Floats]] = [[] for _ in groups]
    for message in messages:
        if isinstance(message, LaserScan):
            for i in np.flatnonzero((spans[:, 0] <= message.stamp) & (message.stamp <= spans[:, 1])):
                scans[i].append(_points(message))
    stands = []
    for group, seen in zip(groups, scans, strict=True):
        placed = place_seen(np.mean([sight.corners for sight in group], axis=0), board, lens)
        if seen and placed is not None:
            some = seen[:: -(-len(seen) // _SCANS)]
            stands.append(Stand(f"at {group[0].stamp:.1f} s", *placed, tuple(some)))
    return stands


def _still(sights: Sequence[Sight], lens: FisheyeModel) -> list[list[Sight]]:
    """Runs of sights between which the board hardly moved."""
    pixels = np.radians(_STILL_DEG) * lens.fx / (1.0 + lens.xi)
    groups: list[list[Sight]] = []
    for sight in sights:
        if groups:
            off = np.sqrt(((sight.corners - groups[-1][0].corners) ** 2).sum(axis=1).mean())
            if off < pixels:
                groups[-1].append(sight)
                continue
        groups.append([sight])
    return groups


def _alone(stamp: float, stamps: Sequence[float]) -> bool:
    apart = np.abs(np.array(stamps) - stamp)
    return bool((apart[apart > 0.0] > _ALONE).all())


def _points(scan: LaserScan) -> Floats:
    with np.errstate(invalid="ignore"):
        hits = (scan.ranges >= scan.range_min) & (scan.ranges < scan.range_max)
    ranges = np.where(hits, scan.ranges, np.nan)
    return np.column_stack([ranges * np.cos(scan.angles), ranges * np.sin(scan.angles)])


def place_seen(corners: Floats, board: Board, lens: FisheyeModel) -> tuple[Floats, Floats] | None:
    """Place a board by its corners, and say how well they tell it.

    Parameters
    ----------
    corners : ndarray, shape (n, 2)
        Pixels, in the order of :attr:`Board.points`.
    board : Board
    lens : FisheyeModel

    Returns
    -------
    T_camera_board : ndarray, shape (4, 4)
        m.
    covariance : ndarray, shape (6, 6)
        See :attr:`Stand.covariance`.
        None instead of both where the lens does not fit the corners.
    """
    start, misfits = place_boards(lens, board.points, corners[None])
    if not np.isfinite(misfits).all():
        return None
    found = fit(start, board.points, corners[None], np.zeros(len(NAMES), dtype=bool))
    if found.rms > _POOR:
        return None
    sigma = max(found.rms / np.sqrt(2.0), _LEAST_NOISE)
    covariance = sigma**2 * np.linalg.inv(found.place_information[0])
    # All rays to the board are off alike: it moves across them, and turns with them.
    ray = found.bundle.places[0] + found.bundle.turns[0] @ board.middle
    covariance[:3, :3] += _LENS_ERROR**2 * np.eye(3)
    covariance[3:, 3:] += _LENS_ERROR**2 * (ray @ ray * np.eye(3) - np.outer(ray, ray))
    return rigid(found.bundle.turns[0], found.bundle.places[0]), 0.5 * (covariance + covariance.T)
