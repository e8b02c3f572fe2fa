"""Calibration of 220-degree lenses that are none of the fitted model's, from rendered checkerboards out to the rim."""

import time
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from contourslam.geometry.fisheye import FisheyeModel
from contourslam.recordings.picture import Picture
from contourslam.recordings.png import encode_png
from contourslam.robot.camera.board import Board
from contourslam.robot.camera.from_pictures import calibrate_from_pictures
from contourslam.simulation.checkerboard import PolynomialLens, boards_around, render_board
from table import Table, publish

PICTURES = 30
BOARD = Board(9, 6, 0.025)
LENSES = {
    "bent to equal area, off the middle": PolynomialLens(1280, 960, 262.0, -0.028, 0.0022, 647.3, 472.8),
    "equidistant": PolynomialLens(1280, 960, 245.0, 0.0, 0.0, 639.5, 479.5),
    "bent to stereographic, cut above and below": PolynomialLens(1280, 960, 262.0, 0.03, -0.003, 632.1, 488.4),
    "the first one at 640 by 480": PolynomialLens(640, 480, 131.0, -0.028, 0.0022, 323.4, 236.2),
}


def pictures(lens: PolynomialLens) -> Iterator[tuple[str, Picture]]:
    """Boards all around the lens, noise and blur."""
    corners = BOARD.columns, BOARD.rows
    for i, place in enumerate(tqdm(boards_around(corners, BOARD.square, PICTURES), unit=" picture", leave=False, disable=None)):
        pixels = render_board(lens, corners, BOARD.square, place, seed=i)
        yield f"{i:02}", Picture(float(i), encode_png(pixels), "png")


def ray_errors_deg(lens: PolynomialLens, model: FisheyeModel) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Angle between the true and the found ray, and off the axis, of every fourth pixel that the lens lights."""
    rows, columns = np.mgrid[: lens.height : 4, : lens.width : 4]
    pixels = np.column_stack([columns.ravel(), rows.ravel()]).astype(np.float64)
    true, lit = lens.unproject(pixels)
    found, _ = model.unproject(pixels)
    true, found = true[lit], np.nan_to_num(found[lit])
    across = np.linalg.norm(np.cross(true, found), axis=1)
    return np.degrees(np.arctan2(across, (true * found).sum(axis=1))), np.degrees(np.arccos(true[:, 2]))


def row(name: str, lens: PolynomialLens) -> list[object]:
    """Calibrate, and compare every ray with the true one."""
    begun = time.process_time()
    done = calibrate_from_pictures(pictures(lens), BOARD)
    spent = time.process_time() - begun
    found = done.calibration
    used = [view for view in found.views if view.used]
    farthest = max(view.angles_deg[1] for view in used)
    errors, angles = ray_errors_deg(lens, found.model)
    inner, outer = errors[angles <= 100.0].max(), errors.max()
    return [
        name, f"{len(used)} of {PICTURES}", f"{farthest:.0f}°", f"{found.rms:.3f}",
        f"{max(view.rms for view in used):.3f}", f"{inner:.3f}°", f"{outer:.3f}°", f"{spent:.0f} s",
    ]  # fmt: skip


def main() -> None:
    rows = [row(name, lens) for name, lens in LENSES.items()]
    columns = [
        "true lens", "pictures used", "farthest corner", "reprojection, pixels", "worst picture",
        "largest ray error to 100°", "to 110°", "CPU, rendering included",
    ]  # fmt: skip
    publish(Table("camera", columns, rows))


if __name__ == "__main__":
    main()
