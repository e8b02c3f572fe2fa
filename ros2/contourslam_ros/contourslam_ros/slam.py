"""Node ``slam``: maps while the robot drives."""

import sys
import time
from pathlib import Path

import numpy as np

from contourslam.errors import ConfigError
from contourslam.fleet.rehearsal import rehearse_robot
from contourslam.live.session import Session
from contourslam.live.start import mapping
from contourslam_ros.fleet_link import FleetLink
from contourslam_ros.live_node import LiveNode
from contourslam_ros.running import run


class Slam(LiveNode):
    """Corners, walls and the robot's pose, out of scans and odometry."""

    def __init__(self) -> None:
        super().__init__("slam")
        if self.settings.core.back_end == "graph":
            self.rehearsed = "mapping, graph", "continuing a map, graph"
        if self.config.fleet:
            if self.settings.core.back_end != "graph":
                raise ConfigError("a fleet is told keyframes, which only the graph has; set back_end to graph")
            self.link = FleetLink(self, self.config, self.settings.live)

    def warm_up(self) -> None:
        """Have what tells a fleet compiled too: it works in the mapping's thread."""
        super().warm_up()
        if self.link is not None:
            rehearse_robot(self.settings.core)

    def begin(self, mount: np.ndarray) -> Session:
        """Map anew, or continue the map that is there."""
        path = Path(self.config.map_file).expanduser().absolute() if self.config.map_file else None
        return mapping(
            self.settings.core,
            self.settings.live,
            map_file=path if path is not None and path.exists() else None,
            autosave=path,
            lidar_mount=mount,
            clock=time.monotonic,
            topics=self.topics,
            expects_odometry=self.config.odometry != "none",
        )


def main() -> int:
    """Run the node until it is told to stop."""
    return run(Slam)


if __name__ == "__main__":
    sys.exit(main())
