"""One drive through a simulated building, mapped while it is made: give it metres, seed, figures.json, map.geojson."""

import json
import sys
import time
from collections.abc import Callable, Iterator
from itertools import islice
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from contourslam.config import Config
from contourslam.replay import replay
from contourslam.report.map_files import write_geojson
from contourslam.scan import LaserScan
from contourslam.simulation.long_drive import LongDrive, Message, building_drive
from contourslam.slam.result import RunResult, ScanUpdate

WARM_UP = 3000  # messages, which compile what has to be compiled
CONFIG = Config(back_end="graph")


def mapped(
    drive: LongDrive, messages: Iterator[Message], on_scan: Callable[[LaserScan, ScanUpdate], None] | None = None
) -> RunResult:
    """Map a drive; this is the one place that says with what."""
    return replay(messages, CONFIG, lidar_mount=drive.lidar_mount, on_scan=on_scan)


class Clock:
    """CPU seconds of mapping, scan by scan, without what making the messages takes. Mutable."""

    def __init__(self) -> None:
        self.seconds: list[float] = []
        self._last = time.process_time()

    def watch(self, messages: Iterator[Message]) -> Iterator[Message]:
        """Hand on the messages, not counting the time that they take to be made."""
        while True:
            before = time.process_time()
            message = next(messages, None)
            self._last += time.process_time() - before
            if message is None:
                return
            yield message

    def tick(self, *_: object) -> None:
        """Book the time since the last call as that of a scan."""
        now = time.process_time()
        self.seconds.append(now - self._last)
        self._last = now


def rms(found: NDArray[np.float64], truth: NDArray[np.float64]) -> float:
    """Root mean square distance between two trajectories, m."""
    return float(np.sqrt(np.mean(np.sum((found - truth)[:, :2] ** 2, axis=1))))


def main() -> None:
    length, seed, figures, map_file = float(sys.argv[1]), int(sys.argv[2]), Path(sys.argv[3]), Path(sys.argv[4])
    drive = building_drive(length, seed)
    mapped(drive, islice(drive.messages(), WARM_UP))
    clock = Clock()
    result = mapped(drive, clock.watch(drive.messages()), clock.tick)
    clock.tick()
    *scans, at_the_end = clock.seconds
    write_geojson(map_file, result.corner_map, result.wall_map)
    truth = result.truth
    assert truth is not None and result.complete
    found = {
        "scans": len(scans),
        "ms_per_scan": 1e3 * float(np.mean(scans)),
        "ms_per_last_scan": 1e3 * float(np.mean(scans[-(len(scans) // 10) :])),
        "seconds_at_the_end": at_the_end,
        "landmarks": len(result.corner_map.ids) + len(result.wall_map.ids),
        "loops": len(result.loops),
        "rmse": rms(result.poses, truth),
        "online_rmse": None if result.online_poses is None else rms(result.online_poses, truth),
        "odometry_rmse": rms(result.odometry, truth),
    }
    figures.write_text(json.dumps(found) + "\n")


if __name__ == "__main__":
    main()
