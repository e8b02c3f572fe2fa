"""The driver against a Mega on a pseudo-terminal: it drives, stops when nobody drives, outlives cables and resets."""

import itertools
import math
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from mega_device import MegaDevice

from contourslam.robot.base import link, mega
from contourslam.robot.base.mega import MegaBase
from contourslam.robot.base.messages import BATTERY_LOW, STALLED, Stop
from contourslam.robot.config import BaseConfig
from contourslam.robot.device_errors import (
    DeviceBaudError,
    DeviceNoisyError,
    DeviceNotFoundError,
    DevicePowerError,
    DeviceSilentError,
    DeviceUnpluggedError,
    DeviceVersionError,
)
from contourslam.simulation.hardware.line import Damage

PATIENT = 20.0  # s, for a machine that has other work


def until(met: Callable[[], bool], seconds: float = PATIENT) -> bool:
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if met():
            return True
        time.sleep(0.01)
    return met()


def hold(base: MegaBase, v: float, omega: float, seconds: float) -> None:
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        base.drive(v, omega)
        time.sleep(0.05)


def drives_until(base: MegaBase, met: Callable[[], bool]) -> bool:
    def driven() -> bool:
        base.drive(0.3, 0.0)
        return met()

    return until(driven)


@pytest.fixture
def base_of(mega: MegaDevice) -> Callable[..., MegaBase]:
    return lambda **settings: MegaBase(str(mega.line.path), **settings)


def test_it_says_who_it_is_and_its_states_come(mega: MegaDevice, base_of: Callable[..., MegaBase]) -> None:
    with base_of() as base:
        assert (base.info.major, base.info.minor, base.info.patch) == (1, 2, 3)
        states = list(itertools.islice(base.states(), 20))
        assert until(lambda: base.info.imu_kind == 1)  # which the first greeting does not know yet
    steps = np.diff([state.stamp for state in states])
    assert steps.mean() == pytest.approx(0.02, abs=0.004) and (steps > 0).all()
    assert states[-1].battery == 7.4 and abs(states[-1].stamp - time.time()) < PATIENT
    assert base.lost == 0 and base.refused == 0


def test_it_drives_the_wanted_curve_and_its_odometry_is_the_wheels(
    mega: MegaDevice, base_of: Callable[..., MegaBase]
) -> None:
    with base_of() as base:
        assert until(lambda: base.state is not None)
        hold(base, 0.3, 0.5, 1.5)
        base.stop()
        assert until(lambda: abs(mega.speed).max() < 1.0)
        time.sleep(0.1)
        assert base.odometry is not None and base.state is not None
        ways = mega.position * BaseConfig().metres_per_tick[0]
        pose, state = base.odometry.pose, base.state
    assert (np.abs(np.array(state.ticks) - mega.position) < 2).all()
    assert pose[2] == pytest.approx((ways[1] - ways[0]) / 0.26, abs=0.05)
    assert pose[2] / ways.mean() == pytest.approx(0.5 / 0.3, rel=0.05)
    assert base.gyro_bias[0] == pytest.approx(0.02, abs=0.01)


def test_the_command_rises_no_faster_than_the_acceleration_allows(
    mega: MegaDevice, base_of: Callable[..., MegaBase]
) -> None:
    with base_of(config=replace(BaseConfig(), max_acceleration=0.5)) as base:
        hold(base, 0.4, 0.0, 1.2)
    drives = np.array([drive.left for drive in mega.drives()]) * BaseConfig().metres_per_tick[0]
    assert drives.max() == pytest.approx(0.4, abs=0.01)
    assert np.diff(drives).max() <= 0.5 * 0.05 + 0.001 and len(drives) > 15


def test_a_dead_caller_stops_the_robot_within_half_a_second(mega: MegaDevice, base_of: Callable[..., MegaBase]) -> None:
    with base_of() as base:
        hold(base, 0.3, 0.0, 0.5)
        last = time.monotonic()
        assert until(lambda: isinstance(mega.commands[-1][1], Stop))
        assert mega.commands[-1][0] - last < 0.5 + 0.3  # 0.3 s for a machine that has other work
        assert until(lambda: abs(mega.speed).max() < 1.0) and mega.stopped_by_watchdog == 0
        assert drives_until(base, lambda: abs(mega.speed).max() > 100.0)  # and it can be driven again


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt])
def test_it_stops_whatever_ends_the_block(
    mega: MegaDevice, base_of: Callable[..., MegaBase], error: type[BaseException]
) -> None:
    with pytest.raises(error), base_of() as base:
        hold(base, 0.3, 0.0, 0.3)
        raise error
    assert isinstance(mega.commands[-1][1], Stop)


