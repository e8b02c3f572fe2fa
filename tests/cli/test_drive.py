"""The command that drives the robot, against an X4 and a Mega on pseudo-terminals."""

import errno
import json
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from rosbags.rosbag2 import Writer
from websockets.sync.client import ClientConnection, connect

sys.path.insert(0, str(Path(__file__).parents[1] / "robot" / "base"))  # the simulated Mega

from mega_device import MegaDevice

from contourslam.cli import main
from contourslam.maps import load_map
from contourslam.recordings import open_recording
from contourslam.report.result_folder import read_result_folder
from contourslam.robot.base.messages import Drive, Stop
from contourslam.robot.config import BaseConfig, LidarPart, RobotConfig, save_robot
from contourslam.scan import LaserScan, Odometry
from contourslam.simulation.hardware.plugged_x4 import PluggedX4

Failure = Callable[..., str]
COMMAND = [sys.executable, "-m", "contourslam"]


@pytest.fixture
def mega(tmp_path: Path) -> Iterator[MegaDevice]:
    made = MegaDevice(tmp_path / "base")
    yield made
    made.close()


@pytest.fixture
def robot(tmp_path: Path, mega: MegaDevice) -> Iterator[Path]:
    """The robot.yaml of a robot with both."""
    with PluggedX4(tmp_path / "lidar"):
        path = tmp_path / "robot.yaml"
        base, lidar = BaseConfig(port=str(tmp_path / "base")), LidarPart(port=str(tmp_path / "lidar"), x=0.0)
        save_robot(path, RobotConfig(base, lidar))
        yield path


def test_a_drive_along_a_route_leaves_a_run_and_its_recording(
    robot: Path, mega: MegaDevice, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, route = tmp_path / "out", tmp_path / "way.csv"
    route.write_text("0, 0\n1, 0\n")
    words = ["drive", "-o", str(out), "--robot", str(robot), "--route", str(route), "--seconds", "4", "--json"]
    assert main(words) == 0
    metrics = json.loads(capsys.readouterr().out)
    assert metrics["scans"] > 8
    run = read_result_folder(out)
    assert run.result.readings is not None and len(run.result.readings.stamps) > 100
    assert load_map(out / "map.cmap").about["back_end"] == metrics["back_end"]
    assert (out / "index.html").exists()
    recorded = list(open_recording(out / "recording").messages())
    assert sum(isinstance(m, LaserScan) for m in recorded) >= metrics["scans"] - 2
    assert sum(isinstance(m, Odometry) for m in recorded) > 100
    drives = [(when, message) for when, message in mega.commands if isinstance(message, Drive)]
    moving = [when for when, message in drives if message.left + message.right > 0]
    assert moving and moving[0] - drives[0][0] > 1.5  # it stands at first
    assert isinstance(mega.commands[-1][1], Stop)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["ctrl-c", "kill"])
def test_ctrl_c_and_kill_stop_the_motors_and_keep_what_was_done(
    number: signal.Signals, robot: Path, mega: MegaDevice, tmp_path: Path
) -> None:
    out, route = tmp_path / "out", tmp_path / "way.csv"
    route.write_text("0, 0\n5, 0\n")
    words = [*COMMAND, "drive", "-o", str(out), "--robot", str(robot), "--route", str(route)]
    process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    until = time.monotonic() + 60.0
    while time.monotonic() < until and not any(drive.left > 0 for drive in mega.drives()):
        time.sleep(0.05)
    process.send_signal(number)
    said, complaints = process.communicate(timeout=60)
    assert process.returncode == 0, complaints
    assert "scans" in said and "stopping" in complaints
    assert isinstance(mega.commands[-1][1], Stop)
    assert read_result_folder(out).result.stamps.size > 0
    assert any(isinstance(m, LaserScan) for m in open_recording(out / "recording").messages())


@pytest.mark.usefixtures("mega")
def test_a_recording_that_cannot_be_completed_costs_nothing_of_the_run(
    robot: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(self: Writer) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Writer, "close", full)
    out = tmp_path / "out"
    assert main(["drive", "-o", str(out), "--robot", str(robot), "--seconds", "3"]) == 1
    said = capsys.readouterr()
    assert "cannot be written: No space left on device" in said.err
    assert "scans" in said.out and "the recording is in" not in said.out
    run = read_result_folder(out).result
    assert run.stamps.size > 0 and any("No space left" in reason for reason in run.skipped)


