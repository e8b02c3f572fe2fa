"""A serial line: a pseudo-terminal behind a link, which can be unplugged, and which may damage bytes."""

import contextlib
import os
import tty
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Damage:
    """How a line damages bytes, each way.

    Attributes
    ----------
    share : float
        Of all bytes, how many are hit.
    burst : float
        How many bytes in a row are hit at a time, in the mean: 1 hits each on its own, the worst for packets; a
        motor's sparks and a full buffer hit some dozens in a row.
    lost : float
        Share of the bytes hit that never arrive; the others arrive as any other byte.
    """

    share: float = 0.0
    burst: float = 1.0
    lost: float = 0.0


class Noise:
    """Damages the bytes of one direction, and counts them; changed in place.

    Parameters
    ----------
    chance : numpy.random.Generator

    Attributes
    ----------
    damage : Damage
        May be changed at any time.
    passed, hit : int
        Bytes until now, and how many of them were damaged.
    """

    def __init__(self, chance: np.random.Generator) -> None:
        self.damage = Damage()
        self.passed = self.hit = 0
        self._chance = chance
        self._burst = 0  # bytes that the burst at hand will still hit

    def __call__(self, data: bytes) -> bytes:
        """Give what arrives of some bytes."""
        self.passed += len(data)
        if not (data and self.damage.share):
            return data
        values = np.frombuffer(data, np.uint8)
        hit = self._hits(values.size)
        self.hit += int(hit.sum())
        changed = (values + self._chance.integers(1, 256, values.size).astype(np.uint8)).astype(np.uint8)
        kept = ~(hit & (self._chance.random(values.size) < self.damage.lost))
        return np.where(hit, changed, values)[kept].tobytes()

    def _hits(self, count: int) -> NDArray[np.bool_]:
        share, burst = self.damage.share, max(self.damage.burst, 1.0)
        if burst == 1.0:
            return self._chance.random(count) < share
        hits, at = np.zeros(count, dtype=np.bool_), 0
        begins = min(share / (burst * (1.0 - share)), 1.0)  # chance that the next byte begins a burst
        while at < count:
            if not self._burst:
                at += int(self._chance.geometric(begins)) - 1
                self._burst = int(self._chance.geometric(1.0 / burst))
            length = min(self._burst, max(count - at, 0))
            hits[at : at + length] = True
            at, self._burst = at + length, self._burst - length
            if at >= count and length == 0:
                self._burst = 0  # the gap reaches beyond these bytes: it is drawn anew, which has no memory to lose
        return hits


class Line:
    """A device's end of a serial line; the other end is a pseudo-terminal that a driver opens by the link's name.

    Parameters
    ----------
    path : Path
        The link, such as ``lidar`` in a folder of its own.
    chance : numpy.random.Generator
        Draws what is damaged.

    Attributes
    ----------
    outward, inward : Noise
        What befalls bytes to the driver and from it.
    overrun : int
        Bytes that the driver did not fetch in time, or sent to nobody.
    """

    def __init__(self, path: Path, chance: np.random.Generator) -> None:
        self.path = path
        self.outward, self.inward = Noise(chance), Noise(chance)
        self.overrun = 0
        self._ends: tuple[int, int] | None = None
        self.plug()

    @property
    def plugged(self) -> bool:
        """Whether there is a port."""
        return self._ends is not None

    def damage(self, damage: Damage) -> None:
        """Damage bytes from now on, both ways."""
        self.outward.damage = self.inward.damage = damage

    def plug(self) -> None:
        """Plug the cable in: a new port under the same name."""
        if self._ends is not None:
            return
        master, slave = os.openpty()
        tty.setraw(slave)
        os.set_blocking(master, False)
        with contextlib.suppress(FileNotFoundError):
            self.path.unlink()
        self.path.symlink_to(os.ttyname(slave))
        self._ends = master, slave  # the slave stays open, or the master would fail while no driver has it

    def unplug(self) -> None:
        """Pull the cable out: the port is gone."""
        if self._ends is None:
            return
        with contextlib.suppress(FileNotFoundError):
            self.path.unlink()
        for end in self._ends:
            os.close(end)
        self._ends = None

    def send(self, data: bytes) -> None:
        """Send bytes to the driver; without a port, or with nobody to fetch them, they are lost."""
        data = self.outward(data)
        sent = 0
        if self._ends is not None and data:
            with contextlib.suppress(BlockingIOError):
                sent = os.write(self._ends[0], data)
        self.overrun += len(data) - sent

    def receive(self) -> bytes:
        """Give what the driver has sent since the last call."""
        if self._ends is None:
            return b""
        try:
            return self.inward(os.read(self._ends[0], 4096))
        except (BlockingIOError, OSError):
            return b""
