"""A run, or a page's replay, that writes a Rerun file beside its work."""

import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from contourslam.config import Config
from contourslam.contour.contours import Floats
from contourslam.detectors import make_detector
from contourslam.replay import MakeMapper, Stopwatch
from contourslam.scan import LaserScan
from contourslam.slam.mapper import Mapper
from contourslam.slam.result import RunResult, ScanUpdate
from contourslam.view.lane import Lane
from contourslam.view.memory import Memory
from contourslam.view.moment import Moment, trace_of
from contourslam.view.player import Player
from contourslam.view.rerun_file import RerunFile
from contourslam.view.rerun_log import RerunLog


def open_log(path: Path, title: str, config: Config, detectors: Sequence[str], *, overwrite: bool = False) -> RerunLog:
    """Open a file for lanes of these detectors.

    Raises
    ------
    ContourslamError
        As :class:`contourslam.view.rerun_file.RerunFile`, and where a detector does not exist.
    """
    made = {name: make_detector(name, adapted=config.adapted) for name in detectors}
    return RerunLog(RerunFile(path, title, overwrite=overwrite), made)


class WatchedRun:
    """Watches the mapper of :func:`contourslam.replay.replay` from its making to its result; it changes nothing in it.

    Parameters
    ----------
    log : RerunLog
        For one lane.
    """

    def __init__(self, log: RerunLog) -> None:
        self._log, self._watch = log, Stopwatch()
        self._lane: Lane | None = None
        self._scans, self._began, self._elapsed = 0, 0.0, 0.0

    def making(self, make: MakeMapper) -> MakeMapper:
        """Give what makes the mapper and begins to watch it."""

        def made(
            config: Config, detector: Any = None, *, lap: Callable[[str], None] = lambda stage: None, **more: Any
        ) -> Mapper:
            def both(stage: str) -> None:
                lap(stage)
                self._watch(stage)

            mapper = make(config, detector, lap=both, **more)
            mount = more.get("lidar_mount")
            self._lane = Lane(mapper, config, np.array(config.lidar.mount if mount is None else mount, np.float64))
            return mapper

        return made

    def on_scan(self, scan: LaserScan, update: ScanUpdate) -> None:
        """Take in what a scan gave."""
        lane = self._lane
        assert lane is not None
        if not self._scans:
            self._began = scan.stamp
        self._elapsed = max(self._elapsed, scan.stamp - self._began)
        done = lane.take(update, self._watch.seconds, self._elapsed)
        contours = lane.contours()
        assert contours is not None  # both back ends that map show theirs
        odometry, made = lane.odometry(), time.monotonic()
        moment = Moment(self._scans, self._elapsed, made, trace_of(contours), odometry, None, (done,))
        self._scans += 1
        self._log.add(moment, (lane,))
        self._watch.seconds.clear()
        self._watch.start()

    def finish(self, result: RunResult) -> str:
        """Take in what came of it all, and end the file; gives what went wrong with that, if anything did."""
        if self._lane is not None and self._scans:
            self._log.finish((self._lane,), result.truth, known_then(result))
        return close(self._log, result.skipped)


def known_then(result: RunResult) -> Floats:
    """Poses as they were known at the time, shape (t, 3)."""
    return result.poses if result.online_poses is None else result.online_poses


def close(log: RerunLog, skipped: Mapping[str, int]) -> str:
    """Say what was skipped, and end the file; gives what went wrong with that, if anything did."""
    for reason, count in skipped.items():
        log.tell(f"skipped {count}: {reason}", "WARN")
    log.file.close()
    return log.file.trouble


class Copied(Memory):
    """A memory that writes each moment into a Rerun file as it takes it in.

    Parameters
    ----------
    log : RerunLog
    lanes : int
        How many there will be.
    """

    def __init__(self, log: RerunLog, lanes: int) -> None:
        super().__init__(lanes)
        self._log = log
        self._player: Player | None = None

    def follow(self, player: Player) -> None:
        """Say whose moments these are; before the first."""
        self._player = player

    def add(self, moment: Moment) -> None:
        """Take in a moment."""
        super().add(moment)
        if self._player is not None:
            self._log.add(moment, self._player.lanes)

    def finish(self, skipped: Mapping[str, int]) -> str:
        """Take in what came of it all once the player has ended, and end the file; gives what went wrong with that."""
        player = self._player
        if player is not None and self.newest is not None:
            self._log.finish(player.lanes)
            if player.trouble:
                self._log.tell(player.trouble, "ERROR")
        return close(self._log, skipped)