@pytest.mark.usefixtures("mega")
def test_a_drive_can_be_watched_and_leaves_its_run_all_the_same(robot: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    words = ["drive", "-o", str(out), "--robot", str(robot), "--seconds", "4", "--json", "--view", "--view-port", "0"]
    with subprocess.Popen([*COMMAND, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            url = next(line for line in process.stderr if "http://" in line).split()[-1]
            with connect(url.replace("http:", "ws:") + "ws", max_size=None) as page:
                about, status = watched(page, lambda status: status["scans"] > 3)
            assert about["title"] == "out" and about["live"]
            assert {row["name"] for row in status["health"]} >= {"scans", "odometry", "latency", "lidar", "base"}
            assert next(row for row in status["health"] if row["name"] == "lidar")["level"] == "ok"
            said, _ = process.communicate(timeout=60)
            assert process.returncode == 0
        finally:
            process.kill()
    assert json.loads(said)["scans"] > 8  # the link is not among the result


def test_a_robot_is_watched_without_being_driven(robot: Path, mega: MegaDevice) -> None:
    words = [*COMMAND, "view", "--live", "--robot", str(robot), "--port", "0"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            url = process.stdout.readline().strip()
            with connect(url.replace("http:", "ws:") + "ws", max_size=None) as page:
                about, status = watched(page, lambda status: status["scans"] > 3)
                assert about["title"] == "robot" and status["state"] == "live"
                process.send_signal(signal.SIGINT)
                assert process.wait(30) == 0
        finally:
            process.kill()
    assert not any(isinstance(message, Drive) for _, message in mega.commands)


def test_a_lidar_that_is_not_there_is_told_on_the_page(tmp_path: Path) -> None:
    missing = tmp_path / "robot.yaml"
    save_robot(missing, RobotConfig(lidar=LidarPart(port=str(tmp_path / "nothing"))))
    words = [*COMMAND, "view", "--live", "--robot", str(missing), "--ignore-odometry", "--port", "0"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            url = process.stdout.readline().strip()
            with connect(url.replace("http:", "ws:") + "ws", max_size=None) as page:
                _, status = watched(page, lambda status: "nothing" in status["trouble"])
                assert {row["name"]: row["level"] for row in status["health"]}["lidar"] == "error"
                assert "base" not in [row["name"] for row in status["health"]]
                process.send_signal(signal.SIGINT)
                assert process.wait(30) == 1
            assert "no turn of the lidar was completed" in process.stderr.read()
        finally:
            process.kill()


def watched(page: ClientConnection, fits: Callable[[Any], object]) -> tuple[Any, Any]:
    """Read until the status fits; give what the page was told at first, and that status."""
    about = None
    until = time.monotonic() + 60.0
    while time.monotonic() < until:
        message = page.recv(timeout=60)
        head = json.loads(message[4 : 4 + int.from_bytes(message[:4], "little")])
        if head["kind"] == "hello":
            about = head["about"]
        elif head["kind"] == "frame":
            page.send(json.dumps({"do": "drawn", "value": head["index"]}))
        elif head["kind"] == "status" and fits(head):
            return about, head
    raise AssertionError("no such status came")


def test_what_cannot_go_together_is_told_before_anything_moves(tmp_path: Path, failure: Failure) -> None:
    out, route = tmp_path / "out", tmp_path / "way.csv"
    assert "choose one" in failure("drive", "-o", out, "--keys", "--route", route)
    assert "--speed must be above 0" in failure("drive", "-o", out, "--speed", "0")
    assert "way.csv: cannot be read" in failure("drive", "-o", out, "--route", route)
    assert "robot.yaml: cannot be read" in failure("drive", "-o", out, "--robot", tmp_path / "robot.yaml")
    assert "need a terminal" in failure("drive", "-o", out, "--keys")
    assert "that --view asks for" in failure("drive", "-o", out, "--view-port", "1")
    assert "--view-port must lie" in failure("drive", "-o", out, "--view", "--view-port", "70000")
    assert not out.exists()


@pytest.mark.parametrize("command", ["drive", "robot-in-the-loop"])
def test_an_address_that_is_taken_is_told_before_anything_is_lost(
    command: str, tmp_path: Path, failure: Failure, monkeypatch: pytest.MonkeyPatch
) -> None:
    from contourslam.experiments.loop_values import Firmware

    monkeypatch.setattr(Firmware, "built_in", lambda folder: Firmware(folder, folder))
    earlier = tmp_path / "out" / "recording" / "metadata.yaml"
    earlier.parent.mkdir(parents=True)
    earlier.write_text("mine")
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        more = ["--record"] if command == "robot-in-the-loop" else []
        where = ("--overwrite", "--view", "--view-port", taken.getsockname()[1])
        said = failure(command, "-o", tmp_path / "out", *where, *more)
    assert "choose another --view-host, or another --view-port" in said
    assert earlier.read_text() == "mine"


def test_without_the_firmware_the_loop_says_how_to_build_it(tmp_path: Path, failure: Failure) -> None:
    out = tmp_path / "out"
    assert "run make firmware" in failure("robot-in-the-loop", "-o", out, "--firmware", tmp_path)
    assert "no fault 'fire'" in failure("robot-in-the-loop", "-o", out, "--fault", "fire")
