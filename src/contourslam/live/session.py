"""The streaming object of live use: messages go in as they come, poses with a covariance come out."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from contourslam.config import LiveConfig
from contourslam.contour.contours import Floats
from contourslam.live.diagnostics import Diagnostic
from contourslam.live.events import Incident, Source
from contourslam.maps.saved_map import SavedMap
from contourslam.scan import LaserScan, Odometry
from contourslam.slam.landmark_map import CornerMap, WallMap
from contourslam.slam.mapper import Mapper
from contourslam.slam.result import ScanUpdate


@dataclass(frozen=True, slots=True)
class Backing:
    """What a session stands on; :mod:`contourslam.live.start` makes it for mapping and for localisation.

    Attributes
    ----------
    begin : callable
        Make the mapper to start with, and again after :meth:`Session.reset`.
    lost : callable
        Given a mapper whose robot may be anywhere now, make the mapper that finds it again; it may be the same one.
    keep : callable or None
        Make a map to save of a mapper; None where it cannot be saved.
    open : callable or None
        Make a mapper that continues a saved map, or localises in it.
    write, read : callable or None
        Write a map to a file, atomically, and read it.
    fixed : bool
        The map never changes: localisation.
    """

    begin: Callable[[], Mapper]
    lost: Callable[[Mapper], Mapper]
    keep: Callable[[Mapper], SavedMap] | None = None
    open: Callable[[SavedMap], Mapper] | None = None
    write: Callable[[SavedMap, Path], None] | None = None
    read: Callable[[Path], SavedMap] | None = None
    fixed: bool = False


@dataclass(frozen=True, slots=True)
class Processed:
    """What one scan gave.

    Attributes
    ----------
    stamp : float
        Of the scan, s; the poses are those at this time.
    T_map_base : ndarray, shape (3,)
        m, m, rad.
    covariance : ndarray, shape (3, 3)
        Its covariance, in the axes of the map.
    T_odom_base : ndarray, shape (3,)
        Raw odometry at the stamp; zeros where none has ever come.
    T_map_odom : ndarray, shape (3,)
        The correction as it is: ``T_map_base = T_map_odom @ T_odom_base``.
    T_map_odom_smooth : ndarray, shape (3,)
        The correction to be published, see :class:`contourslam.live.smoothing.Smoother`.
    update : ScanUpdate
        All that the mapper said.
    map_version : int
        Greater than before where the map may have changed.
    incidents : tuple of Incident
        What was dropped, or had no odometry, since the scan before; this scan's own lack among them.
    scan : LaserScan
    latency : float
        From the scan's coming to its pose, on the caller's clock, s.
    """

    stamp: float
    T_map_base: Floats
    covariance: Floats
    T_odom_base: Floats
    T_map_odom: Floats
    T_map_odom_smooth: Floats
    update: ScanUpdate
    map_version: int
    incidents: tuple[Incident, ...]
    scan: LaserScan
    latency: float


class Session:
    """Odometry and scans in any order, poses and a map out; over any mapper.

    :meth:`push_odometry` and :meth:`push_scan` only take in and may be called from any thread at any time; :meth:`poll`
    does the work. The others wait for a :meth:`poll` in another thread to end, but for :meth:`map_to_odom` and
    :meth:`diagnostics`, which do not wait.

    No clock is read: `now` is the caller's, s, and should be one that nobody sets (``time.monotonic``), also where the
    stamps are of simulated time.

    Parameters
    ----------
    backing : Backing
    config : LiveConfig
    odometry_lag : float
        The odometry that belongs to a scan is stamped this much earlier, s; as in ``SlamConfig``.
    autosave : Path, optional
        Where the map is saved by itself; nowhere by default.
    clock : callable, optional
        What `now` comes from. It is asked when a scan is done, so that latencies hold the work too.
    """

    def __init__(
        self,
        backing: Backing,
        config: LiveConfig,
        *,
        odometry_lag: float = 0.0,
        autosave: Path | None = None,
        clock: Callable[[], float] | None = None,
    ) -> None:
        raise NotImplementedError

    def push_odometry(self, odometry: Odometry, now: float) -> None:
        """Take in one odometry reading."""
        raise NotImplementedError

    def push_scan(self, scan: LaserScan, now: float) -> None:
        """Take in one scan."""
        raise NotImplementedError

    def refuse(self, source: Source, stamp: float, why: str, now: float) -> None:
        """Count a message that could not be made into a scan or a reading, so that the diagnostics tell of it."""
        raise NotImplementedError

    def poll(self, now: float) -> list[Processed]:
        """Map every scan whose turn it is; to be called after each push and at least every :meth:`due` seconds."""
        raise NotImplementedError

    def due(self, now: float) -> float | None:
        """Give the time until :meth:`poll` has work even if no message comes, s; None where it never will."""
        raise NotImplementedError

    @property
    def map_version(self) -> int:
        """A number that grows whenever the map may have changed."""
        raise NotImplementedError

    def map_changed(self, version: int) -> bool:
        """Whether the map may have changed since :attr:`map_version` was `version`."""
        raise NotImplementedError

    def corner_map(self) -> CornerMap:
        """Corners of the map as they stand now."""
        raise NotImplementedError

    def wall_map(self) -> WallMap:
        """Walls of the map as they stand now."""
        raise NotImplementedError

    def map_to_odom(self, time: float) -> Floats | None:
        """Give the smooth ``T_map_odom`` at a time of the stamps' clock, s; None before the first scan. Never waits."""
        raise NotImplementedError

    @property
    def paused(self) -> bool:
        """Whether scans are left out."""
        raise NotImplementedError

    def pause(self) -> None:
        """Leave out scans, and count them; odometry goes on."""
        raise NotImplementedError

    def resume(self) -> None:
        """Take in scans again."""
        raise NotImplementedError

    def reset(self) -> None:
        """Begin anew; where there is an autosave, the map until now is first saved beside it as ``previous-NAME``."""
        raise NotImplementedError

    def lost(self) -> None:
        """Say that the robot was carried away: the next scans find it again."""
        raise NotImplementedError

    def save(self, path: Path) -> None:
        """Save the map.

        Raises
        ------
        ContourslamError
            If it cannot be made or written; the file that stood there is as it was.
        """
        raise NotImplementedError

    def load(self, path: Path) -> None:
        """Continue a saved map, or localise in it.

        Raises
        ------
        ContourslamError
            If it cannot be read; the session is then as it was.
        """
        raise NotImplementedError

    def diagnostics(self, now: float) -> tuple[Diagnostic, ...]:
        """Say how all is. Never waits."""
        raise NotImplementedError

    def close(self) -> None:
        """Save what has not been saved by itself yet, where there is a place for it, and end."""
        raise NotImplementedError
