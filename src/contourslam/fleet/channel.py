"""A way between robots and server that loses, delays and repeats messages by chance, for trying things out."""

import heapq
from dataclasses import dataclass

import numpy as np

from contourslam.errors import ConfigError


@dataclass(frozen=True, slots=True)
class Air:
    """How messages travel.

    Attributes
    ----------
    loss : float
        Part of the messages that never arrive.
    delay : float
        s that one takes at most; each takes its own time, so they overtake each other.
    repeat : float
        Part of the messages that arrive twice, each with a delay of its own.
    """

    loss: float = 0.0
    delay: float = 0.0
    repeat: float = 0.0

    def __post_init__(self) -> None:
        for name in ("loss", "repeat"):
            if not 0.0 <= getattr(self, name) < 1.0:
                raise ConfigError(f"{name} must lie from 0 up to below 1, got {getattr(self, name)!r}")
        if not 0.0 <= self.delay < 3600.0:
            raise ConfigError(f"delay must lie from 0 to an hour, got {self.delay!r} s")


class Channel:
    """Messages from one end to the other; changed in place.

    Parameters
    ----------
    air : Air
    chance : numpy.random.Generator

    Attributes
    ----------
    messages, size : int
        Sent so far, and their bytes, the lost ones too.
    """

    def __init__(self, air: Air, chance: np.random.Generator) -> None:
        self._air, self._chance = air, chance
        self._flying: list[tuple[float, int, bytes]] = []
        self._count = 0
        self.messages = self.size = 0

    def send(self, now: float, data: bytes) -> None:
        """Let a message set out at `now` (s)."""
        self.messages += 1
        self.size += len(data)
        for _ in range(1 + (self._chance.random() < self._air.repeat)):
            if self._chance.random() >= self._air.loss:
                self._count += 1
                heapq.heappush(self._flying, (now + self._air.delay * self._chance.random(), self._count, data))

    def arrived(self, now: float) -> list[bytes]:
        """Give what has arrived by `now`, in the order of its arrival."""
        out = []
        while self._flying and self._flying[0][0] <= now:
            out.append(heapq.heappop(self._flying)[2])
        return out
