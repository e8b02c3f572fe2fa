"""Draws up the maps of all lanes, as seldom as must be for the mapping not to wait."""

import math
import time
from collections.abc import Callable, Sequence

from contourslam.view.lane import Lane
from contourslam.view.memory import Memory
from contourslam.view.wire import pack

PAUSE = 0.25  # s between two maps of one lane, at least
# So many times as long as it takes to draw a map, no other of the lane is drawn; the last is for a mapping that is
# to be as fast as it can.
REST, REST_LOOP, REST_IDLE, REST_PRESSED = 40.0, 5.0, 3.0, 80.0
LONGEST = 0.04  # s that a lane's first map counts for, at most: it may have waited for kernels


class Draughtsman:
    """Decides when a lane's map is drawn; changed in place.

    Parameters
    ----------
    lanes : sequence of Lane
    memory : Memory
        Where the maps go.
    clock : callable
    """

    def __init__(self, lanes: Sequence[Lane], memory: Memory, clock: Callable[[], float] = time.monotonic) -> None:
        self._lanes, self._memory, self._clock = lanes, memory, clock
        self._ended: list[float | None] = [None] * len(lanes)
        self._took = [0.0] * len(lanes)
        self._wanted, self._urgent = [False] * len(lanes), [False] * len(lanes)

    def want(self, lane: int, urgent: bool, wanted: bool) -> None:
        """Say that a lane's map has changed, or has moved as a whole, which is urgent."""
        self._urgent[lane] |= urgent
        self._wanted[lane] |= urgent or wanted

    def work(self, elapsed: float, *, idle: bool, pressed: bool = False) -> bool:
        """Draw one map where one is due; True where one was.

        Parameters
        ----------
        elapsed : float
            Time of the last scan, s.
        idle : bool
            No scan waits.
        pressed : bool
            The mapping has no time to spare.
        """
        now = self._clock()
        for number in range(len(self._lanes)):
            if not (self._wanted[number] and self._lanes[number].at_rest):
                continue
            ended, rest = self._ended[number], self._rest(number, idle, pressed)
            if ended is None or now >= ended + max(PAUSE, rest * self._took[number]):
                self.draw(number, elapsed)
                return True
        return False

    def catch_up(self, elapsed: float) -> None:
        """Draw all maps that have changed and can be drawn."""
        for number, lane in enumerate(self._lanes):
            if self._wanted[number] and lane.at_rest:
                self.draw(number, elapsed)

    def _rest(self, number: int, idle: bool, pressed: bool) -> float:
        if pressed:
            return REST_PRESSED
        return REST_LOOP if self._urgent[number] else REST_IDLE if idle else REST

    def draw(self, number: int, elapsed: float) -> None:
        """Draw a lane's map now."""
        began = self._clock()
        scans = self._memory.knot_scans()
        arrays = self._lanes[number].draw(scans)
        message = pack("map", {"lane": number}, arrays)
        self._memory.add_map(number, elapsed, len(scans), message)
        self._wanted[number] = self._urgent[number] = False
        now = self._clock()
        self._took[number] = min(now - began, LONGEST if self._ended[number] is None else math.inf)
        self._ended[number] = now
