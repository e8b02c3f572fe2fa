"""``contourslam base``: what the Arduino Mega that drives the robot says, and a test of its wheels."""

import math
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from contourslam.cli.console import note, print_json
from contourslam.cli.interrupt import Interrupt
from contourslam.cli.options import Flag, Json
from contourslam.errors import ConfigError

if TYPE_CHECKING:
    from contourslam.robot.base.mega import MegaBase
    from contourslam.robot.base.self_test import WheelSpin
    from contourslam.robot.base.states import BaseState

_REDRAW = 0.1  # s
_IMU = {0: "none", 1: "MPU-9250", 2: "MPU-6500 or 6050"}


@dataclass(frozen=True)
class Base:
    """Look at the base: wheels, gyroscope, battery, frames lost, and on a terminal all of it live.

    On a terminal it goes on until Ctrl-C; elsewhere, and with --json, it looks for some seconds and says what it saw.
    The robot does not move, but with --spin: that turns each wheel by itself and says whether motor and encoder agree.

    Example: contourslam base --port /dev/ttyACM0
    """

    port: Annotated[
        str | None, tyro.conf.arg(help="Serial port; found by itself where only one can be the base's.")
    ] = None
    robot: Annotated[Path | None, tyro.conf.arg(metavar="FILE")] = None
    """The robot.yaml, for wheel radii, ticks and port; without it the defaults."""
    seconds: float | None = None
    """How long to look, s; on a terminal until Ctrl-C where left out, elsewhere 3."""
    spin: Flag = False
    """Turn the left wheel, then the right one, and check their encoders; needs --wheels-lifted."""
    wheels_lifted: Flag = False
    """Say that the wheels are off the floor."""
    patience: Annotated[float, tyro.conf.arg(help="How long to wait for a base that was unplugged, s.")] = 30.0
    json: Json = False

    def execute(self, command: str) -> int:
        """Watch the base, or turn its wheels, and say what was seen."""
        from contourslam.robot.base.mega import MegaBase
        from contourslam.robot.base.self_test import spin
        from contourslam.robot.config import BaseConfig, load_robot

        if self.seconds is not None and not self.seconds > 0.0:
            raise ConfigError(f"--seconds must be above 0, got {self.seconds}")
        if self.spin and not self.wheels_lifted:
            raise ConfigError("--spin turns the wheels: lift them off the floor, and say so with --wheels-lifted")
        config = BaseConfig() if self.robot is None else load_robot(self.robot).base
        live = sys.stdout.isatty() and not self.json and not self.spin
        span = self.seconds if self.seconds is not None or live else 3.0
        spins: list[WheelSpin] = []
        with Interrupt() as interrupt, MegaBase(self.port, config, patience=self.patience) as base:
            if self.spin:
                for wheel in spin(base, lambda: interrupt.requested):
                    spins.append(wheel)
                    if not self.json:
                        _print_spin(wheel)
            seen = _watch(base, interrupt, span, live) if not self.spin else (base.state, 0.0)
            found = _found(base, *seen)
        if self.json:
            print_json(found | {"spin": [_spin_values(wheel) for wheel in spins]})
        elif not self.spin:
            _print(found)
        if found["battery_low"]:
            note("the battery is low: charge it")
        if seen[0] is None:
            note("no state came; look for longer with --seconds")
        faulty = any(wheel.fault for wheel in spins) or (self.spin and len(spins) < 2)
        return 1 if seen[0] is None or faulty else 0


def _watch(base: "MegaBase", interrupt: Interrupt, span: float | None, live: bool) -> "tuple[BaseState | None, float]":
    """The newest state, and states a second."""
    drawn, count, first, state = 0.0, 0, 0.0, None
    for state in base.states(interrupt.or_after(span)):
        first, count = first if count else state.stamp, count + 1
        if live and time.monotonic() - drawn > _REDRAW:
            drawn = time.monotonic()
            lines = _lines(_found(base, state, (count - 1) / max(state.stamp - first, 1e-9)))
            print("\x1b[H\x1b[2J" + "\n".join(lines), flush=True)
    return state, 0.0 if state is None else (count - 1) / max(state.stamp - first, 1e-9)


