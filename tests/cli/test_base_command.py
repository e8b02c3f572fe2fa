import json
import os
import pty
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from contourslam.cli import main
from contourslam.recordings import WheelReading, write_recording, write_trajectory
from contourslam.robot.base import self_test
from contourslam.robot.base.messages import BATTERY_LOW, STALLED
from contourslam.robot.base.odometry import arc
from contourslam.robot.config import BaseConfig, LidarPart, RobotConfig, load_robot, save_robot
from contourslam.scan import LaserScan, Odometry

sys.path.insert(0, str(Path(__file__).parents[1] / "robot" / "base"))  # the simulated Mega

from mega_device import MegaDevice


@pytest.fixture
def device(tmp_path: Path) -> Iterator[MegaDevice]:
    made = MegaDevice(tmp_path / "base")
    yield made
    made.close()


def test_base_says_what_it_sees(device: MegaDevice, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["base", "--port", str(device.line.path), "--seconds", "1", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["rate"] == pytest.approx(50.0, rel=0.1)
    assert (found["firmware"], found["imu"], found["battery"]) == ("1.2.3", "MPU-9250", 7.4)
    assert (found["frames_lost"], found["resets"], found["battery_low"]) == (0, 0, False)
    assert found["gyro_bias"] == pytest.approx(0.02, abs=0.002) and found["compass"] is None
    assert device.drives() == []  # it only looks


def test_base_warns_of_a_low_battery(device: MegaDevice, capsys: pytest.CaptureFixture[str]) -> None:
    device.flags |= BATTERY_LOW
    assert main(["base", "--port", str(device.line.path), "--seconds", "0.4"]) == 0
    said = capsys.readouterr()
    assert "firmware 1.2.3" in said.out and "battery low" in said.out and "\x1b" not in said.out
    assert "charge it" in said.err


def test_base_says_that_a_motor_does_not_turn(device: MegaDevice, capsys: pytest.CaptureFixture[str]) -> None:
    device.flags |= STALLED
    assert main(["base", "--port", str(device.line.path), "--seconds", "0.4"]) == 0
    assert "a motor does not turn" in capsys.readouterr().out


def test_on_a_terminal_base_goes_on_live(device: MegaDevice) -> None:
    master, slave = pty.openpty()
    words = [sys.executable, "-m", "contourslam", "base", "--port", str(device.line.path), "--seconds", "0.8"]
    process = subprocess.Popen(words, stdout=slave, stderr=subprocess.DEVNULL)
    os.close(slave)
    said = b""
    try:
        while data := os.read(master, 4096):
            said += data
    except OSError:  # the other end has gone
        pass
    os.close(master)
    assert process.wait(20) == 0
    assert said.count(b"\x1b[H\x1b[2J") > 2 and b"wheels:" in said


@pytest.fixture
def short_spin(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, seconds in (("_REACH", 0.5), ("_MEASURE", 0.5), ("_REST", 0.1)):
        monkeypatch.setattr(self_test, name, seconds)


@pytest.mark.usefixtures("short_spin")
def test_spin_turns_each_wheel_by_itself(device: MegaDevice, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["base", "--port", str(device.line.path), "--spin", "--wheels-lifted", "--json"]) == 0
    left, right = json.loads(capsys.readouterr().out)["spin"]
    assert (left["wheel"], right["wheel"]) == ("left", "right")
    for wheel in (left, right):
        assert wheel["fault"] is None and wheel["speed"] == pytest.approx(0.1, abs=0.01)
        assert abs(wheel["other"]) < 0.005
    assert abs(device.speed).max() < 100.0


def test_a_base_that_may_only_turn_slowly_is_spun_no_faster() -> None:
    class Listening:
        config, state = BaseConfig(max_turn_rate=0.2), None

        def __init__(self) -> None:
            self.driven: list[tuple[float, float]] = []

        def drive(self, v: float, omega: float) -> None:
            self.driven.append((v, omega))

        def stop(self) -> None:
            self.driven.append((0.0, 0.0))

    base: Any = Listening()
    assert list(self_test.spin(base, lambda: bool(base.driven))) == []
    assert base.driven[0] == pytest.approx((0.026, -0.2))


@pytest.mark.usefixtures("short_spin")
def test_spin_finds_wheels_that_are_mixed_up(
    device: MegaDevice, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    state = device._state

    def crossed() -> object:
        told = state()
        return type(told)(told.time_us, told.ticks[::-1], told.gyro, told.accel, told.compass, told.battery_mv,
                          told.duty, told.last_command, told.flags)  # fmt: skip

    monkeypatch.setattr(device, "_state", crossed)
    assert main(["base", "--port", str(device.line.path), "--spin", "--wheels-lifted"]) == 1
    assert capsys.readouterr().out.count("the other wheel's encoder counts instead") == 2


def test_the_wheels_do_not_turn_unless_they_are_said_to_be_lifted(
    device: MegaDevice, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["base", "--port", str(device.line.path), "--spin"]) == 1
    assert "--wheels-lifted" in capsys.readouterr().err and device.drives() == []


def test_a_base_that_is_not_there_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["base", "--port", str(tmp_path / "nothing")]) == 1
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and "there is no such port" in error


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a recording of wheels of 50.5 and 49.5 mm, 255 mm apart, and SLAM's trajectory of it."""
    folder, time = tmp_path_factory.mktemp("drive"), 0.04 * np.arange(2500)
    rng = np.random.default_rng(2)
    v, omega = 0.3 + 0.1 * np.sin(1.2 * time), 0.7 * np.sin(0.5 * time)
    rates = np.stack([(v - 0.1275 * omega) / 0.0505, (v + 0.1275 * omega) / 0.0495], axis=1)
    angles, poses = np.cumsum(0.04 * rates, axis=0), [np.zeros(3)]
    for way, turn in zip(0.04 * v[1:], 0.04 * omega[1:], strict=True):
        poses.append(arc(poses[-1], way, 0.0, turn))
    noise = rng.normal(size=(500, 3)) * [0.002, 0.002, 0.001]
    write_trajectory(folder / "trajectory.tum", 50.0 + time[::5], np.array(poses)[::5] + noise)
    beams = np.linspace(-3.0, 3.0, 30)
    messages: list[WheelReading | Odometry | LaserScan] = [
        WheelReading(50.0 + t, (a, b), (0.0, 0.0)) for t, (a, b) in zip(time.tolist(), angles.tolist(), strict=True)
    ]
    messages += [LaserScan(160.0, beams, np.full(30, 2.0), np.zeros(30), 0.1, 10.0), Odometry(160.0, np.zeros(3))]
    write_recording(folder / "recording", messages)
    return folder


def test_calibrate_base_finds_the_wheels_and_keeps_what_else_is_in_the_file(
    drive: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    robot, path = RobotConfig(BaseConfig(ticks_per_turn=960), LidarPart(x=0.0)), tmp_path / "robot.yaml"
    save_robot(path, robot)
    words = ["calibrate", "base", str(drive / "recording"), "--trajectory", str(drive / "trajectory.tum")]
    assert main([*words, "-o", str(path), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["left_radius"] == pytest.approx(0.0505, rel=0.002)
    assert found["right_radius"] == pytest.approx(0.0495, rel=0.002)
    assert found["wheel_base"] == pytest.approx(0.255, rel=0.002)
    assert found["after"]["turn"] < 0.3 * found["before"]["turn"]
    kept = load_robot(path)
    assert kept.base.left_radius == pytest.approx(found["left_radius"])
    assert (kept.base.ticks_per_turn, kept.lidar) == (960, robot.lidar)
    assert path.read_text().startswith("# contourslam calibrate base")
    assert main(words) == 0
    text = capsys.readouterr().out
    assert re.search(r"left radius: +50\.\d\d mm, known to 0\.\d\d%", text) and "the wheels' angles" in text


def test_calibrate_base_maps_the_recording_where_no_trajectory_is_given(
    drive: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["calibrate", "base", str(drive / "recording")]) == 1
    assert "drive longer" in capsys.readouterr().err  # one scan is no drive
