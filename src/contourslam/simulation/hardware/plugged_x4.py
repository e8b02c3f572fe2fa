"""An X4 on a pseudo-terminal at the pace of the wall clock, with a thread of its own: to try a driver against."""

import threading
import time
from collections.abc import Callable, Iterator
from itertools import repeat
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from contourslam.closing import Closing
from contourslam.robot.lidar.x4_packets import correction_deg
from contourslam.simulation.hardware.line import Damage, Line
from contourslam.simulation.hardware.x4 import SAMPLES_PER_SECOND, X4

Floats = NDArray[np.float64]
_TICK = 0.002  # s


def square_room(bearing: Floats) -> Floats:
    """Range (m) counter-clockwise bearing by bearing in a room of 4 m by 6 m, 1.5 m from its rear wall."""
    c, s = np.cos(bearing), np.sin(bearing)
    with np.errstate(divide="ignore"):
        return np.asarray(np.minimum.reduce([np.where(c > 0, 4.5 / c, -1.5 / c), np.where(s > 0, 2.0 / s, -2.0 / s)]))


def measured(raw_deg: Floats, ranges: Callable[[Floats], Floats]) -> Floats:
    """Distance (mm) that belongs to each uncorrected device angle: where angle and distance agree."""
    mm = np.full(raw_deg.shape, 2000.0)
    for _ in range(30):
        mm = 1000.0 * ranges(-np.radians(raw_deg + correction_deg(mm)))
    return np.asarray(np.rint(mm))


class PluggedX4(Closing):
    """A lidar that stands still in a room; a context manager.

    Parameters
    ----------
    path : Path
        Link to its port.
    ranges : callable
        From bearings (rad, counter-clockwise) to ranges (m).
    rate : float
        Turns a second.

    Attributes
    ----------
    lidar : X4
        Its faults may be switched while it runs.
    line : Line
    garbage : bool
        It sends at another speed: nothing of it makes sense.
    """

    def __init__(self, path: Path, ranges: Callable[[Floats], Floats] = square_room, *, rate: float = 7.0) -> None:
        self.line = Line(path, np.random.default_rng(1))
        samples = round(SAMPLES_PER_SECOND / rate)
        # Standing still, it sees the same in every turn.
        seen: dict[bytes, Floats] = {}

        def measure(times: Floats, degrees: Floats) -> Floats:
            key = degrees.tobytes()
            if key not in seen:
                seen[key] = measured(degrees, ranges)
            return seen[key]

        def turns() -> Iterator[int]:
            return repeat(samples)

        self.lidar = X4(measure, turns)
        self.garbage = False
        self._chance = np.random.default_rng(2)
        self._running = threading.Event()
        self._running.set()
        self._mutex = threading.Lock()  # held while the line is plugged, unplugged or used
        self._thread = threading.Thread(target=self._run, name="X4", daemon=True)
        self._thread.start()

    def plug(self) -> None:
        """Plug it in again: idle, as after power on."""
        with self._mutex:
            self.lidar.scanning = False
            self.line.plug()

    def unplug(self) -> None:
        """Pull its cable out."""
        with self._mutex:
            self.line.unplug()

    def reboot(self) -> None:
        """Take its power away for a moment: it is idle afterwards."""
        self.lidar.scanning = False

    def damage(self, share: float, burst: float = 1.0) -> None:
        """Damage a share of the bytes that it sends from now on; commands pass."""
        self.line.outward.damage = Damage(share, burst)

    def close(self) -> None:
        """End the thread and close the port."""
        self._running.clear()
        self._thread.join()
        self.line.unplug()

    def _run(self) -> None:
        while self._running.is_set():
            with self._mutex:
                if self.line.plugged:
                    now = time.time()
                    self._send(self.lidar.receive(self.line.receive(), now))
                    self._send(self.lidar.advance(now))
            time.sleep(_TICK)

    def _send(self, data: bytes) -> None:
        if self.garbage:
            data = self._chance.integers(0, 128, len(data), dtype=np.uint8).tobytes()
        self.line.send(data)
