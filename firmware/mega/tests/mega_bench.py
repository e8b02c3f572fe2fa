"""A bench for the board: a computer's end of the line, and motors."""

import math
import re
import subprocess
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Self

from contourslam.robot.base.messages import Ack, Command, HelloReply, Message, State
from contourslam.robot.base.protocol import Decoder, Received, cobs_encode, encode
from contourslam.simulation.hardware.board import AT_REST, BoardStep, SimulatedBoard

MEGA = Path(__file__).parents[1]
BUILD = MEGA / "build"


def framed(kind: int, sequence: int, payload: bytes) -> bytes:
    """Frame anything with a right CRC, however wrong it is otherwise."""
    body = bytes([kind, sequence]) + payload
    return cobs_encode(body + zlib.crc32(body).to_bytes(4, "little")) + b"\0"


def build_for(folder: Path, **values: float) -> Path:
    """Build firmware and board for another robot: values of config.h; where they are."""
    text = (MEGA / "config.h").read_text()
    for name, value in values.items():
        text, count = re.subn(rf"(?m)^#define {name} [^\s]+", f"#define {name} {value}", text)
        assert count == 1
    config = folder / "robot.h"
    config.write_text(text)
    command = ["make", "-s", "-C", str(MEGA), f"BUILD={folder}", f"CONFIG={config}", "all", "board"]
    subprocess.run(command, check=True, capture_output=True)
    return folder


class Bench:
    """A board, the wheels' positions, and all that was said, as messages with the time of the step they came in."""

    def __init__(self, *options: str, build: Path = BUILD) -> None:
        self.board = SimulatedBoard(build / "board", build / "mega.elf", options)
        self.decoder = Decoder()
        self.heard: list[tuple[float, Received]] = []
        self.time = 0.0
        self.sequence = 0
        self.ticks = (0, 0)
        self.duty = (0, 0)
        self.imu = AT_REST
        self.battery_mv = 7400

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.board.close()

    def frame(self, command: Command) -> bytes:
        """Encode a command with the next sequence."""
        self.sequence = (self.sequence + 1) % 256
        return encode(command, self.sequence)

    def step(self, seconds: float, send: bytes = b"", ticks: tuple[int, int] | None = None) -> BoardStep:
        """Let time pass; the wheels go evenly to where they shall be."""
        self.ticks = ticks or self.ticks
        done = self.board.step(seconds, self.ticks, self.imu, self.battery_mv, send)
        self.time += seconds
        self.duty = done.duty
        self.heard += [(self.time, received) for received in self.decoder.feed(done.sent)]
        return done

    def run(self, seconds: float, send: bytes | Command = b"", step: float = 0.005) -> list[Message]:
        """Let more time pass; what was heard meanwhile."""
        before = len(self.heard)
        data = send if isinstance(send, bytes) else self.frame(send)
        for _ in range(round(seconds / step)):
            self.step(step, data)
            data = b""
        return [received.message for _, received in self.heard[before:]]

    def state(self) -> State:
        """Newest STATE."""
        return next(r.message for _, r in reversed(self.heard) if isinstance(r.message, State))

    def states(self) -> list[State]:
        return [r.message for _, r in self.heard if isinstance(r.message, State)]

    def said(self) -> list[Ack | HelloReply]:
        return [r.message for _, r in self.heard if isinstance(r.message, Ack | HelloReply)]


@dataclass
class Motor:
    """A motor of first order behind dry friction, that turns a wheel with an encoder.

    Duty is per mille, speed ticks/s; friction is what duty it takes.
    """

    time_constant: float = 0.08
    gain: float = 8.0
    friction: float = 0.0
    speed: float = 0.0
    position: float = 0.0

    def step(self, seconds: float, duty: float) -> None:
        drag = self.gain * self.friction
        pull = self.gain * duty
        if self.speed == 0 and abs(pull) <= drag:
            return
        direction = math.copysign(1.0, self.speed or pull)
        speed = self.speed + seconds / self.time_constant * (pull - drag * direction - self.speed)
        self.speed = 0.0 if speed * self.speed < 0 else speed
        self.position += self.speed * seconds

    @property
    def ticks(self) -> int:
        return math.floor(self.position)
