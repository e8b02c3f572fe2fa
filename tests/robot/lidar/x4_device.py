"""A small X4 on a pseudo-terminal: answers commands, streams a room, and has every fault that a driver must survive."""

import contextlib
import math
import os
import select
import threading
import time
import tty
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from contourslam.robot.lidar.x4_packets import correction_deg, encode_packet

Floats = NDArray[np.float64]
BYTE = 10 / 128000
INFO = bytes([0xA5, 0x5A, 0x14, 0, 0, 0, 0x04, 6, 10, 1, 1]) + bytes(range(16))
HEALTH = bytes([0xA5, 0x5A, 3, 0, 0, 0, 0x06, 0, 0, 0])
SCAN = bytes([0xA5, 0x5A, 0x05, 0, 0, 0x40, 0x81])


def square_room(bearing: Floats) -> Floats:
    """Range (m) counter-clockwise bearing by bearing in a room of 4 m by 6 m, 1.5 m from its rear wall."""
    c, s = np.cos(bearing), np.sin(bearing)
    with np.errstate(divide="ignore"):
        return np.minimum.reduce([np.where(c > 0, 4.5 / c, -1.5 / c), np.where(s > 0, 2.0 / s, -2.0 / s)])


def measured(raw_deg: Floats, ranges: Callable[[Floats], Floats]) -> Floats:
    """Distance (mm, whole) that belongs to each uncorrected device angle: where angle and distance agree."""
    mm = np.full(raw_deg.shape, 2000.0)
    for _ in range(30):
        mm = 1000.0 * ranges(-np.radians(raw_deg + correction_deg(mm)))
    return np.rint(mm)


def packets(
    turns: int,
    *,
    rate: float = 7.0,
    size: int = 40,
    start_deg: float = 351.2,
    ranges: Callable[[Floats], Floats] = square_room,
) -> Iterator[tuple[float, bytes]]:
    """Packets of whole turns, each with the time of its last sample, s."""
    number = round(5000 / rate)
    step = 360.0 / number
    raw = start_deg + step * np.arange(number)
    mm = measured(raw, ranges)
    for turn in range(turns):
        at = 0
        while at < number:
            end = min(at + (size if at else 1), number)
            yield (turn * number + end - 1) / 5000, encode_packet(raw[at], raw[end - 1], mm[at:end], start=at == 0)
            at = end


class Device:
    """The lidar behind `path`; settings may change while it runs."""

    def __init__(self, path: Path, *, turns: int = 400) -> None:
        self.path, self._turns = path, turns
        self.silent = self.stalled = self.deaf = self.garbage = False
        self.damage = 0.0
        self.health = HEALTH
        self.commands: list[int] = []
        self.begun: float | None = None
        self.scanning = False
        self._threads: list[threading.Thread] = []
        self._master = -1
        self.plug()

    def plug(self) -> None:
        self._master, slave = os.openpty()
        tty.setraw(slave)
        with contextlib.suppress(FileNotFoundError):
            self.path.unlink()
        self.path.symlink_to(os.ttyname(slave))
        self._slave = slave
        self._running = True
        self.scanning = False
        thread = threading.Thread(target=self._run, args=(self._master,), daemon=True)
        self._threads.append(thread)
        thread.start()

    def unplug(self) -> None:
        self._running = False
        self._threads[-1].join()
        self.path.unlink()
        os.close(self._master)
        os.close(self._slave)

    def reboot(self) -> None:
        """Lose power for a moment: the lidar is idle afterwards."""
        self.scanning = False

    def _write(self, data: bytes) -> None:
        rng = np.random.default_rng(len(data))
        with contextlib.suppress(BlockingIOError):
            if self.damage:
                values = np.frombuffer(data, np.uint8).copy()
                hit = self._rng.random(values.size) < self.damage
                values[hit] = self._rng.integers(0, 256, int(hit.sum()))
                data = values.tobytes()
            if self.garbage:
                data = rng.integers(0, 128, len(data), dtype=np.uint8).tobytes()
            os.write(self._master, data)

    def _run(self, master: int) -> None:
        self._rng = np.random.default_rng(1)
        os.set_blocking(master, False)
        stream: Iterator[tuple[float, bytes]] = iter(())
        held, due, begun = b"", math.inf, 0.0
        buffer = b""
        while self._running:
            wait = min(max(due - time.time(), 0.0), 0.02) if self.scanning else 0.02
            if select.select([master], [], [], wait)[0]:
                with contextlib.suppress(OSError):
                    buffer += os.read(master, 64)
            while (at := buffer.find(b"\xa5")) >= 0 and len(buffer) > at + 1:
                command, buffer = buffer[at + 1], buffer[at + 2 :]
                self.commands.append(command)
                if self.deaf:
                    continue
                if command in (0x90, 0x91):
                    self._write(INFO if command == 0x90 else self.health)
                elif command == 0x65:
                    self.scanning = False
                elif command == 0x60 and not self.scanning:
                    self._write(SCAN)
                    self.scanning = True
                    begun = self.begun = time.time() + 0.01
                    stream = packets(self._turns)
                    after, held = next(stream)
                    due = begun + after + len(held) * BYTE
            if not self.scanning:
                continue
            while time.time() >= due and self.scanning:
                if not self.silent:
                    self._write(encode_packet(30, 30.2, np.full(40, 900)) if self.stalled else held)
                after, held = next(stream)
                due = begun + after + len(held) * BYTE

    def close(self) -> None:
        self._running = False
        self._threads[-1].join()
        with contextlib.suppress(OSError):
            os.close(self._master)
        with contextlib.suppress(OSError):
            os.close(self._slave)
