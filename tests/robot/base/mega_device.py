"""A small Mega on a pseudo-terminal: obeys the protocol, turns two wheels, and has the faults a driver must survive."""

import threading
import time
from pathlib import Path

import numpy as np

from contourslam.robot.base import messages
from contourslam.robot.base.messages import TO_BASE, Ack, Drive, Hello, HelloReply, Message, State, Stop, Tune
from contourslam.robot.base.protocol import Decoder, Received, encode
from contourslam.simulation.hardware.line import Line

PERIOD, WATCHDOG, LAG = 0.02, 0.3, 0.05  # s; the last is the time constant of the wheels
BIAS = 82  # of the gyroscope about z, 1/4096 rad/s: 0.02 rad/s


class MegaDevice:
    """The Mega behind `path`; settings may change while it runs."""

    def __init__(self, path: Path, *, boot: float = 0.1, wheel_base_ticks: float = 1695.0) -> None:
        self.line = Line(path, np.random.default_rng(1))
        self._boot, self._wheel_base = boot, wheel_base_ticks  # m in ticks of 0.1534 mm
        self.silent = self.deaf = self.garbage = self.mute_hello = False
        self.version, self.flags, self.battery = 1, messages.IMU, 7400
        self.resets, self.stopped_by_watchdog = 0, 0
        self.commands: list[tuple[float, Message]] = []
        self.position = np.zeros(2)  # of the wheels in ticks, over resets
        self.speed = np.zeros(2)
        self._lock = threading.Lock()
        self._start()
        self._ending = False
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _start(self) -> None:
        self._began, self._told, self._sequence = time.monotonic() + self._boot, 0, 0
        self._zero = self.position.copy()
        self._decoder = Decoder(TO_BASE)
        self._wanted, self._driven, self._tripped = np.zeros(2), 0.0, False
        self._greeted, self._last = False, 0
        self._refused, self._turning = False, 0.0

    def reset(self) -> None:
        """Push the reset button."""
        with self._lock:
            self.resets += 1
            self.speed[:] = 0.0
            self._start()

    def unplug(self) -> None:
        with self._lock:
            self.line.unplug()

    def plug(self, *, reset: bool = True) -> None:
        with self._lock:
            self.line.plug()
        if reset:
            self.reset()

    def close(self) -> None:
        self._ending = True
        self._thread.join()
        self.line.unplug()

    def drives(self) -> list[Drive]:
        return [message for _, message in self.commands if isinstance(message, Drive)]

    def _run(self) -> None:
        while not self._ending:
            time.sleep(0.004)
            with self._lock:
                now = time.monotonic()
                if now >= self._began:
                    self._work(now)

    def _move(self) -> None:
        """Turn the wheels for one period; what is told of it then agrees, also where the machine was held up."""
        before = self.position.copy()
        for _ in range(10):
            self.speed += (self._wanted - self.speed) * 0.1 * PERIOD / LAG
            self.position += self.speed * 0.1 * PERIOD
        left, right = (self.position - before) / PERIOD
        self._turning = (right - left) / self._wheel_base

    def _work(self, now: float) -> None:
        data = self.line.receive()
        if self.garbage:
            self.line.send(b"\x55\xaa\x12" * 5)
            return
        if not self._greeted and not self.silent:
            self._greeted = True
            self._send(self._hello())
        refused = sum(self._decoder.refused.values())
        for received in [] if self.deaf else self._decoder.feed(data):
            self._obey(received, now)
        self._refused = sum(self._decoder.refused.values()) > refused
        if not self._tripped and self._driven and now - self._driven > WATCHDOG:
            self._wanted[:], self._tripped = 0.0, True
            self.stopped_by_watchdog += 1
        while now >= self._began + (self._told + 1) * PERIOD:
            self._told += 1
            self._move()
            if not self.silent:
                self._send(self._state())

    def _obey(self, received: Received, now: float) -> None:
        message = received.message
        self.commands.append((now, message))
        self._last = received.sequence
        if isinstance(message, Drive):
            self._wanted[:] = message.left, message.right
            self._driven, self._tripped = now, False
        elif isinstance(message, Stop):
            self._wanted[:], self._driven, self._tripped = 0.0, 0.0, False
            self._send(Ack(received.sequence, 0))
        elif isinstance(message, Tune):
            self._send(Ack(received.sequence, 0))
        elif isinstance(message, Hello) and not (self.mute_hello or self.silent):
            self._send(self._hello())

    def _hello(self) -> HelloReply:
        return HelloReply(self.version, 1, 2, 3, 20, 300, 1 if self._told else 0, 2, 0.25, 1.5, 0.0, 0.125)

    def _state(self) -> State:
        left, right = ((int(t) + 2**31) % 2**32 - 2**31 for t in np.floor(self.position - self._zero))
        flags = self.flags | messages.WATCHDOG * self._tripped | messages.REFUSED * self._refused
        duty = tuple(int(d) for d in np.clip(self.speed / 5.0, -1000, 1000))
        gyro = (0, 0, round(self._turning * 4096) + BIAS)
        time_us = (self._told * 20000) % 2**32
        return State(
            time_us, (left, right), gyro, (0, 0, 9807), (0, 0, 0), self.battery, (duty[0], duty[1]), self._last, flags
        )

    def _send(self, message: Message) -> None:
        self.line.send(encode(message, self._sequence))
        self._sequence = (self._sequence + 1) % 256
