"""How the robot's parts are, for those who watch it: what is missing, what is wrong, and what to do about it."""

import time
from collections.abc import Callable

from contourslam.live.diagnostics import Diagnostic, Level
from contourslam.recordings.picture import Picture
from contourslam.robot.base.health import BaseHealth, base_values, motion_words
from contourslam.robot.base.mega import MegaBase
from contourslam.robot.base.states import BaseState
from contourslam.robot.bring_up import READY, Event, PartName, Robot
from contourslam.robot.lidar.ydlidar_x4 import YdlidarX4
from contourslam.scan import LaserScan

# s without a turn of the lidar, or without a picture, that are worth a word; the former come six times a second or
# more, and of the latter as few as one in some seconds may be wanted.
TURNS, PICTURES = 2.0, 10.0
CHECK = "check its plug, its cable and its power"


class RobotHealth:
    """Watches the robot's events; asked from another thread, it never waits. Made as the robot is started.

    Parameters
    ----------
    robot : Robot
    driven : bool
        Commands go to the base all the time.
    clock : callable
        One that nobody sets, s.
    """

    def __init__(self, robot: Robot, *, driven: bool, clock: Callable[[], float] = time.monotonic) -> None:
        self._robot, self._driven, self._clock = robot, driven, clock
        self._base, self._began = BaseHealth(), clock()
        self._heard: dict[PartName, float] = {}
        self._counts: dict[PartName, int] = {}

    def watch(self, event: Event) -> None:
        """Take in what a part said."""
        if isinstance(event, LaserScan):
            self._count("lidar")
        elif isinstance(event, BaseState):
            self._count("base")
            self._base.take(event)
        elif isinstance(event, Picture):
            self._count("camera")

    def _count(self, part: PartName) -> None:
        self._heard[part] = self._clock()
        self._counts[part] = self._counts.get(part, 0) + 1

    def __call__(self) -> tuple[Diagnostic, ...]:
        """Say how each part is."""
        troubles = self._robot.troubles
        how = {"lidar": self._lidar, "base": self._of_base, "camera": self._camera}
        return tuple(
            Diagnostic(Level.ERROR, part, troubles[part]) if part in troubles else how[part]()
            for part in self._robot.parts
        )

    def _silent(self, part: PartName) -> float:
        """Time since a part spoke, or since the start, s."""
        return self._clock() - self._heard.get(part, self._began)

    def _too_long(self, part: PartName, seconds: float) -> bool:
        """Whether a part has been silent for that long; one that has never spoken may have to be started first."""
        return self._silent(part) > (seconds if part in self._heard else READY)

    def _lidar(self) -> Diagnostic:
        lidar, values = self._robot.lidar, {"turns": str(self._counts.get("lidar", 0))}
        message = "it turns" if "lidar" in self._heard else "starting"
        if isinstance(lidar, YdlidarX4):
            parser = lidar.turns.parser
            values |= {
                "packets": str(parser.good),
                "damaged packets": str(parser.bad),
                "opened anew": str(lidar.reconnections),
            }
            message += f", {parser.bad / max(parser.good + parser.bad, 1):.1%} of its packets damaged"
        if self._too_long("lidar", TURNS):
            message = f"no turn of the lidar for {self._silent('lidar'):.1f} s; {CHECK}"
            return Diagnostic(Level.WARN, "lidar", message, values)
        return Diagnostic(Level.OK, "lidar", message, values)

    def _of_base(self) -> Diagnostic:
        base, state = self._robot.base, self._base.state
        if state is None and self._too_long("base", READY):
            return Diagnostic(Level.WARN, "base", f"no word from the base for {self._silent('base'):.1f} s; {CHECK}")
        if state is None:
            return Diagnostic(Level.OK, "base", "starting")
        values = base_values(base, state) if isinstance(base, MegaBase) else {}
        if warnings := self._base.warnings(self._silent("base"), driven=self._driven):
            return Diagnostic(Level.WARN, "base", "; ".join(warnings), values)
        battery = "" if state.battery is None else f", battery {state.battery:.1f} V"
        return Diagnostic(Level.OK, "base", motion_words(state) + battery, values)

    def _camera(self) -> Diagnostic:
        number = self._counts.get("camera", 0)
        message = f"{number} picture{'s' * (number > 1)}" if number else "starting"
        if "camera" in self._robot.ended:
            return Diagnostic(Level.OK, "camera", f"{message}, and no more are kept")
        if self._too_long("camera", PICTURES):
            silent = self._silent("camera")
            return Diagnostic(Level.WARN, "camera", f"no picture for {silent:.1f} s; check its plug and its cable")
        return Diagnostic(Level.OK, "camera", message)