def test_stop_is_told_until_it_is_heard(mega: MegaDevice, base_of: Callable[..., MegaBase]) -> None:
    with base_of() as base:
        hold(base, 0.3, 0.0, 0.3)
        mega.line.damage(Damage(0.1))
        base.stop()
        assert until(lambda: isinstance(mega.commands[-1][1], Stop))
        assert until(lambda: not base._commander.unheard)
        mega.line.damage(Damage())


def test_a_base_that_hears_nothing_stops_by_itself_and_that_is_counted(
    mega: MegaDevice, base_of: Callable[..., MegaBase]
) -> None:
    with base_of() as base:
        hold(base, 0.3, 0.0, 0.3)
        mega.deaf = True
        assert drives_until(base, lambda: base.watchdog_stops == 1)
        assert base.state is not None and base.state.watchdog
        mega.deaf = False
        assert drives_until(base, lambda: base.state is not None and not base.state.watchdog)


def test_a_reset_midway_is_no_jump(mega: MegaDevice, base_of: Callable[..., MegaBase]) -> None:
    with base_of() as base:
        hold(base, 0.3, 0.0, 0.6)
        assert base.odometry is not None
        before = base.odometry.pose
        mega.reset()
        assert until(lambda: base.resets == 1)
        assert np.abs(base.odometry.pose - before).max() < 0.25
        assert drives_until(base, lambda: base.odometry is not None and base.odometry.pose[0] > before[0] + 0.02)
        assert base.reconnections == 0


@pytest.mark.parametrize("reset", [True, False])
def test_it_outlives_a_cable_pulled_and_no_way_is_lost(
    mega: MegaDevice, base_of: Callable[..., MegaBase], reset: bool
) -> None:
    with base_of() as base:
        hold(base, 0.3, 0.0, 0.5)
        assert base.odometry is not None
        mega.unplug()
        time.sleep(0.5)  # the watchdog stops it meanwhile, some way on
        mega.plug(reset=reset)
        assert until(lambda: base.reconnections == 1)
        assert drives_until(base, lambda: mega.drives()[-1].left > 0 and base.resets == reset)
        if not reset:
            base.stop()
            assert until(lambda: abs(mega.speed).max() < 1.0)
            time.sleep(0.1)
            rolled = mega.position.mean() * BaseConfig().metres_per_tick[0]
            assert base.odometry.pose[0] == pytest.approx(rolled, abs=0.02)
        assert drives_until(base, lambda: abs(mega.speed).max() > 100.0)


def test_with_bytes_damaged_only_frames_are_lost(mega: MegaDevice, base_of: Callable[..., MegaBase]) -> None:
    with base_of() as base:
        assert until(lambda: base.state is not None)
        mega.line.damage(Damage(0.05))
        hold(base, 0.3, 0.3, 1.5)
        mega.line.damage(Damage())
        base.stop()
        assert until(lambda: abs(mega.speed).max() < 1.0)
        time.sleep(0.1)
        assert base.odometry is not None
        ways = mega.position * BaseConfig().metres_per_tick[0]
        assert base.lost > 10 and base.resets == 0
        turn = (ways[1] - ways[0]) / 0.26
        assert base.odometry.pose[2] == pytest.approx(turn, abs=0.15)
        assert math.hypot(*base.odometry.pose[:2]) == pytest.approx(ways.mean() * np.sinc(turn / 2 / math.pi), abs=0.01)


def test_a_low_battery_is_told(mega: MegaDevice, base_of: Callable[..., MegaBase]) -> None:
    mega.flags |= BATTERY_LOW
    with base_of() as base:
        assert next(base.states()).battery_low


def test_a_motor_that_does_not_turn_is_told_and_counted_once(
    mega: MegaDevice, base_of: Callable[..., MegaBase]
) -> None:
    with base_of() as base:
        assert until(lambda: base.state is not None and not base.state.stalled)
        mega.flags |= STALLED
        assert until(lambda: base.state is not None and base.state.stalled)
        time.sleep(0.1)
        assert base.stalls == 1


