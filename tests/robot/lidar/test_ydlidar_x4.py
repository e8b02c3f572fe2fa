import sys
import threading
import time
from itertools import islice
from pathlib import Path

import numpy as np
import pytest

from contourslam.errors import MissingExtraError
from contourslam.robot import serial_port
from contourslam.robot.device_errors import (
    DeviceBaudError,
    DeviceBusyError,
    DeviceFaultError,
    DeviceNoisyError,
    DeviceNotFoundError,
    DevicePermissionError,
    DevicePowerError,
    DeviceSilentError,
    DeviceUnpluggedError,
    LidarStalledError,
)
from contourslam.robot.lidar.ydlidar_x4 import Health, YdlidarX4
from contourslam.simulation.hardware.plugged_x4 import PluggedX4, square_room
from contourslam.simulation.hardware.x4 import HEALTH


def lidar_at(device: PluggedX4, *, timeout: float = 0.4, patience: float = 5.0) -> YdlidarX4:
    return YdlidarX4(str(device.line.path), timeout=timeout, patience=patience)


def test_info_health_scans_and_the_end(device: PluggedX4) -> None:
    with lidar_at(device) as lidar:
        info = lidar.info()
        assert (info.model, info.firmware, info.hardware) == (6, "1.10", 1)
        assert lidar.health() == Health(0, 0)
        scans = list(islice(lidar.scans(), 4))
        assert not lidar.motor_line  # a pseudo-terminal has none
    until = time.monotonic() + 1.0
    while device.lidar.scanning and time.monotonic() < until:
        time.sleep(0.01)
    assert device.lidar.commands[-1] == 0x65 and not device.lidar.scanning
    assert device.lidar.begun is not None
    for scan in scans:
        hit = np.isfinite(scan.ranges)
        assert np.abs(scan.ranges[hit] - square_room(scan.angles[hit])).max() < 0.03
        late = (scan.stamp - device.lidar.begun) % (714 / 5000)
        assert min(late, 714 / 5000 - late) < 0.03  # of a machine that may be busy
    assert scans[-1].ranges.size > 650


def test_an_unplugged_lidar_is_waited_for(device: PluggedX4) -> None:
    with lidar_at(device) as lidar:
        scans = lidar.scans()
        next(scans)
        device.unplug()
        back = threading.Timer(0.4, device.plug)
        back.start()
        first = next(scans)
        back.join()
        assert lidar.reconnections == 1
        assert next(scans).stamp > first.stamp


def test_a_lidar_that_stays_away_is_given_up(device: PluggedX4) -> None:
    with lidar_at(device, patience=0.3) as lidar:
        scans = lidar.scans()
        next(scans)
        device.unplug()
        with pytest.raises(DeviceUnpluggedError, match=r"unplugged and has not come back within .* plug it in"):
            next(scans)


def test_a_lidar_that_starts_anew_is_told_again_to_scan_but_not_for_ever(device: PluggedX4) -> None:
    with lidar_at(device, timeout=0.2) as lidar:
        with pytest.raises(DevicePowerError, match="supply dips"):
            for _ in lidar.scans():
                device.reboot()
        assert lidar.restarts == 4


def test_silence_is_told(device: PluggedX4) -> None:
    device.lidar.deaf = True
    with lidar_at(device, timeout=0.2) as lidar, pytest.raises(DeviceSilentError, match=r"no data within .* power"):
        next(lidar.scans())


def test_a_lidar_that_answers_but_never_sends_a_sample_is_told(device: PluggedX4) -> None:
    device.lidar.silent = True
    with lidar_at(device, timeout=0.5) as lidar, pytest.raises(DeviceSilentError, match="no data"):
        next(lidar.scans())
    assert device.lidar.commands.count(0x60) == 4


def test_nonsense_is_a_wrong_speed(device: PluggedX4) -> None:
    device.garbage = True
    with lidar_at(device) as lidar, pytest.raises(DeviceBaudError, match="none make sense; the X4 has 128000 baud"):
        lidar.info()


