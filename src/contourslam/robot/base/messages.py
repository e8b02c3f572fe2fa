"""What the base and its host say to each other, as values; docs/base_protocol.md has the bytes."""

import math
import struct
from dataclasses import dataclass
from typing import Any

MOST_TICKS = 20000
"""The base refuses speeds beyond this, ticks/s."""
MOST_GAIN = 100.0
"""And gains beyond this."""
WATCHDOG, IMU, COMPASS, BATTERY_LOW, REFUSED, IMPOSSIBLE_STEP, STALLED = 1, 2, 4, 8, 16, 32, 64
"""Flags of a STATE: the watchdog stopped the motors; the IMU answers; the compass answers; the battery is low; since
the last STATE a frame was refused; an encoder saw an impossible step; the motors are off as one did not turn."""
RESULTS = {0: "obeyed", 1: "unknown type", 2: "wrong length", 3: "value out of range"}
"""What an ACK says."""


@dataclass(frozen=True, slots=True)
class Drive:
    """Both wheels shall turn at these speeds, encoder ticks/s; the watchdog starts anew."""

    left: int
    right: int


@dataclass(frozen=True, slots=True)
class Stop:
    """The motors shall be off at once."""


@dataclass(frozen=True, slots=True)
class Tune:
    """Other gains of the speed control."""

    kp: float
    ki: float
    kd: float
    feed_forward: float


@dataclass(frozen=True, slots=True)
class Hello:
    """The base shall say who it is."""


@dataclass(frozen=True, slots=True)
class State:
    """What the base says of itself every 20 ms, in the protocol's own units.

    Attributes
    ----------
    time_us : int
        Of the Mega's clock when the ticks were read, modulo 2**32.
    ticks : tuple of (int, int)
        Left and right, free-running, modulo 2**32.
    gyro, accel, compass : tuple of (int, int, int)
        Base frame: 1/4096 rad/s, mm/s², 0.1 µT.
    battery_mv : int
        0 where no divider is wired.
    duty : tuple of (int, int)
        Of the left and the right motor, per mille.
    last_command : int
        Sequence of the last frame that was obeyed.
    flags : int
        ``WATCHDOG`` and the others, added up.
    """

    time_us: int
    ticks: tuple[int, int]
    gyro: tuple[int, int, int]
    accel: tuple[int, int, int]
    compass: tuple[int, int, int]
    battery_mv: int
    duty: tuple[int, int]
    last_command: int
    flags: int


@dataclass(frozen=True, slots=True)
class Ack:
    """Answer to the frame of sequence `of`; `result` is a key of :data:`RESULTS`."""

    of: int
    result: int


@dataclass(frozen=True, slots=True)
class HelloReply:
    """Who the base is: protocol and firmware versions, periods (ms), IMU, why it last started, and its gains.

    `imu_kind` is 0 for none, 1 for an MPU-9250, 2 for an MPU-6500 or 6050 without compass.
    """

    protocol: int
    major: int
    minor: int
    patch: int
    state_period: int
    watchdog: int
    imu_kind: int
    reset_cause: int
    kp: float
    ki: float
    kd: float
    feed_forward: float


Command = Drive | Stop | Tune | Hello
Report = State | Ack | HelloReply
Message = Command | Report

LAYOUTS: dict[type[Message], tuple[int, struct.Struct]] = {
    Drive: (0x01, struct.Struct("<ii")),
    Stop: (0x02, struct.Struct("<")),
    Tune: (0x03, struct.Struct("<4f")),
    Hello: (0x04, struct.Struct("<")),
    State: (0x81, struct.Struct("<I2i9hH2h2B")),
    Ack: (0x82, struct.Struct("<BB")),
    HelloReply: (0x83, struct.Struct("<4BHHBB4f")),
}
TO_BASE: tuple[type[Message], ...] = (Drive, Stop, Tune, Hello)
TO_HOST: tuple[type[Message], ...] = (State, Ack, HelloReply)


def numbers(message: Message) -> list[int | float]:
    """Give the fields of a message in the order of its layout."""
    values = [getattr(message, name) for name in type(message).__slots__]
    return [number for value in values for number in (value if isinstance(value, tuple) else (value,))]


def made(kind: type[Message], values: tuple[Any, ...]) -> Message:
    """Make a message from the numbers of its layout."""
    if kind is State:
        time_us, left, right, *nine, battery_mv, duty_left, duty_right, last_command, flags = values
        gyro, accel, compass = (tuple(nine[at : at + 3]) for at in (0, 3, 6))
        ticks, duty = (left, right), (duty_left, duty_right)
        return State(time_us, ticks, gyro, accel, compass, battery_mv, duty, last_command, flags)
    return kind(*values)


def allowed(message: Message) -> bool:
    """Whether every value of a message is in its range."""
    if isinstance(message, Drive):
        return max(abs(message.left), abs(message.right)) <= MOST_TICKS
    if isinstance(message, Tune):
        gains = (message.kp, message.ki, message.kd, message.feed_forward)
        return all(0.0 <= gain <= MOST_GAIN for gain in gains)
    if isinstance(message, State):
        return max(map(abs, message.duty)) <= 1000
    if isinstance(message, Ack):
        return message.result in RESULTS
    if isinstance(message, HelloReply):
        return all(map(math.isfinite, (message.kp, message.ki, message.kd, message.feed_forward)))
    return True
