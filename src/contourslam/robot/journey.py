"""A drive from first scan to last: what the parts say goes to the map and the recording, the twist to the base."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from contourslam.errors import RecordingError
from contourslam.recordings.base_readings import BaseReading
from contourslam.recordings.picture import Picture
from contourslam.recordings.writer import RecordingWriter
from contourslam.robot.base.odometry import arc
from contourslam.robot.base.states import BaseState
from contourslam.robot.bring_up import Event, Robot, Stopped, Trouble
from contourslam.robot.lidar.even_beams import even_beams
from contourslam.robot.live_map import LiveMap
from contourslam.scan import LaserScan, Odometry

CONTROL = 0.02
"""Between two commands to the base, s."""
_SECTOR_DEG, _SECTORS = 10.0, 12  # so many sectors with something in them make a scan that is mapped
_SILENT = 1.0  # s without a word of the base, after which nobody knows where the robot is now
_LEAST_BEAMS = 3  # a scan of fewer, as a damaged line leaves, cannot be put on even beams
Twist = tuple[float, float]
Steer = Callable[["Sight", float], Twist]
"""From what the robot knows, and the time since it was asked last (s), to speed ahead (m/s) and turn rate (rad/s)."""


@dataclass(frozen=True, slots=True)
class Sight:
    """What the robot knows of itself now.

    Attributes
    ----------
    pose : tuple of (float, float, float), or None
        m, m, rad in the map, now: from the last word of the base on as it moved then; None where it does not know, or
        the base has been silent for too long.
    sigma : float
        Standard deviation of its position at the last scan, m.
    blind : float
        Time since the last scan came, or since one was mapped, whichever is longer, s.
    """

    pose: tuple[float, float, float] | None
    sigma: float
    blind: float


def looks_around(scan: LaserScan) -> bool:
    """Whether a scan sees enough of the surroundings to be of use; on a damaged line some turns are nearly empty."""
    with np.errstate(invalid="ignore"):
        hits = (scan.ranges >= scan.range_min) & (scan.ranges < scan.range_max)
    return len(np.unique(np.floor(np.degrees(scan.angles[hits]) / _SECTOR_DEG))) >= _SECTORS


class Journey:
    """Takes the robot's events and steers it; changed by every event.

    Parameters
    ----------
    robot : Robot
    live_map : LiveMap
    writer : RecordingWriter, optional
        Where all is recorded.
    watch : callable
        Shown each event after it was taken.

    Attributes
    ----------
    troubles : list of Trouble
        All that went wrong, and came right again.
    scans, states, pictures : int
        How many came.
    """

    def __init__(
        self,
        robot: Robot,
        live_map: LiveMap,
        writer: RecordingWriter | None = None,
        *,
        watch: Callable[[Event], None] = lambda event: None,
    ) -> None:
        self._robot, self._map, self._writer, self._watch = robot, live_map, writer, watch
        self.troubles: list[Trouble] = []
        self.scans = self.states = self.pictures = 0
        self._scanned = time.monotonic()
        self._state: BaseState | None = None

    def go(self, steer: Steer, stopped: Stopped) -> None:
        """Drive until told to stop; the motors are off afterwards.

        Parameters
        ----------
        steer : callable
        stopped : callable
            Asked at each command.
        """
        try:
            asked = time.monotonic()
            while not stopped():
                event = self._robot.next(CONTROL)
                if event is not None:
                    self.take(event)
                now = time.monotonic()
                if now - asked >= CONTROL:
                    self._robot.drive(*steer(self.sight(), now - asked))
                    asked = now
        finally:
            self._robot.stop()

    def sight(self) -> Sight:
        """Say what the robot knows now."""
        last = self._map.last
        sigma = 0.0 if last is None else math.sqrt(max(float(last.covariance[0, 0] + last.covariance[1, 1]), 0.0))
        localized = last is not None and last.localized
        blind = max(time.monotonic() - self._scanned, self._map.since_mapped)
        return Sight(self._pose_now() if localized else None, sigma, blind)

    def _pose_now(self) -> tuple[float, float, float] | None:
        pose, state = self._map.pose(), self._state
        if pose is None or state is None:
            return None
        age = max(time.time() - state.stamp, 0.0)
        if age > _SILENT:
            return None
        way = arc(np.array(pose), state.odometry.speed * age, 0.0, state.odometry.turn_rate * age)
        x, y, heading = way.tolist()
        return x, y, heading

    def take(self, event: Event) -> None:
        """Take in an event."""
        if isinstance(event, LaserScan):
            self.scans += 1
            if looks_around(event):
                self._scanned = time.monotonic()
                self._map.push(event)
            self._record(even_beams(event))
        elif isinstance(event, BaseState):
            self.states, self._state = self.states + 1, event
            reading = event.odometry.reading()
            self._map.push(reading)
            self._record(reading)
            self._record(event.wheels())
            if (inertial := event.inertial()) is not None:
                self._record(inertial)
        elif isinstance(event, Picture):
            self.pictures += 1
            self._record(event)
        else:
            self.troubles.append(event)
        self._watch(event)

    def _record(self, message: LaserScan | Odometry | Picture | BaseReading) -> None:
        """Record a message; a recording that fails ends, and the drive goes on."""
        if self._writer is None or (isinstance(message, LaserScan) and message.ranges.size < _LEAST_BEAMS):
            return
        try:
            self._writer.write(message)
        except RecordingError as error:
            self._writer = None
            self.troubles.append(Trouble(message.stamp, "recording", str(error)))
