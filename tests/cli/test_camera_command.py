import json
import os
import pty
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from contourslam.cli import main
from contourslam.errors import ConfigError
from contourslam.geometry.fisheye import FisheyeModel
from contourslam.recordings.png import encode_png
from contourslam.robot.camera.camera_file import load_lens, save_lens
from contourslam.robot.config import load_robot
from contourslam.simulation.checkerboard import PolynomialLens, boards_around, render_board

pytest.importorskip("cv2")

Failure = Callable[..., str]
LENS = PolynomialLens(480, 360, 98.0, -0.028, 0.0022, 241.4, 178.2)


@pytest.fixture(scope="module")
def boards(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("boards")
    for i, place in enumerate(boards_around((7, 5), 0.04, 8, seed=3)):
        (folder / f"{i}.png").write_bytes(encode_png(render_board(LENS, (7, 5), 0.04, place, seed=i, samples=2)))
    return folder


@pytest.fixture
def colours(tmp_path: Path) -> Path:
    folder = tmp_path / "colours"
    folder.mkdir()
    for i in range(6):
        (folder / f"{i}.png").write_bytes(encode_png(np.full((30, 40, 3), (200, 20 * i, 0), np.uint8)))
        os.utime(folder / f"{i}.png", (1000.0 + 0.05 * i, 1000.0 + 0.05 * i))
    return folder


def test_camera_says_what_it_sees_and_keeps_pictures(
    colours: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["camera", "--source", str(colours), "--save", str(tmp_path / "last.png"), "--json"]
    assert main([*words, "--save-folder", str(tmp_path / "kept"), "--every", "0.1"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert (found["pictures"], found["width"], found["height"]) == (6, 40, 30)
    assert found["rate"] == pytest.approx(20.0, rel=0.01)
    assert found["kept"] == len(list((tmp_path / "kept").iterdir())) > 1
    assert (tmp_path / "last.png").read_bytes() == (colours / "5.png").read_bytes()
    assert main(["camera", "--source", str(colours)]) == 0
    text = capsys.readouterr().out
    assert "40 x 30 pixels" in text and "\x1b" not in text


def test_on_a_terminal_camera_draws_the_picture_in_colour(colours: Path) -> None:
    leader, follower = pty.openpty()
    words = [sys.executable, "-m", "contourslam", "camera", "--source", str(colours)]
    environment = {**os.environ, "COLUMNS": "60", "LINES": "20", "TERM": "xterm-256color"}
    environment.pop("NO_COLOR", None)
    process = subprocess.Popen(words, stdout=follower, stderr=subprocess.DEVNULL, env=environment)
    os.close(follower)
    said = b""
    try:
        while data := os.read(leader, 4096):
            said += data
    except OSError:  # the other end has gone
        pass
    os.close(leader)
    assert process.wait(10) == 0
    views = said.decode().split("\x1b[H\x1b[2J")[1:]
    assert views and "\x1b[38;2;200;" in views[0] and views[0].count("▀") > 100


def test_camera_without_a_camera_says_what_to_try(tmp_path: Path, failure: Failure) -> None:
    assert "no such camera" in failure("camera", "--source", "/dev/video99")
    assert "no such file, folder or camera" in failure("camera", "--source", tmp_path / "none")
    assert "must be above 0" in failure("camera", "--rate", "0")


def test_a_lens_is_calibrated_into_its_file_and_the_robots(
    boards: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], failure: Failure
) -> None:
    lens, robot = tmp_path / "camera.yaml", tmp_path / "robot.yaml"
    words = ["calibrate", "camera", str(boards), "--board", "7x5", "--square", "0.04", "-o", str(lens)]
    assert main([*words, "--robot", str(robot), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["rms"] < 0.3 and len(told["pictures"]) >= 7
    model = load_lens(lens)
    assert model == load_lens(robot)
    part = load_robot(robot).camera
    assert part is not None and part.model == model
    assert (tmp_path / "camera_residuals.png").read_bytes().startswith(b"\x89PNG")
    assert "there already" in failure(*words)
    assert main([*words, "--overwrite"]) == 0
    captured = capsys.readouterr()
    assert "reprojection:" in captured.out and "only 8 pictures" in captured.err


def test_a_calibration_that_cannot_be_is_refused(boards: Path, tmp_path: Path, failure: Failure) -> None:
    output = tmp_path / "camera.yaml"
    assert "such as 9x6" in failure("calibrate", "camera", boards, "--board", "nine", "-o", output)
    (tmp_path / "one").mkdir()
    (tmp_path / "one" / "0.png").write_bytes((boards / "0.png").read_bytes())
    assert "found in 1 pictures" in failure("calibrate", "camera", tmp_path / "one", "--board", "7x5", "-o", output)
    assert not output.exists()


def test_a_file_that_holds_no_lens_is_refused(tmp_path: Path, failure: Failure) -> None:
    model = FisheyeModel(100, 100, 1.5, 60.0, 60.0, 0.0, 50.0, 50.0)
    path = tmp_path / "camera.yaml"
    save_lens(path, model, header="one\ntwo")
    assert load_lens(path) == model
    for content, why in (
        ("model: {width: 1}", "model.height is missing"),
        ("model: [1]", "holds no camera model"),
        ("lidar: {}", "holds no camera model"),
        ("model: {", "not valid YAML"),
        (path.read_text().replace("fx: 60.0", "fx: far"), "model.fx must be a finite number"),
    ):
        path.write_text(content)
        with pytest.raises(ConfigError, match=why):
            load_lens(path)
    with pytest.raises(ConfigError, match="cannot be read"):
        load_lens(tmp_path / "none.yaml")
