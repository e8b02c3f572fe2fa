"""Scans paired with the odometry that covers them: in any order in, in order out, nothing lost without a count."""

import math
from collections import deque
from dataclasses import dataclass

from contourslam.config import LiveConfig
from contourslam.live.events import Incident, Reason, Released, Source, TimeJump
from contourslam.live.tally import Tally
from contourslam.live.timeline import Timeline, Verdict
from contourslam.scan import LaserScan, Odometry

KEPT = 2000  # readings: more than any scan needs, should scans stop while odometry goes on
_REASONS = {
    Verdict.REPEATED: Reason.REPEATED,
    Verdict.OUT_OF_ORDER: Reason.OUT_OF_ORDER,
    Verdict.BEFORE_JUMP: Reason.BEFORE_JUMP,
}


@dataclass(frozen=True, slots=True)
class _Waiting:
    scan: LaserScan
    end: float  # of the odometry that covers it
    arrived: float


class Synchroniser:
    """Scans and odometry go in as they come; a scan comes out once its odometry is there, or the wait is over.

    It reads no clock: `now` is the caller's, in s, and should be one that nobody sets (``time.monotonic``); where it
    runs back it is taken to stand still. Stamps are the sensors' own and are compared with each other alone.

    A scan waits for odometry at most `wait`; not at all once none has come for `wait` since the first scan, or none for
    `silent_after` while scans came. It is then released without, and :attr:`Released.without` says why and by how much
    the odometry is late. No more than `max_waiting` scans wait for odometry, and twice as many in all: beyond the
    former the oldest is released without odometry, beyond the latter it is dropped.

    A message stamped before the one before it is dropped. Where time ran back for good (:class:`Timeline`), what still
    waits is dropped, and :meth:`take` gives a :class:`TimeJump` before anything newer.

    Parameters
    ----------
    config : LiveConfig
    odometry_lag : float
        The odometry that belongs to a scan is stamped this much earlier, s.

    Attributes
    ----------
    tally : Tally
        What was dropped, or released without odometry, by reason.
    """

    def __init__(self, config: LiveConfig, *, odometry_lag: float = 0.0) -> None:
        self._config = config
        self._lag = odometry_lag
        self.tally = Tally()
        self._now = -math.inf
        self._scans_since = math.nan  # arrival of the first scan of an unbroken run
        self._last_scan = self._last_reading = -math.inf  # arrivals
        self._timeline = Timeline(config.jump_back, config.silent_after)
        self._readings: deque[Odometry] = deque(maxlen=KEPT)
        # Stamps of the readings since the odometry's clock was last set, whether or not they have been handed on.
        self._first, self._newest = math.inf, -math.inf
        self._waiting: deque[_Waiting] = deque()
        self._ready: deque[_Waiting] = deque()
        self._jump: TimeJump | None = None

    def clear(self) -> None:
        """Forget what waits and how far time has come; what was counted stays."""
        self._timeline = Timeline(self._config.jump_back, self._config.silent_after)
        self._forget()
        self._jump = None

    def push_odometry(self, odometry: Odometry, now: float) -> None:
        """Take in one reading; of several with one stamp the last counts.

        Parameters
        ----------
        odometry : Odometry
        now : float
            s.
        """
        self._now = max(self._now, now)
        if self._accept("odometry", odometry.stamp):
            if self._readings and self._readings[-1].stamp == odometry.stamp:
                self._readings.pop()
            self._readings.append(odometry)
            leap = odometry.stamp - self._newest - max(self._now - self._last_reading, 0.0)
            if self._newest == -math.inf or leap > self._config.jump_back:  # the latter is a clock set forward
                self._first = odometry.stamp
            self._newest = odometry.stamp
            self._last_reading = self._now
        self._move_on()

    def push_scan(self, scan: LaserScan, now: float) -> None:
        """Take in one scan.

        Parameters
        ----------
        scan : LaserScan
        now : float
            s.
        """
        self._now = max(self._now, now)
        if self._accept("scan", scan.stamp):
            if not self._now - self._last_scan <= self._config.silent_after:
                self._scans_since = self._now
            self._last_scan = self._now
            duration = float(scan.offsets.max()) if scan.offsets.size else 0.0
            end = scan.stamp + max(duration, 0.0) - self._lag - self._config.odometry_slack
            self._waiting.append(_Waiting(scan, end, self._now))
        self._move_on()

    def drop(self, source: Source, reason: Reason, stamp: float, now: float, detail: str = "") -> None:
        """Count a message that is not even tried: not valid, or not wanted now.

        Parameters
        ----------
        source : "scan" or "odometry"
        reason : Reason
        stamp : float
            s; NaN where it has none.
        now : float
            s.
        detail : str
            What is wrong with it, for people.
        """
        self._now = max(self._now, now)
        self._count(source, reason, stamp, 0.0, detail)

    def take(self, now: float) -> Released | TimeJump | None:
        """Give what comes next, or None where nothing is due yet.

        Parameters
        ----------
        now : float
            s.
        """
        self._now = max(self._now, now)
        self._move_on()
        if self._jump is not None:
            jump, self._jump = self._jump, None
            return jump
        if not self._ready:
            return None
        next_ = self._ready.popleft()
        without = self._lacking(next_)
        if without is not None:
            self.tally.add(without)
        readings: tuple[Odometry, ...] = ()
        if not self._begins_after(next_):
            readings = tuple(self._readings)
            self._readings.clear()
        return Released(next_.scan, readings, next_.arrived, self._now, without)

    def due(self, now: float) -> float | None:
        """Give the time until :meth:`take` has something even if nothing more comes, s; None where it never will."""
        if self._jump is not None or self._ready:
            return 0.0
        if not self._waiting:
            return None
        return max(self._waits_until(self._waiting[0]) - max(self._now, now), 0.0)

    def _accept(self, source: Source, stamp: float) -> bool:
        """Whether a message is the next of its stream; if not, it is counted here."""
        verdict, behind = self._timeline.judge(source, stamp, self._now)
        jump = self._timeline.jump
        if jump is not None:
            # Several jumps that nobody has taken yet are one.
            self._jump = jump if self._jump is None else TimeJump(source, self._jump.before, jump.after, self._now)
            for waiting in (*self._ready, *self._waiting):
                self._count("scan", Reason.BEFORE_JUMP, waiting.scan.stamp, self._now - waiting.arrived)
            self._forget()
        if verdict is Verdict.REPEATED and source == "odometry":
            self._count(source, Reason.REPLACED, stamp, 0.0)
            return True
        if verdict is not Verdict.NEXT:
            self._count(source, _REASONS[verdict], stamp, behind)
            return False
        return True

    def _forget(self) -> None:
        self._waiting.clear()
        self._ready.clear()
        self._readings.clear()
        self._first, self._newest = math.inf, -math.inf

    def _begins_after(self, waiting: _Waiting) -> bool:
        """Whether all odometry was taken long after a scan, which can only be another clock's."""
        return waiting.scan.stamp - self._lag + self._config.jump_back < self._first < math.inf

    def _waits_until(self, waiting: _Waiting) -> float:
        config = self._config
        if self._last_reading == -math.inf:
            gives_up = self._scans_since + config.wait
        else:
            gives_up = max(self._last_reading, self._scans_since) + config.silent_after
        return min(waiting.arrived + config.wait, gives_up)

    def _move_on(self) -> None:
        """Let those scans through that need not wait for odometry any longer."""
        while self._waiting:
            first = self._waiting[0]
            crowded = len(self._waiting) > self._config.max_waiting
            if not (crowded or self._newest >= first.end or self._waits_until(first) <= self._now):
                return
            self._ready.append(self._waiting.popleft())
            if len(self._ready) + len(self._waiting) > 2 * self._config.max_waiting:
                oldest = self._ready.popleft()
                self._count("scan", Reason.TOO_SLOW, oldest.scan.stamp, self._now - oldest.arrived)

    def _lacking(self, waiting: _Waiting) -> Incident | None:
        """Say what of the odometry a scan lacks; None where it has all."""
        config, stamp = self._config, waiting.scan.stamp
        late = waiting.end - self._newest
        if self._last_reading == -math.inf:
            silent = self._now - self._scans_since
            return self._incident("scan", Reason.ODOMETRY_MISSING, stamp, silent)
        if self._begins_after(waiting):
            return self._incident("scan", Reason.CLOCKS_DIFFER, stamp, self._first - stamp)
        if late <= 0.0:
            return None
        silent = self._now - self._last_reading
        if silent >= config.silent_after:
            return self._incident("scan", Reason.ODOMETRY_STOPPED, stamp, silent)
        if math.inf > late >= config.jump_back:
            return self._incident("scan", Reason.CLOCKS_DIFFER, stamp, late)
        late = late if late < math.inf else self._now - waiting.arrived
        return self._incident("scan", Reason.ODOMETRY_LATE, stamp, late)

    def _count(self, source: Source, reason: Reason, stamp: float, delay: float, detail: str = "") -> None:
        self.tally.add(self._incident(source, reason, stamp, delay, detail))

    def _incident(self, source: Source, reason: Reason, stamp: float, delay: float, detail: str = "") -> Incident:
        return Incident(source, reason, stamp, self._now, delay, detail)