def _found(base: "MegaBase", state: "BaseState | None", rate: float) -> dict[str, Any]:
    info, (bias, sigma) = base.info, base.gyro_bias
    found: dict[str, Any] = {
        "port": base.name,
        "firmware": f"{info.major}.{info.minor}.{info.patch}",
        "protocol": info.protocol,
        "imu": _IMU.get(info.imu_kind, f"kind {info.imu_kind}"),
        "reset_cause": info.reset_cause,
        "gains": {"kp": info.kp, "ki": info.ki, "kd": info.kd, "feed_forward": info.feed_forward},
        "rate": rate,
        "frames": base.frames,
        "frames_lost": base.lost,
        "frames_refused": base.refused,
        "resets": base.resets,
        "reconnections": base.reconnections,
        "watchdog_stops": base.watchdog_stops,
        "stalls": base.stalls,
        "gyro_bias": bias,
        "gyro_bias_sigma": sigma,
        "battery_low": state is not None and state.battery_low,
    }
    if state is not None:
        odometry = state.odometry
        found |= {
            "ticks": list(state.ticks),
            "wheel_speeds": list(state.wheel_speeds),
            "speed": odometry.speed,
            "turn_rate": odometry.turn_rate,
            "pose": odometry.pose.tolist(),
            "gyro": state.gyro,
            "acceleration": state.acceleration,
            "compass": state.compass,
            "battery": state.battery,
            "duty": list(state.duty),
            "watchdog": state.watchdog,
            "stalled": state.stalled,
            "command_refused": state.refused,
            "impossible_step": state.impossible_step,
            "slipping": odometry.slipping,
        }
    return found


def _print(found: dict[str, Any]) -> None:
    print("\n".join(_lines(found)))


def _lines(found: dict[str, Any]) -> list[str]:
    lines = [
        f"{found['port']}: firmware {found['firmware']}, protocol {found['protocol']}, IMU {found['imu']}",
        f"states:    {found['rate']:.1f} a second; {found['frames_lost']} frames lost of "
        f"{found['frames_lost'] + found['frames']}, {found['frames_refused']} damaged",
    ]
    if "ticks" in found:
        (left, right), (x, y, heading) = found["wheel_speeds"], found["pose"]
        battery = "not wired" if found["battery"] is None else f"{found['battery']:.2f} V"
        flags = [
            text
            for name, text in (
                ("battery_low", "battery low"),
                ("watchdog", "stopped by the watchdog"),
                ("stalled", "stopped, for a motor does not turn or its encoder does not count"),
                ("command_refused", "a command was refused"),
                ("impossible_step", "an encoder saw an impossible step"),
                ("slipping", "wheels and gyroscope disagree"),
            )
            if found[name]
        ]
        lines += [
            f"wheels:    left {left:+7.2f} rad/s ({found['ticks'][0]} ticks, duty {found['duty'][0]:+.0%}), "
            f"right {right:+7.2f} rad/s ({found['ticks'][1]} ticks, duty {found['duty'][1]:+.0%})",
            f"motion:    {found['speed']:+.3f} m/s, {math.degrees(found['turn_rate']):+.1f} degrees/s; "
            f"at {x:+.3f} m, {y:+.3f} m, {math.degrees(heading):+.1f} degrees",
            f"gyroscope: {_triple(found['gyro'], math.degrees(1.0), 'degrees/s')}; bias "
            f"{math.degrees(found['gyro_bias']):+.3f} +- {math.degrees(found['gyro_bias_sigma']):.3f} degrees/s",
            f"gravity:   {_triple(found['acceleration'], 1.0, 'm/s^2')}; "
            f"compass {_triple(found['compass'], 1e6, 'uT')}",
            f"battery:   {battery}",
            f"state:     {', '.join(flags) or 'good'}",
        ]
    if found["resets"] or found["reconnections"] or found["watchdog_stops"] or found["stalls"]:
        lines.append(
            f"trouble:   the board began anew {found['resets']} times, the port was opened anew "
            f"{found['reconnections']} times, the watchdog stopped the motors {found['watchdog_stops']} times, a motor "
            f"that does not turn {found['stalls']} times"
        )
    return lines


def _triple(values: "tuple[float, float, float] | None", unit: float, name: str) -> str:
    return "none" if values is None else " ".join(f"{unit * value:+.2f}" for value in values) + f" {name}"


def _print_spin(wheel: "WheelSpin") -> None:
    how = wheel.fault or "good; it must have turned ahead, else set its sign in robot.yaml to -1"
    speeds = f"{wheel.speed:+.3f} m/s of {wheel.wanted:+.3f} at {abs(wheel.duty):.0%} of full power"
    print(f"{wheel.name} wheel: {speeds}: {how}")


def _spin_values(wheel: "WheelSpin") -> dict[str, Any]:
    return {
        "wheel": wheel.name, "wanted": wheel.wanted, "speed": wheel.speed, "other": wheel.other, "duty": wheel.duty,
        "fault": wheel.fault,
    }  # fmt: skip
