"""Calibration of 220-degree lenses that are none of the fitted model's, and of the camera's place beside a lidar.

The lenses are found from rendered checkerboards out to the rim, and each ray is compared with the true one. The places
are found, without a first guess, from 15 boards that a lidar with 1 cm of noise sees in three scans each, and of
which the camera sees the corners with 0.1 pixels of noise through the true lens, and places them by the one found.
"""

import math
import time
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from contourslam.geometry.fisheye import FisheyeModel
from contourslam.geometry.rigid import inverse, rigid, rotation_from_vector, vector_from_rotation
from contourslam.recordings.picture import Picture
from contourslam.recordings.png import encode_png
from contourslam.robot.camera.board import Board
from contourslam.robot.camera.extrinsics import Stand, find_extrinsics
from contourslam.robot.camera.from_pictures import calibrate_from_pictures
from contourslam.robot.camera.stands import place_seen
from contourslam.robot.config import OPTICAL
from contourslam.simulation.checkerboard import (
    PolynomialLens,
    boards_around,
    boards_before,
    render_board,
    scan_board,
)
from table import Table, publish

PICTURES = 30
BOARD = Board(9, 6, 0.025)
LARGE_BOARD = Board(7, 5, 0.08)  # on A2, for the lidar
TRIALS = 20
LENSES = {
    "bent to equal area, off the middle": PolynomialLens(1280, 960, 262.0, -0.028, 0.0022, 647.3, 472.8),
    "equidistant": PolynomialLens(1280, 960, 245.0, 0.0, 0.0, 639.5, 479.5),
    "bent to stereographic, cut above and below": PolynomialLens(1280, 960, 262.0, 0.03, -0.003, 632.1, 488.4),
    "the first one at 640 by 480": PolynomialLens(640, 480, 131.0, -0.028, 0.0022, 323.4, 236.2),
}


def pictures(lens: PolynomialLens) -> Iterator[tuple[str, Picture]]:
    """Boards all around the lens, noise and blur."""
    corners = BOARD.columns, BOARD.rows
    for i, place in enumerate(
        tqdm(boards_around(corners, BOARD.square, PICTURES), unit=" picture", leave=False, disable=None)
    ):
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


def row(name: str, lens: PolynomialLens) -> tuple[list[object], FisheyeModel]:
    """Calibrate, and compare every ray with the true one."""
    begun = time.process_time()
    done = calibrate_from_pictures(pictures(lens), BOARD)
    spent = time.process_time() - begun
    found = done.calibration
    used = [view for view in found.views if view.used]
    farthest = max(view.angles_deg[1] for view in used)
    errors, angles = ray_errors_deg(lens, found.model)
    inner, outer = errors[angles <= 100.0].max(), errors.max()
    cells: list[object] = [
        name, f"{len(used)} of {PICTURES}", f"{farthest:.0f}°", f"{found.rms:.3f}",
        f"{max(view.rms for view in used):.3f}", f"{inner:.3f}°", f"{outer:.3f}°", f"{spent:.0f} s",
    ]  # fmt: skip
    return cells, found.model


def stands(
    lens: PolynomialLens | FisheyeModel, model: FisheyeModel, T_lidar_camera: NDArray[np.float64], count: int, seed: int
) -> list[Stand]:
    """Boards before a lidar with 1 cm of noise, and a camera whose lens is as well known as it was found."""
    rng = np.random.default_rng(seed)
    angles = np.linspace(-math.pi, math.pi, 720, endpoint=False)
    corners = LARGE_BOARD.columns, LARGE_BOARD.rows
    made = []
    for i, board in enumerate(boards_before(T_lidar_camera, corners, LARGE_BOARD.square, count, seed=seed)):
        place = inverse(T_lidar_camera) @ board
        pixels, _ = lens.project(LARGE_BOARD.points @ place[:3, :3].T + place[:3, 3])
        seen = pixels + rng.normal(0.0, 0.1, pixels.shape)
        placed = place_seen(seen, LARGE_BOARD, model)
        if placed is None:
            continue
        scans = []
        for k in range(3):
            ranges = scan_board(board, corners, LARGE_BOARD.square, angles, 3.0, seed=1000 * seed + 10 * i + k)
            scans.append(np.column_stack([ranges * np.cos(angles), ranges * np.sin(angles)]))
        made.append(Stand(str(i), *placed, tuple(scans)))
    return made


def place_row(
    name: str, look: NDArray[np.float64], count: int, lens: PolynomialLens | FisheyeModel, model: FisheyeModel
) -> list[object]:
    """Find the camera's place in some trials, and compare with the true ones."""
    moves, turns, told, values = [], [], [], []
    begun = time.process_time()
    for seed in range(TRIALS):
        rng = np.random.default_rng(seed)
        turn = rotation_from_vector(rng.normal(0.0, 0.1, 3)) @ look
        truth = rigid(turn, rng.uniform((-0.2, -0.1, 0.0), (0.2, 0.1, 0.3)))
        found = find_extrinsics(stands(lens, model, truth, count, seed), LARGE_BOARD)
        move = found.T_lidar_camera[:3, 3] - truth[:3, 3]
        off = vector_from_rotation(found.T_lidar_camera[:3, :3] @ truth[:3, :3].T)
        error = np.concatenate([move, off])
        moves.append(1000.0 * float(np.linalg.norm(move)))
        turns.append(math.degrees(float(np.linalg.norm(off))))
        told.append(1000.0 * found.sigma_position)
        values.append(float(error @ np.linalg.solve(found.covariance, error)))
    spent = (time.process_time() - begun) / TRIALS
    return [
        name, count, f"{np.median(moves):.1f} mm", f"{max(moves):.1f} mm", f"{np.median(turns):.2f}°",
        f"{max(turns):.2f}°", f"{np.median(told):.1f} mm", f"{np.mean(values):.1f}", f"{spent:.1f} s",
    ]  # fmt: skip


def main() -> None:
    done = {name: row(name, lens) for name, lens in LENSES.items()}
    columns = [
        "true lens", "pictures used", "farthest corner", "reprojection, pixels", "worst picture",
        "largest ray error to 100°", "to 110°", "CPU, rendering included",
    ]  # fmt: skip
    publish(Table("camera", columns, [cells for cells, _ in done.values()]))
    name, lens = next(iter(LENSES.items()))
    model = done[name][1]
    up = rotation_from_vector((0.0, -math.pi / 2.0, 0.0)) @ OPTICAL
    rows = [
        place_row("ahead", OPTICAL, 15, lens, model),
        place_row("up", up, 15, lens, model),
        place_row("ahead", OPTICAL, 30, lens, model),
        place_row("ahead, its lens known exactly", OPTICAL, 30, model, model),
    ]
    columns = [
        "camera looks", "stands", "place off, median", "largest", "turn off, median", "largest", "place said known to",
        "mean NEES (6)", "CPU each",
    ]  # fmt: skip
    publish(Table("extrinsics", columns, rows))


if __name__ == "__main__":
    main()
