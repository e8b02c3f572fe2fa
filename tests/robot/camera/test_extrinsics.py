"""The camera's place beside the lidar is found without a guess, as well as it is said to be."""

import math

import numpy as np
import pytest

from contourslam.geometry.fisheye import FisheyeModel
from contourslam.geometry.rigid import from_planar, inverse, rigid, rotation_from_vector, vector_from_rotation
from contourslam.robot.camera.board import Board
from contourslam.robot.camera.calibration import CalibrationError
from contourslam.robot.camera.extrinsics import Extrinsics, Stand, find_extrinsics
from contourslam.robot.camera.plane_fit import fit_planes
from contourslam.robot.camera.rotations import all_rotations
from contourslam.robot.camera.segments import straight_pieces
from contourslam.robot.camera.stands import place_seen
from contourslam.robot.config import OPTICAL
from contourslam.simulation.checkerboard import boards_before, scan_board

BOARD = Board(7, 5, 0.06)
CORNERS = BOARD.columns, BOARD.rows
LENS = FisheyeModel(1280, 960, 1.5, 657.0, 656.0, 0.0, 647.0, 473.0, -0.36, 0.27, 1e-4, -1e-4)
SURE = 1e-6 * np.eye(6)  # a board placed to 1 mm and 0.06 degrees
ANGLES = np.linspace(-np.pi, np.pi, 720, endpoint=False)
AHEAD, UP = OPTICAL, rotation_from_vector((0.0, -math.pi / 2.0, 0.0)) @ OPTICAL


def camera_place(seed: int) -> np.ndarray:
    """``T_lidar_camera``: looking ahead, up, or anywhere."""
    rng = np.random.default_rng(seed)
    turn = (AHEAD, UP, rotation_from_vector(rng.normal(0.0, 1.5, 3)) @ OPTICAL)[seed % 3]
    return rigid(rotation_from_vector(rng.normal(0.0, 0.1, 3)) @ turn, rng.uniform((-0.2, -0.1, 0.0), (0.2, 0.1, 0.3)))


def make_stands(T_lidar_camera: np.ndarray, seed: int, count: int = 15, noise: float = 0.01) -> list[Stand]:
    """Boards in a room, placed by corners with 0.2 pixels of noise."""
    rng = np.random.default_rng(seed)
    stands = []
    for i, T_lidar_board in enumerate(boards_before(T_lidar_camera, CORNERS, BOARD.square, count, seed=seed)):
        place = inverse(T_lidar_camera) @ T_lidar_board
        pixels, _ = LENS.project(BOARD.points @ place[:3, :3].T + place[:3, 3])
        placed = place_seen(pixels + rng.normal(0.0, 0.2, pixels.shape), BOARD, LENS)
        assert placed is not None
        scans = []
        for k in range(3):
            ranges = scan_board(T_lidar_board, CORNERS, BOARD.square, ANGLES, 3.0, margin=0.03, noise=noise,
                                seed=1000 * seed + 10 * i + k)  # fmt: skip
            scans.append(np.column_stack([ranges * np.cos(ANGLES), ranges * np.sin(ANGLES)]))
        stands.append(Stand(f"{i}", *placed, tuple(scans)))
    return stands


def on_boards(stands: list[Stand], T_camera_lidar: np.ndarray) -> tuple[list[np.ndarray], ...]:
    """Boards, their covariances and the points on them, to fit to."""
    boards, clouds = [stand.T_camera_board for stand in stands], []
    for board, stand in zip(boards, stands, strict=True):
        T = inverse(board @ rigid(np.eye(3), BOARD.middle)) @ T_camera_lidar
        points = np.vstack(stand.scans)
        clouds.append(points[(np.abs(points @ T[:3, :2].T + T[:3, 3]) < (0.22, 0.16, 0.06)).all(axis=1)])
    return boards, [stand.covariance for stand in stands], clouds


def off(found: Extrinsics, truth: np.ndarray) -> np.ndarray:
    """Error of place (m) and turn (rad), along and about the lidar's axes."""
    turn = vector_from_rotation(found.T_lidar_camera[:3, :3] @ truth[:3, :3].T)
    return np.concatenate([found.T_lidar_camera[:3, 3] - truth[:3, 3], turn])


@pytest.mark.parametrize("seed", range(6))
def test_the_place_is_found_without_a_guess_whichever_way_the_camera_looks(seed: int) -> None:
    truth = camera_place(seed)
    found = find_extrinsics(make_stands(truth, seed), BOARD, margin=0.03)
    error = off(found, truth)
    assert np.linalg.norm(error[:3]) < 0.012
    assert np.degrees(np.linalg.norm(error[3:])) < 0.8
    assert 0.006 < found.rms < 0.012
    assert all(stand.points > 10 for stand in found.stands)
    assert np.linalg.norm(error[:3]) < 4.0 * found.sigma_position


