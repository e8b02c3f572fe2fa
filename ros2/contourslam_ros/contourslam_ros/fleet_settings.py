"""The parameters of the node ``fleet_server``."""

import math
from dataclasses import dataclass
from pathlib import Path

from contourslam.errors import ConfigError
from contourslam.fleet.wire import NAME


@dataclass(frozen=True, slots=True)
class FleetConfig:
    """What the server of a fleet is told."""

    folder: str = ""
    """All that robots have told is kept here, and taken up again when the node starts; must be given."""
    common_frame: str = "common_map"
    """Frame of a map that robots share; its number is put after it. As the robots have it."""
    tick_period: float = 0.2
    """What has come is worked up this often, s."""
    answer_period: float = 2.0
    """A robot that speaks is answered this often, s."""
    map_period: float = 2.0
    """Landmarks, markers and ways are published this often while they change and somebody listens, s."""
    sites: str = ""
    """Where robots drive that cannot meet: robot1:ground,robot2:first. Robots of different sites are never compared."""
    ellipse_sigmas: float = 3.0
    """Half axes of the drawn ellipses, in standard deviations."""
    silent_after: float = 10.0
    """A robot that has said nothing for so long is told of in the diagnostics, s."""

    def __post_init__(self) -> None:
        for name in ("tick_period", "answer_period", "map_period", "ellipse_sigmas", "silent_after"):
            if not 0.0 < getattr(self, name) < math.inf:
                raise ConfigError(f"parameter {name} must be a positive number, got {getattr(self, name)!r}")
        self.sites_of_robots()

    def sites_of_robots(self) -> dict[str, str]:
        """Give the site of each robot that has one.

        Raises
        ------
        ConfigError
            If what was given names none, or two of one robot.
        """
        found = {}
        for part in filter(str.strip, self.sites.split(",")):
            robot, colon, site = (word.strip() for word in part.partition(":"))
            if not colon or not site or NAME.fullmatch(robot) is None:
                raise ConfigError(f"parameter sites must be like robot1:ground,robot2:first, got {self.sites!r}")
            if robot in found:
                raise ConfigError(f"parameter sites gives {robot} two sites, got {self.sites!r}")
            found[robot] = site
        return found

    @property
    def path(self) -> Path:
        """The folder.

        Raises
        ------
        ConfigError
            If none was given.
        """
        if not self.folder:
            raise ConfigError("fleet_server needs the parameter folder: where it keeps what the robots tell")
        return Path(self.folder).expanduser().absolute()

    def frame(self, number: int) -> str:
        """Name the frame of a common map."""
        return f"{self.common_frame}_{number}"
