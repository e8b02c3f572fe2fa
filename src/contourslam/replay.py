"""A recording, message by message, through the streaming object."""

import sys
from array import array
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from time import thread_time

import numpy as np

from contourslam.config import Config
from contourslam.contour.contours import Floats
from contourslam.detectors import Detector
from contourslam.errors import ConfigError, MapError, RecordingError
from contourslam.geometry.poses import interpolate
from contourslam.maps.saved_map import NOT_CONTINUABLE, SavedMap
from contourslam.scan import LaserScan, Odometry, TruePose
from contourslam.slam.gathering import Mapped, gather
from contourslam.slam.mapper import Mapper
from contourslam.slam.result import RunResult, ScanUpdate
from contourslam.slam.slam import ContourSlam

Message = LaserScan | Odometry | TruePose
MakeMapper = Callable[..., Mapper]
BLIND = "scans before any odometry, mapped all the same"


class Stopwatch:
    """CPU seconds per stage, so that other work on the machine does not count; the core itself reads no clock."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._last = thread_time()

    def start(self) -> None:
        """Begin to measure the next stage here."""
        self._last = thread_time()

    def __call__(self, stage: str) -> None:
        """Book the time since the last call under `stage`."""
        now = thread_time()
        self.seconds[stage] = self.seconds.get(stage, 0.0) + now - self._last
        self._last = now


def make_mapper(
    config: Config,
    detector: Detector | None = None,
    *,
    initial_pose: Floats | None = None,
    lidar_mount: Floats | None = None,
    lap: Callable[[str], None] = lambda stage: None,
) -> Mapper:
    """Make the back end that the configuration names; the arguments are those of :class:`ContourSlam`.

    Raises
    ------
    ConfigError
        If the configuration names a detector that does not exist.
    MissingExtraError
        If it names the graph and GTSAM is not installed.
    """
    if config.back_end == "graph":
        from contourslam.graph import GraphSlam

        return GraphSlam(config, detector, initial_pose=initial_pose, lidar_mount=lidar_mount, lap=lap)
    return ContourSlam(config, detector, initial_pose=initial_pose, lidar_mount=lidar_mount, lap=lap)


def check_continuable(saved: SavedMap, config: Config) -> None:
    """Refuse what a further drive cannot go on in.

    Raises
    ------
    MapError
        If the map does not hold all that is needed: one of landmarks alone, or a file of version 1.
    ConfigError
        If the configuration names the filter, which begins a new map each time.
    MissingExtraError
        If GTSAM is not installed.
    """
    if config.back_end != "graph":
        raise ConfigError(f"a map is continued by the graph, not by {config.back_end}; choose --back-end graph")
    if not saved.continuable:
        raise MapError(NOT_CONTINUABLE)


def continue_mapper(
    saved: SavedMap,
    covariance: Floats,
    config: Config,
    detector: Detector | None = None,
    *,
    initial_pose: Floats,
    lidar_mount: Floats | None = None,
    lap: Callable[[str], None] = lambda stage: None,
) -> Mapper:
    """Make a mapper that goes on in a map that was kept.

    Parameters
    ----------
    saved : SavedMap
    covariance : ndarray, shape (3, 3)
        Of `initial_pose`, in the axes of the map.
    initial_pose : ndarray, shape (3,)
        Base in the frame of the map where the drive begins: m, m, rad.
    config, detector, lidar_mount, lap
        As of :func:`make_mapper`.

    Raises
    ------
    ContourslamError
        As :func:`check_continuable`.
    ConfigError
        If the configuration names a detector that does not exist.
    """
    check_continuable(saved, config)
    from contourslam.graph import resume

    return resume(config, saved, initial_pose, covariance, detector=detector, lidar_mount=lidar_mount, lap=lap)


def keep_map(mapper: Mapper, about: Mapping[str, str]) -> SavedMap:
    """Give the map of a mapper as it is kept: all that a graph knows, of another its landmarks. The drive may go on.

    Parameters
    ----------
    mapper : Mapper
    about : mapping of str to str
        What people want to know of the map.
    """
    if "contourslam.graph" in sys.modules:  # else GTSAM may not be installed, and the mapper is no graph
        from contourslam.graph import GraphSlam, kept

        if isinstance(mapper, GraphSlam):
            return kept(mapper, about)
    return SavedMap(mapper.corner_map(), mapper.wall_map(), about=dict(about))


def replay(
    messages: Iterable[Message],
    config: Config,
    detector: Detector | None = None,
    *,
    initial_pose: Floats | None = None,
    lidar_mount: Floats | tuple[float, float, float] | None = None,
    on_scan: Callable[[LaserScan, ScanUpdate], None] | None = None,
    make: MakeMapper = make_mapper,
) -> RunResult:
    """Run the filter over the messages of a recording.

    Where the recording breaks off in an error, or Ctrl-C ends the run, the result of what came before is returned,
    marked as not complete; `skipped` then says why.

    Parameters
    ----------
    messages : iterable of LaserScan, Odometry or TruePose
        In the order in which they were recorded.
    config : Config
    detector : Detector, optional
        A detector object of one's own in place of the configuration's.
    initial_pose : ndarray, shape (3,), optional
        Pose of the base in the world at the first scan; by default the true one where the recording has it, else the
        origin.
    lidar_mount : ndarray, shape (3,), optional
        ``T_base_lidar``; that of the configuration by default.
    on_scan : callable, optional
        Called after each scan, for progress and pictures.
    make : callable
        Makes the mapper, with the arguments of :func:`make_mapper`: one that goes on in a map, or that is looked at
        afterwards.

    Returns
    -------
    RunResult

    Raises
    ------
    RecordingError
        If the recording fails before its first scan, or holds none.
    """
    watch = Stopwatch()
    slam: Mapper | None = None
    # What each scan gave, raw odometry there, readings before it: one list, so that Ctrl-C cannot come between two.
    done: list[Mapped] = []
    readings = array("d")  # four numbers each: a log may hold some hundred thousand
    truth: list[TruePose] = []
    skipped: Counter[str] = Counter()
    mount = None if lidar_mount is None else np.asarray(lidar_mount, dtype=np.float64)
    waiting: list[Odometry] = []
    newest: Odometry | None = None
    complete = True
    try:
        for message in messages:
            if isinstance(message, TruePose):
                truth.append(message)
                continue
            if isinstance(message, Odometry):
                newest = message
                waiting.append(message)
                readings.extend((message.stamp, *message.pose.tolist()))
                continue
            if slam is None:
                start = initial_pose
                if start is None and truth:
                    start = _pose_at(truth, np.array([message.stamp]))[0]
                slam = make(config, detector, initial_pose=start, lidar_mount=mount, lap=watch)
            for reading in waiting:
                slam.push_odometry(reading)
            waiting.clear()
            if newest is None:
                skipped[BLIND] += 1
            watch.start()
            update = slam.push_scan(message)
            done.append(Mapped(update, slam.odometry_pose, len(readings) // 4))
            if on_scan is not None:
                on_scan(message, update)
    except KeyboardInterrupt:
        complete = False
        skipped["interrupted"] += 1
    except RecordingError as error:
        if not done:
            raise
        complete = False
        skipped[str(error)] += 1
    if slam is None:
        if complete:
            raise RecordingError("the recording holds no scan")
        slam = make(config, detector, initial_pose=initial_pose, lidar_mount=mount)
    return _result(config, slam, done, readings, truth, watch, dict(skipped), complete)


def _pose_at(truth: list[TruePose], stamps: Floats) -> Floats:
    rows = sorted(truth, key=lambda t: t.stamp)
    return interpolate(np.array([t.stamp for t in rows]), np.array([t.pose for t in rows]), stamps)


def _result(
    config: Config,
    slam: Mapper,
    done: list[Mapped],
    numbers: "array[float]",
    truth: list[TruePose],
    watch: Stopwatch,
    skipped: dict[str, int],
    complete: bool,
) -> RunResult:
    watch.start()
    finished = slam.finish()
    watch("map refinement")  # "refinement" alone is that of corners
    maps = slam.corner_map(), slam.wall_map()
    watch("map")
    readings = np.array(numbers).reshape(-1, 4)
    run = gather(config, done, readings, slam.start_pose, finished, maps, blind=skipped.get(BLIND, 0))
    true = _pose_at(truth, run.stamps) if truth and len(run.stamps) else None
    return replace(run, truth=true, seconds=watch.seconds, skipped=skipped, complete=complete)
