"""What goes into a robot in the loop, and what comes out of it."""

from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from contourslam.config import Config, SlamConfig
from contourslam.errors import ConfigError
from contourslam.evaluation.errors import rmse
from contourslam.nearest import no_such
from contourslam.recordings.picture import Picture
from contourslam.robot.bring_up import Trouble
from contourslam.simulation.hardware.board import BoardError
from contourslam.simulation.hardware.live_world import Record
from contourslam.simulation.rooms import ROOMS
from contourslam.slam.result import RunResult

Floats = NDArray[np.float64]
Fault = Literal["none", "unplugged", "damaged"]
FAULTS: dict[Fault, str] = {
    "none": "nothing",
    "unplugged": "the lidar is unplugged for 3 s in the middle of the drive",
    "damaged": "5 % of all bytes on both serial lines are damaged, both ways, from the first metre on",
}
SETTINGS = Config(slam=SlamConfig(walls=True, contour_matching=True), back_end="graph")


@dataclass(frozen=True, slots=True)
class LoopConfig:
    """One drive of the whole robot."""

    seed: int = 1
    """Of all that chance decides."""
    room: str = "furnished_room"
    """One of the simulated rooms."""
    seconds: float = 100.0
    """How long it drives, s."""
    fault: Fault = "none"
    """What goes wrong."""
    speed: float = 0.3
    """m/s."""
    pictures: float = 1.0
    """Pictures a second; 0 for no camera."""
    settings: Config = field(default_factory=lambda: SETTINGS)
    """Of the mapping."""

    def __post_init__(self) -> None:
        if self.room not in ROOMS:
            raise ConfigError(no_such("room", self.room, ROOMS))
        if not self.seconds >= 5.0:
            raise ConfigError(f"LoopConfig.seconds must be at least 5, got {self.seconds!r}")


def fault_named(name: str) -> Fault:
    """Give the fault of a name.

    Raises
    ------
    ConfigError
        If there is none.
    """
    for fault in FAULTS:
        if fault == name:
            return fault
    raise ConfigError(no_such("fault", name, FAULTS))


@dataclass(frozen=True, slots=True)
class Firmware:
    """What ``make firmware`` builds."""

    board: Path
    """The program that simulates the board."""
    elf: Path
    """What the board executes."""

    @classmethod
    def built_in(cls, folder: Path) -> "Firmware":
        """Give what stands in the folder that it is built in.

        Raises
        ------
        BoardError
            If it is not there.
        """
        found = cls(folder / "board", folder / "mega.elf")
        for path in (found.board, found.elf):
            if not path.is_file():
                raise BoardError(f"{path} is not there: run make firmware, which docs/robot_in_the_loop.md tells about")
        return found


@dataclass(frozen=True, slots=True)
class Counters:
    """What the drivers counted.

    Attributes
    ----------
    packets, packets_failed : int
        Of the lidar.
    reconnections : int
        How often the lidar's port was opened anew.
    states, frames_refused : int
        Of the base: STATEs that came, and frames that came damaged.
    watchdog_stops, resets : int
        How often the base stopped by itself, and began anew.
    """

    packets: int
    packets_failed: int
    reconnections: int
    states: int
    frames_refused: int
    watchdog_stops: int
    resets: int


@dataclass(frozen=True, slots=True)
class LoopResult:
    """What came out.

    Attributes
    ----------
    config : LoopConfig
    settings : Config
        Of the mapping, as they were.
    run : RunResult
        With the true poses.
    record : Record
        What really happened, and how punctually.
    counters : Counters
    latencies : ndarray, shape (t,)
        From a scan's coming to its pose, s.
    busy : float
        CPU seconds of the robot's own computer for a second: drivers, mapping, steering.
    travelled : float
        m.
    troubles : tuple of Trouble
    pictures : tuple of Picture
        At most :data:`KEPT` of them, spread over the drive.
    picture_count : int
    """

    config: LoopConfig
    settings: Config
    run: RunResult
    record: Record
    counters: Counters
    latencies: Floats
    busy: float
    travelled: float
    troubles: tuple[Trouble, ...]
    pictures: tuple[Picture, ...]
    picture_count: int

    @property
    def online(self) -> dict[str, float]:
        """RMSE of the poses as they were known at the time, by which the robot drove: x, y (m), theta (rad)."""
        run = self.run
        return _rmse(run.poses if run.online_poses is None else run.online_poses, run.truth)

    @property
    def revised(self) -> dict[str, float]:
        """RMSE of the poses as the whole drive shows them."""
        return _rmse(self.run.poses, self.run.truth)

    @property
    def raw(self) -> dict[str, float]:
        """RMSE of the base's own odometry, wheels and gyroscope, from the same start."""
        return _rmse(self.run.odometry, self.run.truth)

    @property
    def late(self) -> float:
        """Share of the world's steps that were done more than 20 ms after their time."""
        return self.record.late / max(self.record.steps, 1)


KEPT = 8


def _rmse(poses: Floats, truth: Floats | None) -> dict[str, float]:
    assert truth is not None
    return asdict(rmse(poses, truth))