def test_the_covariance_is_that_of_the_errors() -> None:
    """Mean normalised error squared over 20 trials, started at the truth for speed; its expectation is 6.

    Here the lens is known exactly: what the covariance allows for its error makes the figure smaller.
    """
    values = []
    for seed in range(20):
        truth = camera_place(seed)
        start = inverse(truth)
        found = fit_planes(start, *on_boards(make_stands(truth, seed), start))
        step = found.T_camera_lidar @ inverse(start)
        turn = vector_from_rotation(step[:3, :3])
        error = np.concatenate([found.T_camera_lidar[:3, 3] - start[:3, 3], turn])
        values.append(float(error @ np.linalg.solve(found.covariance, error)))
    assert 1.5 < np.mean(values) < 7.0


def test_the_covariance_of_the_camera_is_that_of_the_lidar_turned_round() -> None:
    """The same error, told from either side, is as likely."""
    truth = camera_place(3)
    stands = make_stands(truth, 3)
    found = find_extrinsics(stands, BOARD, margin=0.03)
    small = np.array([0.002, -0.001, 0.003, 0.004, -0.002, 0.001])
    moved = found.T_lidar_camera.copy()
    moved[:3, :3] = rotation_from_vector(small[3:]) @ moved[:3, :3]
    moved[:3, 3] += small[:3]
    T, moved = inverse(found.T_lidar_camera), inverse(moved)
    other = np.concatenate([moved[:3, 3] - T[:3, 3], vector_from_rotation(moved[:3, :3] @ T[:3, :3].T)])
    covariance = fit_planes(T, *on_boards(stands, T)).covariance
    here, there = small @ np.linalg.solve(found.covariance, small), other @ np.linalg.solve(covariance, other)
    assert here == pytest.approx(there, rel=0.15)  # the choice of points may differ by a few at the edges


def test_stands_in_which_the_lidar_misses_the_board_are_left_out_and_named() -> None:
    truth = camera_place(0)
    stands = make_stands(truth, 0)
    missed = [
        Stand(f"missed {i}", rigid(np.eye(3), (0.0, 0.5, 1.0 + 0.1 * i)), SURE, stands[i].scans) for i in range(2)
    ]
    found = find_extrinsics([*stands, *missed], BOARD, margin=0.03)
    assert np.linalg.norm(off(found, truth)[:3]) < 0.012
    assert [stand.points for stand in found.stands[-2:]] == [0, 0]
    assert any("missed 0, missed 1" in text for text in found.warnings)


def test_boards_that_are_all_upright_leave_the_height_open_and_that_is_said() -> None:
    truth = rigid(AHEAD, (0.05, 0.0, 0.15))
    stands = []
    for i in range(12):
        bearing = 0.5 * math.sin(3.0 * i)
        turn = np.array([[math.sin(bearing), 0.0, math.cos(bearing)], [-math.cos(bearing), 0.0, math.sin(bearing)],
                         [0.0, -1.0, 0.0]]) @ rotation_from_vector((0.0, 0.6 * math.cos(2.0 * i), 0.0))  # fmt: skip
        at = (1.0 + 0.05 * i) * np.array([math.cos(bearing), math.sin(bearing), 0.0])
        T_lidar_board = rigid(turn, at - turn @ BOARD.middle)
        ranges = scan_board(T_lidar_board, CORNERS, BOARD.square, ANGLES, 3.0, seed=i)
        scan = np.column_stack([ranges * np.cos(ANGLES), ranges * np.sin(ANGLES)])
        stands.append(Stand(str(i), inverse(truth) @ T_lidar_board, SURE, (scan,)))
    with pytest.raises(CalibrationError, match=r"leave the camera's place open.*tilt the board forwards"):
        find_extrinsics(stands, BOARD)


def test_too_few_stands_or_boards_of_another_room_are_refused() -> None:
    stands = make_stands(camera_place(0), 0)
    with pytest.raises(CalibrationError, match="3 times, and 4 are the least"):
        find_extrinsics(stands[:3], BOARD)
    far = [Stand(s.name, rigid(np.eye(3), (0.0, 0.0, 9.0 + i)), SURE, s.scans) for i, s in enumerate(stands)]
    with pytest.raises(CalibrationError, match="no place of the camera"):
        find_extrinsics(far, BOARD)


def test_no_rotation_is_far_from_a_tried_one() -> None:
    turns = all_rotations(15.0)
    rng = np.random.default_rng(0)
    for _ in range(100):
        wanted = rotation_from_vector(rng.normal(0.0, 2.0, 3))
        cosine = 0.5 * (np.einsum("rij,ij->r", turns, wanted).max() - 1.0)
        assert math.degrees(math.acos(min(cosine, 1.0))) < 18.0
    assert len(turns) < 10_000


def test_a_scan_is_cut_into_its_straight_pieces() -> None:
    place = from_planar((1.2, 0.4, 2.0)) @ rigid(rotation_from_vector((math.pi / 2.0, 0.0, 0.0)), np.zeros(3))
    ranges = scan_board(place, CORNERS, BOARD.square, ANGLES, 3.0, noise=0.005)
    points = np.column_stack([ranges * np.cos(ANGLES), ranges * np.sin(ANGLES)])
    points[::50] = np.nan
    lengths = sorted(piece.length for piece in straight_pieces(points))
    assert sum(0.4 < length < 0.5 for length in lengths) == 1  # the board
    assert sum(length > 5.0 for length in lengths) >= 2  # walls in one piece
    assert straight_pieces(points[:3]) == []
