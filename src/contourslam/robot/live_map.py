"""The map made while the robot drives: a live session in its thread, and what it leaves behind as a run."""

import math
import threading
import time
from array import array
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
from contourslam.live.worker import Onlooker, Worker
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
    onlooker : callable, optional
        Given the session before its first scan, and `lidar_mount`, gives who watches the mapping.
    keeps : bool
        Keep what :meth:`result` needs, which grows with every scan; off for a robot that is only watched.
    expects_odometry : bool
        False for a lidar without a base.
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
        onlooker: Callable[[Session, Floats], Onlooker] | None = None,
        keeps: bool = True,
        expects_odometry: bool = True,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._config, self._keeps = config, keeps
        self.session: Session = mapping(
            config, live, autosave=autosave, initial_pose=initial_pose, lidar_mount=np.array(lidar_mount), clock=clock,
            expects_odometry=expects_odometry,
        )  # fmt: skip
        self._start = np.zeros(3) if initial_pose is None else np.asarray(initial_pose, dtype=np.float64)
        self._error: BaseException | None = None
        self._clock, self._mapped_at, self._leapt_at = clock, math.inf, -math.inf
        watching = None if onlooker is None else onlooker(self.session, np.array(lidar_mount))
        self._worker = Worker(self.session, self._take, clock=clock, failed=self._fail, onlooker=watching)
        self._lock = threading.Lock()
        self._last: Processed | None = None
        self._newest: Odometry | None = None
        self._done: list[Mapped] = []
        self._latencies = array("d")
        self._readings = array("d")  # four numbers each: fifty a second, for hours
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
            if self._newest is not None and _leaps(self._newest, message):
                with self._lock:
                    self._leapt_at = message.stamp
            self._newest = message
            if self._keeps:
                self._readings.extend((message.stamp, *message.pose.tolist()))
            self._worker.push_odometry(message)
        else:
            self._worker.push_scan(message)

    def _take(self, processed: Processed) -> None:
        self._mapped_at = self._clock()
        with self._lock:
            self._last = processed
            if self._keeps:
                self._done.append(Mapped(processed.update, processed.T_odom_base, len(self._readings) // 4))
                self._latencies.append(processed.latency)
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
        return self._last

    def pose(self) -> tuple[float, float, float] | None:
        """Pose of the base at the newest odometry reading: x (m), y (m), heading (rad).

        None before the first scan, and from a leap of the odometry, as where the base's driver was started again, until
        the map has taken it in.
        """
        newest = self._newest
        if newest is None or self._leapt_at > -math.inf:
            return None
        T_map_odom = self.session.map_to_odom(newest.stamp)
        if T_map_odom is None:
            return None
        x, y, heading = compose(T_map_odom, newest.pose).tolist()
        return x, y, heading

    @property
    def latencies(self) -> Floats:
        """From each scan's coming to its pose, s, shape (t,)."""
        with self._lock:
            return np.array(self._latencies)

    def close(self) -> None:
        """Let the last scan be mapped, and end the thread."""
        self._worker.stop()

    def result(self, skipped: dict[str, int] | None = None, *, complete: bool = True) -> RunResult:
        """Give the run, revised at its end where the back end can; after :meth:`close`, and where all was kept.

        Parameters
        ----------
        skipped : dict, optional
            What could not be used, by reason.
        complete : bool
        """
        mapped, readings = self._done, np.array(self._readings).reshape(-1, 4)
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
