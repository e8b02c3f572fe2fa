"""When the next scan's turn comes: any speed, pause, step, and as fast as possible up to a time."""

import math
import threading
import time
from collections import deque
from collections.abc import Callable

SLOWEST, FASTEST = 0.01, 1e4
LONGEST_GAP = 10.0  # s in the recording; longer ones are passed over
BEHIND = 0.5  # s; one who is later than this does not try to make up for it
WINDOW = 3.0  # s over which the speed that is reached is told
NAP = 0.1  # s
ARRIVING = 8.0  # s in the recording


class Pace:
    """Says when to go on. One thread asks, any may set; no thread but the one that asks ever waits.

    Parameters
    ----------
    speed : float
        Seconds of the recording per second; infinite for as fast as possible.
    paused : bool
        Wait before the first scan.
    clock : callable

    Attributes
    ----------
    speed : float
    paused : bool
    pressed : bool
        The last scan did not have to wait for its turn: whoever maps has no time to spare.
    """

    def __init__(
        self, speed: float = 1.0, *, paused: bool = False, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self.speed, self.paused, self._clock = speed, paused, clock
        self._changed = threading.Condition()
        self._anchor: tuple[float, float] | None = None  # elapsed, and the time at which it was
        self._last = 0.0
        self._steps = 0
        self._hurry = -math.inf
        self._stopped = self.pressed = False
        self._reached: deque[tuple[float, float]] = deque(maxlen=200)

    # What people ask for.

    def pause(self) -> None:
        """Wait before the next scan."""
        with self._changed:
            self.paused, self._hurry = True, -math.inf
            self._changed.notify()

    def play(self) -> None:
        """Go on."""
        with self._changed:
            self.paused, self._anchor = False, None
            self._changed.notify()

    def set_speed(self, speed: float) -> None:
        """Go at this speed; beyond the slowest and the fastest, at those."""
        with self._changed:
            self.speed = min(max(speed, SLOWEST), FASTEST) if math.isfinite(speed) else math.inf
            self._anchor = None
            self._changed.notify()

    def step(self) -> None:
        """Let one scan through."""
        with self._changed:
            self._steps += 1
            self._changed.notify()

    def hurry(self, elapsed: float) -> None:
        """Let everything through up to a time, s since the first scan."""
        with self._changed:
            self._hurry = elapsed
            self._changed.notify()

    def stop(self) -> None:
        """Let nothing through any more."""
        with self._changed:
            self._stopped = True
            self._changed.notify()

    @property
    def stopped(self) -> bool:
        """Whether all is to end."""
        return self._stopped

    @property
    def hurries_to(self) -> float | None:
        """Up to where it goes as fast as it can; None where it does not."""
        return self._hurry if self._hurry > self._last else None

    def reached(self) -> float:
        """Speed of late: seconds of the recording per second."""
        rows, span = self._recent()
        return (rows[-1][0] - rows[0][0]) / span if rows else 0.0

    def rate(self) -> float:
        """Scans per second of late."""
        rows, span = self._recent()
        return (len(rows) - 1) / span if rows else 0.0

    def _recent(self) -> tuple[list[tuple[float, float]], float]:
        now = self._clock()
        rows = [row for row in self._reached.copy() if row[1] > now - WINDOW]
        return (rows, now - rows[0][1]) if len(rows) > 1 and now > rows[0][1] else ([], 0.0)

    # What the worker asks.

    def wait(self, elapsed: float, idle: Callable[[], bool]) -> bool:
        """Wait for the turn of a scan.

        Parameters
        ----------
        elapsed : float
            Of the scan, s since the first.
        idle : callable
            Does a piece of work that can wait and says whether there was any.

        Returns
        -------
        bool
            False where all is to end.
        """
        waited = False
        while True:
            with self._changed:
                left = self._left(elapsed)
                if self._stopped:
                    return False
                if left <= 0.0:
                    self._last, self.pressed = elapsed, not waited
                    self._reached.append((elapsed, self._clock()))
                    return True
            waited, self.pressed = True, False
            if idle():
                continue
            with self._changed:
                self._changed.wait(min(left, NAP))

    def arrives(self, elapsed: float) -> bool:
        """Whether it goes as fast as it can, and is about to be where it was to go."""
        return 0.0 <= self._hurry - elapsed < ARRIVING

    def rest(self) -> None:
        """Note that nothing more is to be mapped."""
        self.pressed = False

    def _left(self, elapsed: float) -> float:
        """Seconds to wait; a step that is used up is counted off."""
        now = self._clock()
        if elapsed <= self._hurry:
            self._anchor = None
            return 0.0
        self._hurry = -math.inf  # it is there
        if self._steps > 0:
            self._steps -= 1
            self._anchor = None
            return 0.0
        if self.paused:
            return math.inf
        if math.isinf(self.speed):
            return 0.0
        if self._anchor is None:
            self._anchor = (self._last if elapsed - self._last < LONGEST_GAP else elapsed), now
        due = self._anchor[1] + (elapsed - self._anchor[0]) / self.speed
        if due < now - BEHIND or elapsed - self._last >= LONGEST_GAP:
            self._anchor = elapsed, now
            return 0.0
        return due - now
