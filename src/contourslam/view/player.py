"""A recording played through one or several back ends side by side, for those who watch."""

import math
import threading
from collections import deque
from collections.abc import Callable, Iterable, Sequence

import numpy as np

from contourslam.contour.contours import Floats
from contourslam.errors import ContourslamError
from contourslam.geometry.poses import interpolate_one
from contourslam.replay import Message
from contourslam.scan import LaserScan, Odometry, TruePose
from contourslam.view.fed_lane import FedLane
from contourslam.view.keeper import Keeper
from contourslam.view.memory import Memory
from contourslam.view.moment import Moment
from contourslam.view.pace import Pace

TRUTHS = 64  # true poses that are kept for the next scan


class Player(threading.Thread):
    """Works through the messages in a thread of its own; no reader of its memory ever makes it wait.

    Parameters
    ----------
    messages : iterable of LaserScan, Odometry or TruePose
    make_lanes : callable
        Given the pose at the first scan where it is known, else None, makes the lanes.
    memory : Memory
    pace : Pace

    Attributes
    ----------
    state : str
        "starting", "mapping", "refining", "finished", or "failed".
    trouble : str
        What ended the recording early.
    lanes : sequence of FedLane
        Empty before the first scan.
    error : Exception or None
        What nobody foresaw; the thread has ended by it.
    on_moment : callable
        Called with each moment and the lanes, in this thread; set before it starts.
    """

    def __init__(
        self,
        messages: Iterable[Message],
        make_lanes: Callable[[Floats | None], Sequence[FedLane]],
        memory: Memory,
        pace: Pace,
    ) -> None:
        super().__init__(name="player", daemon=True)
        self._messages, self._make, self._memory, self._pace = messages, make_lanes, memory, pace
        self.state, self.trouble = "starting", ""
        self.error: Exception | None = None
        self.lanes: Sequence[FedLane] = ()
        self.on_moment: Callable[[Moment, Sequence[FedLane]], None] = lambda moment, lanes: None
        self._keeper: Keeper | None = None
        self._waiting: list[Odometry] = []
        self._truth: deque[TruePose] = deque(maxlen=TRUTHS)
        self._began, self._elapsed = math.nan, 0.0

    @property
    def keeper(self) -> Keeper:
        """What keeps the scans, from the first one on."""
        assert self._keeper is not None
        return self._keeper

    def run(self) -> None:
        """Play until the end, or until the pace says stop."""
        try:
            self._play()
        except Exception as error:  # told to whoever started the thread
            self.error, self.state, self.trouble = error, "failed", str(error) or repr(error)
        finally:
            self._pace.rest()

    def _play(self) -> None:
        try:
            for message in self._messages:
                if self._pace.stopped:
                    return
                if isinstance(message, TruePose):
                    self._truth.append(message)
                elif isinstance(message, Odometry):
                    self._waiting.append(message)
                elif not self._scan(message):
                    return
        except ContourslamError as error:
            self.trouble = str(error)
            self._memory.add_event(self._elapsed, "trouble", self.trouble)
        if not self.lanes:
            self.state = "failed"
            self.trouble = self.trouble or "the recording holds no scan"
            return
        self._finish()

    def _scan(self, scan: LaserScan) -> bool:
        """Map one scan when its turn has come; False where all is to end."""
        if not self.lanes:
            self._begin(scan)
        elapsed = max(self._elapsed, scan.stamp - self._began)
        if not self._pace.wait(elapsed, self._idle):
            return False
        self.state, self._elapsed = "mapping", elapsed
        for lane in self.lanes:
            for reading in self._waiting:
                lane.push_odometry(reading)
        self._waiting.clear()
        done = tuple(lane.push_scan(scan, elapsed) for lane in self.lanes)
        self.on_moment(self.keeper.keep(scan, elapsed, done, self._truth_at(scan.stamp)), self.lanes)
        if self._pace.arrives(elapsed):  # who waits for this time wants its map, and a graph shows it now and then
            self.keeper.draughtsman.catch_up(elapsed)
        else:
            self.keeper.draughtsman.work(elapsed, idle=False, pressed=self._pace.pressed)
        return True

    def _begin(self, scan: LaserScan) -> None:
        self._began = scan.stamp
        self.lanes = self._make(self._truth_at(scan.stamp))
        self._keeper = Keeper(self.lanes, self._memory)

    def _truth_at(self, stamp: float) -> Floats | None:
        if not self._truth:
            return None
        rows = sorted(self._truth, key=lambda t: t.stamp)
        return interpolate_one(np.array([t.stamp for t in rows]), np.array([t.pose for t in rows]), stamp, True)

    def _idle(self) -> bool:
        return self.keeper.draughtsman.work(self._elapsed, idle=True)

    def _finish(self) -> None:
        """Refine what can be, and draw the last maps."""
        self.state = "refining"
        for number, lane in enumerate(self.lanes):
            if self._pace.stopped:
                return
            if lane.mapper.finish() is not None:
                self._memory.add_event(self._elapsed, "refined", "the whole map was refined", lane=number)
            self.keeper.draughtsman.draw(number, self._elapsed)
        self.state = "finished"
        self._memory.add_event(self._elapsed, "finished", "the recording has ended")
