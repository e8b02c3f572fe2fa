"""A YDLidar X4 as a device: commands and time in, bytes out. It reads no clock; its owner tells it the time."""

import math
from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from contourslam.robot.lidar.x4_packets import encode_packet

Floats = NDArray[np.float64]
Measure = Callable[[Floats, Floats], Floats]
"""From times (s) and uncorrected device angles (degrees, clockwise) to distances (mm), 0 where nothing comes back."""

BYTE = 10.0 / 128000.0
"""Time of a byte on the wire, s."""
SAMPLES_PER_SECOND = 5000.0
START_DEG = 351.2
"""Device angle at which a turn starts."""
_PACKET = 40  # samples, at the most
_MOTOR = 0.01  # s from the command to the first sample; the motor turns already
INFO = bytes([0xA5, 0x5A, 0x14, 0, 0, 0, 0x04, 6, 10, 1, 1]) + bytes(range(16))
HEALTH = bytes([0xA5, 0x5A, 3, 0, 0, 0, 0x06, 0, 0, 0])
SCAN = bytes([0xA5, 0x5A, 0x05, 0, 0, 0x40, 0x81])
_STALLED = encode_packet(30.0, 30.2, np.full(_PACKET, 900.0))


def turn_packets(
    samples: Iterator[int], measure: Measure, begun: float, rate: float = SAMPLES_PER_SECOND, size: int = _PACKET
) -> Iterator[tuple[float, Callable[[], bytes]]]:
    """Cut turns into packets, as the lidar does.

    Parameters
    ----------
    samples : iterator of int
        How many samples each turn has; how fast the head turns, that is.
    measure : callable
        Asked only when a packet is made.
    begun : float
        Time of the first sample, s.
    rate : float
        Samples a second.
    size : int
        Samples of a packet; the one that starts a turn has one.

    Yields
    ------
    out : float
        When the packet's last byte is out, s.
    make : callable
        Measures, and gives the packet.
    """
    first = 0
    for number in samples:
        at = 0
        while at < number:
            end = min(at + (size if at else 1), number)
            index = np.arange(at, end, dtype=np.float64)
            times, degrees = begun + (first + index) / rate, START_DEG + 360.0 / number * index

            def make(times: Floats = times, degrees: Floats = degrees, start: bool = at == 0) -> bytes:
                return encode_packet(degrees[0], degrees[-1], measure(times, degrees), start=start)

            yield float(times[-1]) + (10 + 2 * (end - at)) * BYTE, make
            at = end
        first += number


class X4:
    """The lidar behind its serial line; changed in place.

    Parameters
    ----------
    measure : callable
        What it sees.
    samples : callable
        Gives how many samples the turns have from a scan's begin on, without end.
    rate : float
        Samples a second by its own clock.

    Attributes
    ----------
    scanning : bool
        False too after its power failed for a moment.
    begun : float or None
        When the first sample of the last scan was taken, s.
    commands : list of int
        What it was told.
    deaf, silent, stalled : bool
        It does not answer; it sends no sample; its head stands still.
    health : bytes
        What it answers when asked how it is.
    """

    def __init__(
        self, measure: Measure, samples: Callable[[], Iterator[int]], rate: float = SAMPLES_PER_SECOND
    ) -> None:
        self._measure, self._samples, self._rate = measure, samples, rate
        self.scanning = self.deaf = self.silent = self.stalled = False
        self.begun: float | None = None
        self.health = HEALTH
        self.commands: list[int] = []
        self._heard = b""
        self._stream: Iterator[tuple[float, Callable[[], bytes]]] = iter(())
        self._due = math.inf
        self._make: Callable[[], bytes] = bytes

    @property
    def due(self) -> float:
        """When the next bytes are out, s; infinite while it does not scan."""
        return self._due if self.scanning else math.inf

    def receive(self, data: bytes, now: float) -> bytes:
        """Take bytes from the driver and give the answer.

        Parameters
        ----------
        data : bytes
        now : float
            s.
        """
        self._heard += data
        answer = b""
        while (at := self._heard.find(b"\xa5")) >= 0 and len(self._heard) > at + 1:
            command, self._heard = self._heard[at + 1], self._heard[at + 2 :]
            self.commands.append(command)
            if not self.deaf:
                answer += self._obey(command, now)
        return answer

    def _obey(self, command: int, now: float) -> bytes:
        if command in (0x90, 0x91):
            return INFO if command == 0x90 else self.health
        if command in (0x65, 0x80):
            self.scanning = False
        elif command == 0x60 and not self.scanning:
            self.begin(now)
            return SCAN
        return b""

    def begin(self, now: float) -> None:
        """Begin to scan."""
        self.scanning, self.begun = True, now + _MOTOR
        self._stream = turn_packets(self._samples(), self._measure, self.begun, self._rate)
        self._due, self._make = next(self._stream)

    def advance(self, now: float) -> bytes:
        """Give the packets that are out by now.

        Parameters
        ----------
        now : float
            s.
        """
        out = b""
        while self.scanning and self._due <= now:
            if not self.silent:
                out += _STALLED if self.stalled else self._make()
            self._due, self._make = next(self._stream)
        return out
