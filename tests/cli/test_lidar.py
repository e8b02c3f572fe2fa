import json
import os
import pty
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from contourslam.cli import main
from contourslam.recordings import open_recording
from contourslam.scan import LaserScan
from contourslam.simulation.hardware.plugged_x4 import PluggedX4, square_room

Failure = Callable[..., str]


@pytest.fixture
def device(tmp_path: Path) -> Iterator[PluggedX4]:
    with PluggedX4(tmp_path / "lidar") as made:
        yield made


def scans_of(path: Path) -> list[LaserScan]:
    return [message for message in open_recording(path).messages() if isinstance(message, LaserScan)]


def test_lidar_says_what_it_sees(device: PluggedX4, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["lidar", "--port", str(device.line.path), "--seconds", "1", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["rate"] == pytest.approx(7.0, rel=0.05)
    assert 300 < found["beams"] <= 714  # a busy machine loses some
    assert found["noise"] < 0.002
    assert found["checksum_rate"] > 0.9
    assert (found["model"], found["motor_line"], found["reconnections"]) == (6, False, 0)
    assert main(["lidar", "--port", str(device.line.path), "--seconds", "0.4"]) == 0
    text = capsys.readouterr().out
    assert "X4, firmware 1.10" in text and "a second" in text and "\x1b" not in text


def test_on_a_terminal_lidar_draws_the_room(device: PluggedX4) -> None:
    master, slave = pty.openpty()
    words = [sys.executable, "-m", "contourslam", "lidar", "--port", str(device.line.path), "--seconds", "0.9"]
    environment = os.environ | {"COLUMNS": "80", "LINES": "24"}
    process = subprocess.Popen(words, stdout=slave, stderr=subprocess.DEVNULL, env=environment)
    os.close(slave)
    said = b""
    try:
        while data := os.read(master, 4096):
            said += data
    except OSError:  # the other end has gone
        pass
    os.close(master)
    assert process.wait(10) == 0
    pictures = said.decode().split("\x1b[H\x1b[2J")[1:]
    assert pictures
    assert re.search(r"turns/s +\d+ beams", pictures[-1]) and pictures[-1].count("#") > 50 and "o" in pictures[-1]


def test_record_writes_a_recording_of_the_room(
    device: PluggedX4, tmp_path: Path, capsys: pytest.CaptureFixture[str], failure: Failure
) -> None:
    bag = tmp_path / "bag"
    assert main(["record", "-o", str(bag), "--port", str(device.line.path), "--seconds", "0.8", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    scans = scans_of(bag)
    assert said["scans"] == len(scans) >= 1
    for scan in scans:
        hit = np.isfinite(scan.ranges)
        assert np.abs(scan.ranges[hit] - square_room(scan.angles[hit])).max() < 0.05
    assert "there already" in failure("record", "-o", bag, "--port", device.line.path, "--seconds", "1")
    device.unplug()
    assert "no such port" in failure("record", "-o", bag, "--overwrite", "--port", device.line.path, "--seconds", "1")
    assert len(scans_of(bag)) == len(scans)  # what stood there is still there


def test_ctrl_c_and_a_lidar_that_goes_leave_a_whole_recording(
    device: PluggedX4, tmp_path: Path, failure: Failure
) -> None:
    words = [sys.executable, "-m", "contourslam", "record", "-o", str(tmp_path / "a"), "--port", str(device.line.path)]
    process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    until = time.monotonic() + 10.0
    while device.lidar.begun is None and time.monotonic() < until:
        time.sleep(0.02)
    time.sleep(0.6)
    process.send_signal(signal.SIGINT)
    said, _ = process.communicate(timeout=10)
    assert process.returncode == 0
    assert int(re.findall(r"(\d+) scans", said)[0]) == len(scans_of(tmp_path / "a")) >= 1
    timer = threading.Timer(0.6, device.unplug)
    timer.start()
    said = failure("record", "-o", tmp_path / "b", "--port", device.line.path, "--patience", "0.2")
    timer.join()
    assert "unplugged" in said
    assert len(scans_of(tmp_path / "b")) >= 1


@pytest.mark.parametrize("command", [["lidar"], ["record", "-o", "bag"]])
def test_wrong_options_and_ports_are_said_in_a_line(command: list[str], failure: Failure, tmp_path: Path) -> None:
    assert "--seconds must be above 0" in failure(*command, "--seconds", "0")
    said = failure(*command, "--port", tmp_path / "none")
    assert "there is no such port" in said
    assert not Path("bag").exists()
