"""The map made while the robot drives: a live session in its thread, and what it leaves behind as a run."""

import math
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from contourslam.config import Config, LiveConfig, MotionConfig
from contourslam.geometry.poses import between, compose
from contourslam.live.processed import Processed
from contourslam.live.session import Session
from contourslam.live.start import mapping
from contourslam.live.worker import Worker
from contourslam.robot.config import RobotConfig
from contourslam.robot.lidar.x4_turns import RANGE_MAX
from contourslam.scan import LaserScan, Odometry
from contourslam.slam.gathering import Mapped, gather
from contourslam.slam.result import RunResult

Floats = NDArray[np.float64]
_TURN_PER_M_DEG, _TURN_PER_RAD_DEG = 0.3, 0.6  # of a gyroscope whose bias was found at rest, and its scale
_LEAST_LATERAL = 0.003  # m after one metre
_CLOCK = 0.003  # s by which the stamps of lidar and base may differ
_FASTEST = np.array([2.0, 6.0])  # m/s, rad/s; no faster is the robot
_SLACK = np.array([0.1, 0.2])  # m, rad
_UNSEEN = 0.5  # s; a base that is silent for longer has stopped its motors

PATIENT = LiveConfig(wait=1.5, silent_after=3.0, max_waiting=20)
"""Over a line that damages nine of ten frames the odometry comes a few times a second: scans wait for it, for a scan
without it is mapped by a guess. On a good line it is there at once."""


def settings_of(robot: RobotConfig, config: Config) -> Config:
    """Tell the mapping what is known of the robot: the lidar's place and range, and how good its wheels are.

    An odometry noise that the configuration sets itself stays.

    Parameters
    ----------
    robot : RobotConfig
    config : Config
    """
    x, y, yaw = robot.lidar.mount
    lidar = replace(config.lidar, mount_x=x, mount_y=y, mount_yaw=yaw, max_range=min(config.lidar.max_range, RANGE_MAX))
    if config.slam.motion != MotionConfig():
        return replace(config, lidar=lidar)
    base = robot.base
    motion = MotionConfig(
        forward_per_sqrt_m=base.wheel_sigma,
        lateral_per_sqrt_m=max(base.lateral_sigma, _LEAST_LATERAL),
        turn_per_sqrt_m_deg=_TURN_PER_M_DEG if base.use_gyro else MotionConfig().turn_per_sqrt_m_deg,
        turn_per_sqrt_rad_deg=_TURN_PER_RAD_DEG if base.use_gyro else MotionConfig().turn_per_sqrt_rad_deg,
        clock_sigma=_CLOCK,
    )
    return replace(config, lidar=lidar, slam=replace(config.slam, motion=motion))


class LiveMap:
    """Scans and odometry in, the robot's pose out at any time; a run when all is over.

    Parameters
    ----------
    config : Config
    live : LiveConfig
    lidar_mount : tuple of (float, float, float)
        ``T_base_lidar``: m, m, rad.
    initial_pose : ndarray, shape (3,), optional
        Of the base at its first scan; the origin by default.
    autosave : Path, optional
        Where the map is saved by itself.
    clock : callable
        One that nobody sets, s.
    """

    def __init__(
        self,
        config: Config,
        live: LiveConfig,
        *,
        lidar_mount: tuple[float, float, float],
        initial_pose: Floats | None = None,
        autosave: Path | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._config = config
        self.session: Session = mapping(
            config, live, autosave=autosave, initial_pose=initial_pose, lidar_mount=np.array(lidar_mount), clock=clock
        )
        self._start = np.zeros(3) if initial_pose is None else np.asarray(initial_pose, dtype=np.float64)
        self._error: BaseException | None = None
        self._clock, self._mapped_at, self._leapt_at = clock, math.inf, -math.inf
        self._worker = Worker(self.session, self._take, clock=clock, failed=self._fail)
        self._lock = threading.Lock()
        self._done: list[tuple[Processed, int]] = []
        self._readings: list[Odometry] = []
        self._worker.start()

    def push(self, message: LaserScan | Odometry) -> None:
        """Take in a scan or an odometry reading; returns at once.

        Raises
        ------
        Exception
            With which the mapping ended, where it did: no known failure.
        """
        if self._error is not None:
            raise self._error
        if isinstance(message, Odometry):
            if self._readings and _leaps(self._readings[-1], message):
                with self._lock:
                    self._leapt_at = message.stamp
            self._readings.append(message)
            self._worker.push_odometry(message)
        else:
            self._worker.push_scan(message)

    def _take(self, processed: Processed) -> None:
        self._mapped_at = self._clock()
        with self._lock:
            self._done.append((processed, len(self._readings)))
            if processed.stamp >= self._leapt_at:
                handed_on = compose(processed.T_map_odom_smooth, processed.T_odom_base)
                if (_apart(processed.T_map_base, handed_on) < _SLACK).all():
                    self._leapt_at = -math.inf

    def _fail(self, error: BaseException) -> None:
        self._error = error

    @property
    def since_mapped(self) -> float:
        """Time since a scan was mapped last, s; 0 before the first."""
        return max(self._clock() - self._mapped_at, 0.0)

    @property
    def last(self) -> Processed | None:
        """What the last scan gave; None before the first."""
        with self._lock:
            return self._done[-1][0] if self._done else None

    def pose(self) -> tuple[float, float, float] | None:
        """Pose of the base at the newest odometry reading: x (m), y (m), heading (rad).

        None before the first scan, and from a leap of the odometry, as where the base's driver was started again, until
        the map has taken it in.
        """
        if not self._readings or self._leapt_at > -math.inf:
            return None
        newest = self._readings[-1]
        T_map_odom = self.session.map_to_odom(newest.stamp)
        if T_map_odom is None:
            return None
        x, y, heading = compose(T_map_odom, newest.pose).tolist()
        return x, y, heading

    @property
    def latencies(self) -> Floats:
        """From each scan's coming to its pose, s, shape (t,)."""
        with self._lock:
            return np.array([processed.latency for processed, _ in self._done])

    def close(self) -> None:
        """Let the last scan be mapped, and end the thread."""
        self._worker.stop()

    def result(self, skipped: dict[str, int] | None = None, *, complete: bool = True) -> RunResult:
        """Give the run, revised at its end where the back end can; after :meth:`close`.

        Parameters
        ----------
        skipped : dict, optional
            What could not be used, by reason.
        complete : bool
        """
        mapped = [Mapped(done.update, done.T_odom_base, before) for done, before in self._done]
        readings = np.array([[reading.stamp, *reading.pose] for reading in self._readings]).reshape(-1, 4)
        finished = self.session.finish()
        if finished is not None and len(finished.poses) != len(mapped):
            finished = None  # another map was begun on the way
        maps = self.session.corner_map(), self.session.wall_map()
        run = gather(self._config, mapped, readings, self._start, finished, maps)
        return replace(run, skipped=dict(skipped or {}), complete=complete)


def _apart(a: Floats, b: Floats) -> Floats:
    """How far apart two poses are: m, rad."""
    x, y, turn = between(a, b).tolist()
    return np.array([math.hypot(x, y), abs(turn)])


def _leaps(before: Odometry, after: Odometry) -> bool:
    """Whether the odometry says what no robot can do."""
    elapsed = min(max(after.stamp - before.stamp, 0.0), _UNSEEN)
    return bool((_apart(before.pose, after.pose) > _FASTEST * elapsed + _SLACK).any())
