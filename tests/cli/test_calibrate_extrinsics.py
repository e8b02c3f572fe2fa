"""From a recording with pictures and scans to the camera's place in the robot.yaml."""

import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from contourslam.cli import main
from contourslam.geometry.fisheye import FisheyeModel
from contourslam.geometry.rigid import from_planar, inverse
from contourslam.recordings import Picture, RecordingWriter
from contourslam.recordings.png import encode_png
from contourslam.robot.camera.board import Board
from contourslam.robot.camera.calibration import View, calibrate
from contourslam.robot.config import CameraPart, LidarPart, RobotConfig, load_robot, save_robot
from contourslam.scan import evenly_spaced
from contourslam.simulation.checkerboard import (
    PolynomialLens,
    boards_around,
    boards_before,
    render_board,
    scan_board,
)

pytest.importorskip("cv2")

Failure = Callable[..., str]
CORNERS, SQUARE, MARGIN = (7, 5), 0.1, 0.7 * 0.1
LENS = PolynomialLens(640, 480, 131.0, -0.028, 0.0022, 323.4, 236.2)
BEAMS, STANDS = 720, 8
LIDAR = LidarPart(x=0.1, height=0.2)


def fitted_lens() -> FisheyeModel:
    """The true lens as a calibration finds it."""
    board = Board(*CORNERS, SQUARE)
    views = []
    for i, place in enumerate(boards_around(CORNERS, SQUARE, 20)):
        views.append(View(str(i), LENS.project(board.points @ place[:3, :3].T + place[:3, 3])[0]))
    return calibrate(LENS.width, LENS.height, board, views).model


@pytest.fixture(scope="module")
def part() -> CameraPart:
    """The camera as it truly sits."""
    return CameraPart(model=fitted_lens(), x=0.16, y=-0.03, z=0.36, roll_deg=1.0, pitch_deg=4.0, yaw_deg=-6.0)


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory, part: CameraPart) -> Path:
    """Boards that stand for a second each; between them half a second without one."""
    path = tmp_path_factory.mktemp("extrinsics") / "board"
    T_lidar_camera = inverse(from_planar(LIDAR.mount, LIDAR.height)) @ part.T_base_camera
    angles = -math.pi + 2.0 * math.pi / BEAMS * np.arange(BEAMS, dtype=np.float64)
    with RecordingWriter(path, lidar_mount=from_planar(LIDAR.mount, LIDAR.height)) as writer:
        for i, place in enumerate(boards_before(T_lidar_camera, CORNERS, SQUARE, STANDS, seed=5)):
            shown = render_board(LENS, CORNERS, SQUARE, inverse(T_lidar_camera) @ place, seed=i, samples=2)
            for k in range(3):
                stamp = 10.0 + 1.5 * i + 0.5 * k
                if k < 2:
                    writer.write(Picture(stamp, encode_png(shown), "png"))
                    ranges = scan_board(place, CORNERS, SQUARE, angles, 3.0, margin=MARGIN, seed=10 * i + k)
                    step = 2.0 * math.pi / BEAMS
                    limits = {"range_min": 0.12, "range_max": 10.0}
                    writer.write(
                        evenly_spaced(stamp + 0.05, ranges, angle_min=-math.pi, angle_increment=step, **limits)
                    )
    return path


def test_the_cameras_place_comes_into_the_robots_file(
    recording: Path, part: CameraPart, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    robot = tmp_path / "robot.yaml"
    config = RobotConfig(lidar=LIDAR, camera=CameraPart(model=part.model))
    save_robot(robot, config)
    words = ["calibrate", "extrinsics", str(recording), "--robot", str(robot), "--board", "7x5", "--square", "0.1"]
    assert main([*words, "--margin", str(MARGIN), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["with_board"] >= 2 * STANDS - 2 and told["rms"] < 0.02
    found = load_robot(robot)
    assert found == replace(config, camera=found.camera)  # all else is as it was
    assert found.camera is not None
    off = found.camera.T_base_camera @ inverse(part.T_base_camera)
    assert np.linalg.norm(found.camera.T_base_camera[:3, 3] - part.T_base_camera[:3, 3]) < 0.02
    assert math.degrees(math.acos(min(0.5 * (np.trace(off[:3, :3]) - 1.0), 1.0))) < 1.2


def test_what_is_missing_is_said(recording: Path, part: CameraPart, tmp_path: Path, failure: Failure) -> None:
    robot = tmp_path / "robot.yaml"
    words = ["calibrate", "extrinsics", recording, "--robot", robot, "--board", "7x5", "--square", "0.1"]
    assert "cannot be read" in failure(*words)
    save_robot(robot, RobotConfig(lidar=LIDAR))
    assert "holds no lens of the camera" in failure(*words)
    other = replace(part.model, width=642)
    save_robot(robot, RobotConfig(lidar=LIDAR, camera=CameraPart(model=other)))
    assert "640 by 480 pixels, the lens was calibrated at 642 by 480" in failure(*words)
    save_robot(robot, RobotConfig(lidar=LIDAR, camera=part))
    before = robot.read_text()
    assert "0 times" in failure(*words[:-3], "9x6", "--square", "0.1", "--every", "9")
    assert robot.read_text() == before
