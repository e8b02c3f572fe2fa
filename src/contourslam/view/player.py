"""A recording played through one or several back ends side by side, for those who watch."""

import math
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Sequence

import numpy as np

from contourslam.contour.contours import Contours, Floats
from contourslam.errors import ContourslamError
from contourslam.geometry.poses import between_one, compose_one, interpolate_one
from contourslam.landmarks import trace
from contourslam.replay import Message
from contourslam.scan import LaserScan, Odometry, TruePose
from contourslam.view.draughtsman import Draughtsman
from contourslam.view.knots import Knotter
from contourslam.view.lane import Lane
from contourslam.view.memory import Memory
from contourslam.view.moment import Moment, trace_of
from contourslam.view.pace import Pace

LARGE = 0.05  # m by which a loop must move the robot to be told of
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
    lanes : sequence of Lane
        Empty before the first scan.
    beams, returned : int
        Of the last scan.
    error : Exception or None
        What nobody foresaw; the thread has ended by it.
    """

    def __init__(
        self,
        messages: Iterable[Message],
        make_lanes: Callable[[Floats | None], Sequence[Lane]],
        memory: Memory,
        pace: Pace,
    ) -> None:
        super().__init__(name="player", daemon=True)
        self._messages, self._make, self._memory, self._pace = messages, make_lanes, memory, pace
        self.state, self.trouble = "starting", ""
        self.error: Exception | None = None
        self.lanes: Sequence[Lane] = ()
        self.beams = self.returned = 0
        self._draughtsman: Draughtsman | None = None
        self._knotter: Knotter | None = None
        self._waiting: list[Odometry] = []
        self._truth: deque[TruePose] = deque(maxlen=TRUTHS)
        self._scans, self._began, self._elapsed = 0, math.nan, 0.0
        self._first_odometry: Floats | None = None

    def run(self) -> None:
        """Play until the end, or until the pace says stop."""
        try:
            self._play()
        except Exception as error:  # told to whoever started the thread
            self.error, self.state, self.trouble = error, "failed", str(error) or repr(error)

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
        before = [len(lane.loops) for lane in self.lanes]
        done = tuple(lane.push_scan(scan, elapsed) for lane in self.lanes)
        contours = self._contours(scan)
        self.beams, self.returned = len(scan.ranges), len(contours.points)
        moment = Moment(
            self._scans,
            elapsed,
            time.monotonic(),
            trace_of(contours),
            self._odometry(),
            self._truth_at(scan.stamp),
            done,
        )
        self._scans += 1
        self._memory.add(moment)
        self._keep(moment, before)
        return True

    def _begin(self, scan: LaserScan) -> None:
        self._began = scan.stamp
        self.lanes = self._make(self._truth_at(scan.stamp))
        self._knotter = Knotter(self.lanes[0].mount)
        self._draughtsman = Draughtsman(self.lanes, self._memory)

    def _contours(self, scan: LaserScan) -> Contours:
        """Those that the first lane saw; all lanes differ in nothing but the detector."""
        lane = self.lanes[0]
        contours = lane.contours()
        return trace(scan, lane.config, T_base_lidar=lane.mount) if contours is None else contours

    def _odometry(self) -> Floats:
        mapper = self.lanes[0].mapper
        if self._first_odometry is None:
            self._first_odometry = np.array(mapper.odometry_pose)
        return compose_one(mapper.start_pose, between_one(self._first_odometry, np.array(mapper.odometry_pose)))

    def _truth_at(self, stamp: float) -> Floats | None:
        if not self._truth:
            return None
        rows = sorted(self._truth, key=lambda t: t.stamp)
        return interpolate_one(np.array([t.stamp for t in rows]), np.array([t.pose for t in rows]), stamp, True)

    def _keep(self, moment: Moment, loops_before: list[int]) -> None:
        """Note what is worth a place on the way, or in the list of events."""
        assert self._knotter is not None and self._draughtsman is not None
        knot = self._knotter.take(moment)
        if knot is not None and self._memory.add_knot(knot):
            self._knotter.spacing *= 2.0
        changed = knot is not None
        for number, (lane, before) in enumerate(zip(self.lanes, loops_before, strict=True)):
            moved = False
            for loop in lane.loops[before:]:
                shift = math.hypot(loop.shift[0], loop.shift[1])
                moved |= shift > LARGE
                if shift > LARGE or loop.method != "nearby":
                    self._memory.add_event(
                        moment.elapsed, "loop", f"loop by {loop.method}, {shift:.2f} m off", lane=number,
                        x=float(lane.last_pose[0]), y=float(lane.last_pose[1]), shift=shift,
                    )  # fmt: skip
            update = moment.lanes[number].update
            self._draughtsman.want(number, moved, changed or bool(update.born or update.dropped))
        self._draughtsman.work(moment.elapsed, idle=False)

    def _idle(self) -> bool:
        assert self._draughtsman is not None
        return self._draughtsman.work(self._elapsed, idle=True)

    def _finish(self) -> None:
        """Refine what can be, and draw the last maps."""
        assert self._draughtsman is not None
        self.state = "refining"
        for number, lane in enumerate(self.lanes):
            if self._pace.stopped:
                return
            if lane.mapper.finish() is not None:
                self._memory.add_event(self._elapsed, "refined", "the whole map was refined", lane=number)
            self._draughtsman.draw(number, self._elapsed)
        self.state = "finished"
        self._memory.add_event(self._elapsed, "finished", "the recording has ended")