def test_states_end_when_they_are_no_longer_wanted_or_the_base_is_closed(
    mega: MegaDevice, base_of: Callable[..., MegaBase]
) -> None:
    with base_of() as base:
        end = time.monotonic() + 0.3
        assert all(time.monotonic() < end + PATIENT for _ in base.states(lambda: time.monotonic() > end))
        rest = base.states()
        next(rest)
    assert len(list(rest)) < 10


def test_a_reader_that_is_late_loses_the_oldest_and_that_is_counted(
    mega: MegaDevice, base_of: Callable[..., MegaBase], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(mega_module(), "_KEPT", 3)
    with base_of() as base:
        states = base.states()
        first = next(states)
        time.sleep(0.4)
        second = next(states)
        assert base.dropped > 3 and second.stamp > first.stamp + 0.1


def mega_module() -> object:
    return mega


def test_no_port_and_no_base_are_told_by_name(tmp_path: Path) -> None:
    with pytest.raises(DeviceNotFoundError, match="there is no such port"):
        MegaBase(str(tmp_path / "nothing"))


@pytest.mark.parametrize(
    ("fault", "error", "said"),
    [
        ("silent", DeviceSilentError, "no data within"),
        ("garbage", DeviceBaudError, "none make sense.*make -C firmware/mega flash"),
        ("mute_hello", DeviceSilentError, "speaks but does not answer"),
        ("version", DeviceVersionError, "speaks version 2.*make -C firmware/mega flash"),
    ],
)
def test_what_is_wrong_at_the_start_is_told_by_name(
    mega: MegaDevice, base_of: Callable[..., MegaBase], monkeypatch: pytest.MonkeyPatch,
    fault: str, error: type[Exception], said: str,
) -> None:  # fmt: skip
    monkeypatch.setattr(link, "BOOT", 0.5)
    mega._greeted = True  # so that it does not greet by itself
    setattr(mega, fault, 2 if fault == "version" else True)
    with pytest.raises(error, match=said):
        base_of()


def test_a_base_that_boots_slowly_is_waited_for_and_not_spoken_to(tmp_path: Path) -> None:
    device = MegaDevice(tmp_path / "slow", boot=1.0)
    try:
        heard: list[bytes] = []
        receive = device.line.receive

        def listening() -> bytes:
            heard.append(receive())
            return heard[-1]

        device.line.receive = listening  # type: ignore[method-assign]  # a wiretap
        with MegaBase(str(device.line.path)) as base:
            assert heard[0] == b"" and base.info.protocol == 1
    finally:
        device.close()


def test_a_base_that_falls_silent_for_good_is_told(
    mega: MegaDevice, base_of: Callable[..., MegaBase], monkeypatch: pytest.MonkeyPatch
) -> None:
    for module in (link, mega_module()):
        monkeypatch.setattr(module, "BOOT", 0.3)
    with base_of(patience=0.0) as base:
        mega.silent = True
        with pytest.raises(DeviceSilentError, match="no data"):
            list(base.states())
        with pytest.raises(DeviceSilentError):
            base.drive(0.1, 0.0)


def test_a_base_that_speaks_only_nonsense_after_a_while_is_told(
    mega: MegaDevice, base_of: Callable[..., MegaBase], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(mega_module(), "BOOT", 0.3)
    monkeypatch.setattr(mega_module(), "_NOISY", 0.1)
    with base_of() as base:
        mega.garbage = True
        with pytest.raises(DeviceNoisyError, match="not one sound frame"):
            list(base.states())


def test_a_base_that_is_gone_for_good_is_told(mega: MegaDevice, base_of: Callable[..., MegaBase]) -> None:
    with base_of(patience=0.3) as base:
        mega.unplug()
        with pytest.raises(DeviceUnpluggedError, match="has not come back"):
            list(base.states())


def test_a_supply_that_dips_is_told(mega: MegaDevice, base_of: Callable[..., MegaBase]) -> None:
    with base_of() as base:
        for count in range(1, 5):
            heard = base.frames
            assert until(lambda heard=heard: base.frames > heard + 5)
            mega.reset()
            assert until(lambda count=count: base.resets == count or base._error is not None)
        with pytest.raises(DevicePowerError, match="supply dips"):
            next(base.states())
