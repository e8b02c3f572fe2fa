"""Everything that has been drawn, so that any moment is there at once; within a budget, by keeping every second one."""

import bisect
import threading
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contourslam.view.knots import Knot
from contourslam.view.moment import Moment

MOMENTS, MAPS = 160 << 20, 48 << 20  # bytes
KNOTS, EVENTS = 12_000, 2_000


@dataclass(frozen=True, slots=True)
class MapDrawn:
    """A lane's map at one moment.

    Attributes
    ----------
    number : int
        Counts those of its lane, from 1.
    elapsed : float
        s.
    knots : int
        How many knots have a revised pose in it.
    message : bytes
        For the page.
    """

    number: int
    elapsed: float
    knots: int
    message: bytes


class Memory:
    """Moments, knots, maps and events; one thread adds, any reads.

    Parameters
    ----------
    lanes : int
    moments, maps : int
        Bytes that these may take. Where they take more, every second one is given up, and from then on every second
        new one.
    knots : int
        How many knots at most; likewise.

    Attributes
    ----------
    epoch : int
        Grows where knots are given up: those who have them must ask for all of them anew.
    """

    def __init__(self, lanes: int, *, moments: int = MOMENTS, maps: int = MAPS, knots: int = KNOTS) -> None:
        self._lock = threading.Lock()
        self._most_moments, self._most_maps, self._most_knots = moments, maps, knots
        self._drawn = [0] * lanes
        self._events: list[dict[str, Any]] = []
        self._lost_events = 0
        self.epoch = -1
        self.clear()

    def clear(self) -> None:
        """Forget all but the events: what is known by now lies in another map."""
        with self._lock:
            self._moments: list[Moment] = []
            self._times: list[float] = []
            self._newest: Moment | None = None
            self._stride, self._bytes = 1, 0
            self._knots: list[Knot] = []
            self._maps: list[list[MapDrawn]] = [[] for _ in self._drawn]
            self._latest_map: list[MapDrawn | None] = [None] * len(self._drawn)
            self._map_stride, self._map_bytes = 1, 0
            self.epoch += 1

    # Adding.

    def add(self, moment: Moment) -> None:
        """Take in a moment; the newest is always there."""
        with self._lock:
            self._newest = moment
            if moment.index % self._stride:
                return
            self._moments.append(moment)
            self._times.append(moment.elapsed)
            self._bytes += moment.bytes
            if self._bytes > self._most_moments:
                self._stride *= 2
                self._moments = [m for m in self._moments if m.index % self._stride == 0]
                self._times = [m.elapsed for m in self._moments]
                self._bytes = sum(m.bytes for m in self._moments)

    def add_knot(self, knot: Knot) -> bool:
        """Take in a knot; True where every second one had to be given up."""
        with self._lock:
            self._knots.append(knot)
            if len(self._knots) <= self._most_knots:
                return False
            self._knots = self._knots[::2]
            for maps in self._maps:  # their paths are those of knots that are gone
                maps.clear()
            self._latest_map = [None] * len(self._maps)
            self._map_bytes = 0
            self.epoch += 1
            return True

    def add_map(self, lane: int, elapsed: float, knots: int, message: bytes) -> None:
        """Take in a map; the newest is always there."""
        with self._lock:
            self._drawn[lane] += 1
            drawn = MapDrawn(self._drawn[lane], elapsed, knots, message)
            self._latest_map[lane] = drawn
            if self._drawn[lane] % self._map_stride:
                return
            self._maps[lane].append(drawn)
            self._map_bytes += len(message)
            if self._map_bytes > self._most_maps:
                self._map_stride *= 2
                self._maps = [maps[::2] for maps in self._maps]
                self._map_bytes = sum(len(m.message) for maps in self._maps for m in maps)

    def add_event(self, elapsed: float, what: str, text: str, **more: Any) -> None:
        """Take in something that happened; the oldest are forgotten."""
        with self._lock:
            self._events.append({"elapsed": elapsed, "what": what, "text": text, **more})
            if len(self._events) > EVENTS:
                del self._events[: EVENTS // 4]
                self._lost_events += EVENTS // 4

    # Asking.

    @property
    def newest(self) -> Moment | None:
        """The newest moment."""
        return self._newest

    def at(self, elapsed: float) -> Moment | None:
        """Give the last moment until then; the first where there is none; None where there are none at all."""
        with self._lock:
            if self._newest is not None and elapsed >= self._newest.elapsed:
                return self._newest
            if not self._moments:
                return self._newest
            return self._moments[max(bisect.bisect_right(self._times, elapsed) - 1, 0)]

    def beside(self, moment: Moment, by: int) -> Moment:
        """Give the moment so many after (before where negative) another; the outermost where there are too few."""
        with self._lock:
            place = bisect.bisect_left([m.index for m in self._moments], moment.index) + by
            if place >= len(self._moments):
                return self._newest or moment
            return self._moments[max(place, 0)]

    def map_at(self, lane: int, elapsed: float) -> MapDrawn | None:
        """Give the last map drawn until then, else the first; the newest where the time is now."""
        with self._lock:
            newest = self._latest_map[lane]
            if newest is None or newest.elapsed <= elapsed:
                return newest
            maps = self._maps[lane]
            if not maps:
                return newest
            return maps[max(bisect.bisect_right(maps, elapsed, key=lambda m: m.elapsed) - 1, 0)]

    def knots(self, first: int, last: int | None = None) -> list[Knot]:
        """Give knots by their place."""
        with self._lock:
            return self._knots[first:last]

    def knot_scans(self) -> NDArray[np.int64]:
        """Scans that are knots, shape (k,)."""
        with self._lock:
            return np.array([knot.index for knot in self._knots], dtype=np.int64)

    def knots_until(self, index: int) -> int:
        """How many knots there are up to a scan."""
        with self._lock:
            return bisect.bisect_right(self._knots, index, key=lambda knot: knot.index)

    def events(self, first: int) -> tuple[int, list[dict[str, Any]]]:
        """Give what happened from number `first` on, and the number of the next."""
        with self._lock:
            at = max(first - self._lost_events, 0)
            return self._lost_events + len(self._events), self._events[at:]