def test_a_head_that_stands_still_is_told(device: PluggedX4) -> None:
    device.lidar.stalled = True
    with lidar_at(device, timeout=0.3) as lidar, pytest.raises(LidarStalledError, match="motor"):
        next(lidar.scans())


def test_a_line_on_which_nothing_passes_any_more_is_told(device: PluggedX4) -> None:
    with lidar_at(device, timeout=0.2) as lidar:
        scans = lidar.scans()
        next(scans)
        device.damage(0.7)
        with pytest.raises(DeviceNoisyError, match=r"\d% of the last packets fail .* cable"):
            for _ in scans:
                pass


def test_a_line_that_lets_hardly_anything_pass_is_told_with_the_rate(device: PluggedX4) -> None:
    with lidar_at(device, timeout=0.15) as lidar:
        scans = lidar.scans()
        next(scans)
        device.damage(0.12)
        with pytest.raises(DeviceNoisyError, match=r"\d% of the last packets fail"):
            for _ in scans:
                pass


def test_a_fault_of_the_lidar_is_told(device: PluggedX4) -> None:
    device.lidar.health = HEALTH[:7] + bytes([2, 7, 0])
    with lidar_at(device) as lidar, pytest.raises(DeviceFaultError, match="fault 7"):
        lidar.start()


def test_scans_end_when_asked(device: PluggedX4) -> None:
    with lidar_at(device) as lidar:
        until = time.monotonic() + 0.3
        assert len(list(lidar.scans(lambda: time.monotonic() > until))) <= 3


def test_two_programs_do_not_share_a_lidar(device: PluggedX4) -> None:
    with lidar_at(device), pytest.raises(DeviceBusyError, match="another program holds the port"):
        lidar_at(device)


CP2102, MEGA = (0x10C4, 0xEA60), (0x2341, 0x0042)


def test_the_lidar_and_the_base_are_told_apart_by_their_usb_bridges(monkeypatch: pytest.MonkeyPatch) -> None:
    ports = [("/dev/ttyACM0", "Arduino Mega", MEGA), ("/dev/ttyUSB0", "CP2102", CP2102)]
    monkeypatch.setattr(serial_port, "list_ports", lambda: ports)
    assert serial_port.find_port(serial_port.LIDAR) == "/dev/ttyUSB0"
    assert serial_port.find_port(serial_port.BASE) == "/dev/ttyACM0"
    ports.pop()
    with pytest.raises(DeviceNotFoundError, match="no lidar was found: the ports there are: /dev/ttyACM0"):
        serial_port.find_port(serial_port.LIDAR)


def test_a_port_that_is_not_there_lists_those_that_are(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(
        serial_port, "list_ports", lambda: [("/dev/ttyS0", "n/a", None), ("/dev/ttyUSB0", "CP2102", CP2102)]
    )
    with pytest.raises(DeviceNotFoundError, match=r"there are: /dev/ttyS0, /dev/ttyUSB0 \(CP2102\)"):
        YdlidarX4(str(tmp_path / "none"))
    assert serial_port.find_port(serial_port.LIDAR) == "/dev/ttyUSB0"
    monkeypatch.setattr(serial_port, "list_ports", lambda: [("a", "", None), ("b", "", None)])
    with pytest.raises(DeviceNotFoundError, match="choose one with --port"):
        serial_port.find_port(serial_port.LIDAR)
    monkeypatch.setattr(serial_port, "list_ports", list)
    with pytest.raises(DeviceNotFoundError, match="no serial port at all"):
        serial_port.find_port(serial_port.LIDAR)


def test_without_permission_the_group_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    import serial

    def refuse(self: object) -> None:
        raise serial.SerialException(13, "no")

    monkeypatch.setattr(serial.Serial, "open", refuse)
    with pytest.raises(DevicePermissionError, match=r"sudo usermod -aG \w+ \$USER"):
        serial_port.open_port(serial_port.LIDAR, str(tmp_path), 128000)


def test_without_pyserial_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "serial", None)
    with pytest.raises(MissingExtraError, match=r"contourslam\[robot\]"):
        YdlidarX4("/dev/null")
