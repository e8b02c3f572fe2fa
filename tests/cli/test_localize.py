"""``contourslam localize`` follows a robot in the map of an earlier run."""

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from contourslam.cli import main
from contourslam.cli.localize import UNKNOWN
from contourslam.maps import SavedMap, load_map, save_map
from contourslam.recordings import read_trajectory
from contourslam.report.result_folder import read_result_folder
from contourslam.slam.dense import dense_trajectory

Failure = Callable[..., str]
pytest.importorskip("gtsam", reason="needs the extra 'graph'")

# Presses Ctrl-C after some messages of the recording.
INTERRUPTED = """
import os, signal, sys
from contourslam.cli import main
from contourslam.recordings.carmen import CarmenRecording
whole = CarmenRecording.messages
def messages(self):
    for i, message in enumerate(whole(self)):
        if i == 60:
            os.kill(os.getpid(), signal.SIGINT)
        yield message
CarmenRecording.messages = messages
sys.exit(main(sys.argv[1:]))
"""


def place(scan: int) -> np.ndarray:
    """Where the robot is at a scan, in the frame of its start."""
    turn = 0.05 * scan
    return np.array([0.8 * np.sin(turn), 0.8 * (1.0 - np.cos(turn))])


@pytest.fixture
def monday(mapped: Path) -> Path:
    """The map of an earlier run."""
    return mapped / "map.cmap"


@pytest.fixture
def tuesday(log: Path, tmp_path: Path) -> Path:
    """The later part of the same way, as a recording of its own."""
    path = tmp_path / "tuesday.log"
    path.write_text("".join(log.read_text().splitlines(keepends=True)[20:60]))
    return path


@pytest.mark.parametrize("given", [False, True], ids=["found", "given"])
def test_the_robot_is_followed_in_the_map(
    given: bool, monday: Path, tuesday: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    at = ["--initial-pose", "0.7", "0.3", "60"] if given else []
    assert main(["localize", str(tuesday), "--map", str(monday), "-o", str(out), *at]) == 0
    assert "of 40 scans localised in" in capsys.readouterr().out
    found = read_result_folder(out)
    result, count = found.result, len(found.result.stamps)
    assert count >= 30
    np.testing.assert_allclose(result.poses[:, :2], [place(60 - count + i) for i in range(count)], atol=0.02)
    metrics = json.loads((out / "metrics.json").read_text())
    assert metrics["back_end"] == "localization"
    assert metrics["localization"]["lost"] == 0
    assert metrics["localization"]["localised"] == pytest.approx(count / 40)
    assert metrics["skipped"].get(UNKNOWN, 0) == 40 - count
    page = (out / "index.html").read_text()
    assert "were followed in a map of" in page
    assert not (out / "map.cmap").exists()
    assert len(read_trajectory(out / "trajectory.tum")[0]) >= count


def test_the_map_is_left_as_it_is(monday: Path, tuesday: Path, tmp_path: Path) -> None:
    before = monday.read_bytes()
    assert main(["localize", str(tuesday), "--map", str(monday), "-o", str(tmp_path / "out")]) == 0
    assert monday.read_bytes() == before


def test_scripts_get_the_numbers(
    monday: Path, tuesday: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["localize", str(tuesday), "--map", str(monday), "-o", str(tmp_path / "out"), "--json"]) == 0
    metrics = json.loads(capsys.readouterr().out)
    assert 0.0 <= metrics["localization"]["found_after"] < 2.0
    assert metrics["scans"] + metrics["skipped"].get(UNKNOWN, 0) == 40


def test_in_the_wrong_map_the_robot_is_not_found_and_the_code_says_so(
    monday: Path, tuesday: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    saved, wrong = load_map(monday), tmp_path / "wrong.cmap"
    frames = saved.keyframes
    assert frames is not None
    bent = frames.points.copy()
    bent[:, 0] *= 1.7  # a room of another shape
    frames = type(frames)(
        frames.stamps, frames.poses, frames.covariances, frames.blurs, frames.starts, bent, frames.drives
    )
    save_map(wrong, SavedMap(saved.corners, saved.walls, frames))
    assert main(["localize", str(tuesday), "--map", str(wrong), "-o", str(tmp_path / "out")]) == 3
    assert "was not found in" in capsys.readouterr().err
    assert not (tmp_path / "out" / "scans.csv").exists()


def test_a_map_of_landmarks_alone_is_followed_too(log: Path, tuesday: Path, tmp_path: Path) -> None:
    assert main(["run", str(log), "-o", str(tmp_path / "ekf"), "--back-end", "ekf"]) == 0
    arguments = ["--map", str(tmp_path / "ekf" / "map.cmap"), "--initial-pose", "0.7", "0.3", "60"]
    assert main(["localize", str(tuesday), *arguments, "-o", str(tmp_path / "out")]) == 0
    result = read_result_folder(tmp_path / "out").result
    np.testing.assert_allclose(result.poses[-1, :2], place(59), atol=0.05)


def test_a_missing_map_is_a_known_failure(tuesday: Path, tmp_path: Path, failure: Failure) -> None:
    assert "none.cmap" in failure("localize", tuesday, "--map", tmp_path / "none.cmap", "-o", tmp_path / "out")


def test_ctrl_c_keeps_what_is_done(monday: Path, log: Path, tmp_path: Path) -> None:
    arguments = ["localize", str(log), "--map", str(monday), "-o", str(tmp_path / "out")]
    done = subprocess.run([sys.executable, "-c", INTERRUPTED, *arguments], capture_output=True, text=True, check=False)
    assert done.returncode == 130, done.stderr
    found = read_result_folder(tmp_path / "out")
    assert not found.result.complete
    assert 10 < len(found.result.stamps) < 60
    stamps, poses = dense_trajectory(found.result)
    assert np.isfinite(poses).all()
    assert len(stamps) >= len(found.result.stamps)
