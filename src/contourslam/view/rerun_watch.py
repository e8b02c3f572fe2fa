"""A run, or a page's replay, that writes a Rerun file beside its work, which no trouble with the file ends."""

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
from contourslam.view.moment import Moment, trace_of
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


class Logged:
    """Takes moments into a file, and what came of it all at the end.

    Parameters
    ----------
    log : RerunLog
    """

    def __init__(self, log: RerunLog) -> None:
        self._log = log
        self._lanes: Sequence[Lane] = ()

    def take(self, moment: Moment, lanes: Sequence[Lane]) -> None:
        """Take in a moment; in the thread that maps."""
        self._lanes = lanes
        self.attempt(lambda: self._log.add(moment, lanes))

    def finish(
        self,
        skipped: Mapping[str, int],
        truth: Floats | None = None,
        poses: Floats | None = None,
        *,
        trouble: str = "",
    ) -> str:
        """Take in what came of it all, and end the file; gives what went wrong with that, if anything did.

        Parameters
        ----------
        skipped : mapping of str to int
            Reasons and counts.
        truth, poses : ndarray, shape (t, 3), optional
            As of :meth:`contourslam.view.rerun_log.RerunLog.finish`.
        trouble : str
            What ended the mapping early.
        """
        log = self._log

        def conclude() -> None:
            if self._lanes:
                log.finish(self._lanes, truth, poses)
            if trouble:
                log.tell(trouble, "ERROR")
            for reason, count in skipped.items():
                log.tell(f"skipped {count}: {reason}", "WARN")
            log.file.write()

        self.attempt(conclude)
        self.attempt(log.file.close, anyway=True)
        return log.file.trouble

    def attempt(self, work: Callable[[], None], *, anyway: bool = False) -> None:
        """Do something for the file; no more of it, but `anyway`, once something went wrong."""
        file = self._log.file
        if file.trouble and not anyway:
            return
        try:
            work()
        except Exception as error:  # a file must not end the mapping
            file.trouble = file.trouble or f"{file.path}: ends early ({error!r}); the mapping has lost nothing"


class LoggedRun:
    """Logs what the mapper of :func:`contourslam.replay.replay` does, from its making on; it changes nothing in it.

    Parameters
    ----------
    log : RerunLog
        For one lane.
    """

    def __init__(self, log: RerunLog) -> None:
        self._logged, self._watch = Logged(log), Stopwatch()
        self._lane: Lane | None = None
        self._booked: dict[str, float] = {}  # s of each stage, until the last scan
        self._scans, self._began, self._elapsed = 0, 0.0, 0.0

    def making(self, make: MakeMapper) -> MakeMapper:
        """Give what makes the mapper and begins to watch it."""

        def made(config: Config, detector: Any = None, *, lap: Stopwatch | None = None, **more: Any) -> Mapper:
            self._watch = Stopwatch() if lap is None else lap  # the run's own: what is done here is not in it
            mapper = make(config, detector, lap=self._watch, **more)
            mount = more.get("lidar_mount")
            self._lane = Lane(mapper, config, np.array(config.lidar.mount if mount is None else mount, np.float64))
            return mapper

        return made

    def on_scan(self, scan: LaserScan, update: ScanUpdate) -> None:
        """Take in what a scan gave."""
        self._logged.attempt(lambda: self._take(scan, update))

    def _take(self, scan: LaserScan, update: ScanUpdate) -> None:
        lane = self._lane
        assert lane is not None
        if not self._scans:
            self._began = scan.stamp
        self._elapsed = max(self._elapsed, scan.stamp - self._began)
        booked = dict(self._watch.seconds)
        seconds = {stage: spent - self._booked.get(stage, 0.0) for stage, spent in booked.items()}
        self._booked = booked
        done = lane.take(update, seconds, self._elapsed)
        contours = lane.contours()
        assert contours is not None  # both back ends that map show theirs
        odometry, made = lane.odometry(), time.monotonic()
        moment = Moment(self._scans, self._elapsed, made, trace_of(contours), odometry, None, (done,))
        self._scans += 1
        self._logged.take(moment, (lane,))

    def finish(self, result: RunResult) -> str:
        """Take in what came of it all, and end the file; gives what went wrong with that, if anything did."""
        return self._logged.finish(result.skipped, result.truth, known_then(result))


def known_then(result: RunResult) -> Floats:
    """Poses as they were known at the time, shape (t, 3)."""
    return result.poses if result.online_poses is None else result.online_poses
