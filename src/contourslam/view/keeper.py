"""Keeps of each scan what can be looked at later: its moment, its place on the way, loops as events, maps."""

import math
import time
from collections.abc import Callable, Sequence

from contourslam.contour.contours import Contours, Floats
from contourslam.landmarks import trace
from contourslam.scan import LaserScan
from contourslam.slam.result import Loop
from contourslam.view.draughtsman import Draughtsman
from contourslam.view.knots import Knotter
from contourslam.view.lane import Lane
from contourslam.view.memory import Memory
from contourslam.view.moment import LaneMoment, Moment, trace_of

LARGE = 0.05  # m by which a loop must move the robot to be told of


def shift_of(loop: Loop) -> float:
    """Give how far off the robot was, m."""
    return math.hypot(loop.shift[0], loop.shift[1])


def is_told(loop: Loop) -> bool:
    """Whether whoever watches wants to know of it; ties to places just left come all the time."""
    return shift_of(loop) > LARGE or loop.method != "nearby"


class Keeper:
    """Writes the memory of what lanes make of the same scans; changed in place by each.

    Parameters
    ----------
    lanes : sequence of Lane
    memory : Memory
    clock : callable
        By which the draughtsman rests.

    Attributes
    ----------
    draughtsman : Draughtsman
    beams, returned : int
        Of the last scan.
    """

    def __init__(self, lanes: Sequence[Lane], memory: Memory, clock: Callable[[], float] = time.monotonic) -> None:
        self._lanes, self._memory = lanes, memory
        self._knotter = Knotter(lanes[0].mount)
        self.draughtsman = Draughtsman(lanes, memory, clock)
        self._told = [0] * len(lanes)  # loops
        self._scans = 0
        self.beams = self.returned = 0

    def keep(self, scan: LaserScan, elapsed: float, done: Sequence[LaneMoment], truth: Floats | None = None) -> Moment:
        """Keep one scan.

        Parameters
        ----------
        scan : LaserScan
        elapsed : float
            s; never less than that of the scan before.
        done : sequence of LaneMoment
            What the lanes said of it.
        truth : ndarray, shape (3,), optional
            The true pose.

        Returns
        -------
        Moment
            What was kept.
        """
        contours = self._contours(scan)
        self.beams, self.returned = len(scan.ranges), len(contours.points)
        moment = Moment(
            self._scans, elapsed, time.monotonic(), trace_of(contours), self._lanes[0].odometry(), truth, tuple(done)
        )
        self._scans += 1
        self._memory.add(moment)
        # Where the robot does not know its place, what it sees is not drawn into the building.
        knot = self._knotter.take(moment) if done[0].localized else None
        if knot is not None and self._memory.add_knot(knot):
            self._knotter.spacing *= 2.0
        for number, lane in enumerate(self._lanes):
            moved = self._tell_loops(number, lane, elapsed)
            update = done[number].update
            self.draughtsman.want(number, moved, knot is not None or bool(update.born or update.dropped))
        return moment

    def _contours(self, scan: LaserScan) -> Contours:
        """Those that the first lane saw; all lanes differ in nothing but the detector."""
        lane = self._lanes[0]
        contours = lane.contours()
        return trace(scan, lane.config, T_base_lidar=lane.mount) if contours is None else contours

    def _tell_loops(self, number: int, lane: Lane, elapsed: float) -> bool:
        """Note new loops among the events; True where one has moved the robot."""
        moved = False
        for loop in lane.loops[self._told[number] :]:
            shift = shift_of(loop)
            moved |= shift > LARGE
            if is_told(loop):
                self._memory.add_event(
                    elapsed, "loop", f"loop by {loop.method}, {shift:.2f} m off", lane=number,
                    x=float(lane.last_pose[0]), y=float(lane.last_pose[1]), shift=shift,
                )  # fmt: skip
        self._told[number] = len(lane.loops)
        return moved
