"""The robot's file says what it means, and what it cannot mean is refused by name."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from contourslam.errors import ConfigError
from contourslam.robot.camera.model import FisheyeModel
from contourslam.robot.config import BaseConfig, CameraPart, LidarPart, RobotConfig, load_robot, save_robot

LENS = FisheyeModel(640, 640, 1.0, 180.0, 181.0, 0.0, 319.5, 319.5)
ANGLE = st.floats(-180.0, 180.0)


def test_what_was_written_is_read_again(tmp_path: Path) -> None:
    robot = RobotConfig(
        replace(BaseConfig(), port="/dev/ttyACM0", left_radius=0.0493, use_gyro=False),
        LidarPart(x=-0.02, yaw_deg=181.0),
        CameraPart(LENS, "picamera2", 0.05, 0.0, 0.4, 0.0, -90.0, 10.0),
    )
    save_robot(tmp_path / "robot.yaml", robot, header="contourslam calibrate base out")
    assert load_robot(tmp_path / "robot.yaml") == robot
    assert (tmp_path / "robot.yaml").read_text().startswith("# contourslam calibrate base out\nbase:\n")


def test_what_the_file_leaves_out_keeps_its_default(tmp_path: Path) -> None:
    (tmp_path / "robot.yaml").write_text("base:\n  wheel_base: 0.3\n")
    assert load_robot(tmp_path / "robot.yaml") == RobotConfig(BaseConfig(wheel_base=0.3))
    (tmp_path / "empty.yaml").write_text("# nothing\n")
    assert load_robot(tmp_path / "empty.yaml") == RobotConfig()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("base:\n  wheel_bsae: 0.3\n", "unknown setting base.wheel_bsae; did you mean base.wheel_base?"),
        ("bass: {}\n", "unknown setting bass; did you mean base?"),
        ("base:\n  flavour: 1\n", "unknown setting base.flavour; known here: port, left_radius"),
        ("base:\n  wheel_base: wide\n", "base.wheel_base must be a finite number, got 'wide'"),
        ("base:\n  wheel_base: .nan\n", "base.wheel_base must be a finite number"),
        ("base:\n  wheel_base: true\n", "base.wheel_base must be a finite number"),
        ("base:\n  ticks_per_turn: 12.5\n", "base.ticks_per_turn must be a whole number, got 12.5"),
        ("base:\n  use_gyro: 1\n", "base.use_gyro must be true or false"),
        ("base:\n  port: 3\n", "base.port must be a text"),
        ("base:\n  left_radius: -0.05\n", "BaseConfig.left_radius must be above 0, got -0.05"),
        ("base:\n  left_sign: 2\n", "BaseConfig.left_sign must be 1 or -1"),
        ("base: 3\n", "base must hold names and values, got 3"),
        ("camera:\n  x: 1\n", "camera.model is missing"),
        ("camera:\n  model: {width: 640}\n", "camera.model.height is missing"),
        ("base: [\n", "is not valid YAML"),
    ],
)
def test_what_is_wrong_is_named_with_its_place(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "robot.yaml"
    path.write_text(text)
    with pytest.raises(ConfigError) as caught:
        load_robot(path)
    assert str(caught.value).startswith(f"{path}: ") and said in str(caught.value)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"robot\.yaml: cannot be read"):
        load_robot(tmp_path / "robot.yaml")


def test_a_camera_without_angles_looks_ahead_and_one_pitched_by_minus_90_looks_up() -> None:
    ahead, up = CameraPart(LENS).T_base_camera, CameraPart(LENS, pitch_deg=-90.0).T_base_camera
    np.testing.assert_allclose(ahead[:3, :3] @ [0, 0, 1], [1, 0, 0], atol=1e-12)
    np.testing.assert_allclose(ahead[:3, :3] @ [0, 1, 0], [0, 0, -1], atol=1e-12)
    np.testing.assert_allclose(up[:3, :3] @ [0, 0, 1], [0, 0, 1], atol=1e-12)
    left = replace(CameraPart(LENS), yaw_deg=90.0).T_base_camera
    np.testing.assert_allclose(left[:3, :3] @ [0, 0, 1], [0, 1, 0], atol=1e-12)


@given(ANGLE, st.floats(-90.0, 90.0), ANGLE)
def test_a_place_given_as_a_matrix_is_the_place_that_is_kept(roll: float, pitch: float, yaw: float) -> None:
    camera = CameraPart(LENS, "0", 0.1, -0.2, 0.3, roll, pitch, yaw)
    again = CameraPart(LENS).placed(camera.T_base_camera)
    np.testing.assert_allclose(again.T_base_camera, camera.T_base_camera, atol=1e-5)
    assert np.linalg.det(camera.T_base_camera[:3, :3]) == pytest.approx(1.0)


def test_a_tick_is_the_share_of_a_turn() -> None:
    base = BaseConfig(left_radius=0.05, right_radius=0.04, ticks_per_turn=1000, right_sign=-1)
    np.testing.assert_allclose(base.metres_per_tick, [2e-3 * math.pi * 0.05, -2e-3 * math.pi * 0.04])
