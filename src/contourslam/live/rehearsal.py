"""All that a robot may run, run once without one: every kernel is then compiled and cached, for the types in use.

It drives the real pipeline and lists no kernels, so a kernel that is added later is compiled with the others.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import cast

from contourslam.config import Association, Config, LiveConfig, SlamConfig
from contourslam.detectors import DETECTORS
from contourslam.geometry.angles import wrap_angle
from contourslam.live.session import Session
from contourslam.live.start import localization, mapping
from contourslam.live.warming import warm_up
from contourslam.scan import LaserScan, Odometry
from contourslam.slam.landmark_map import CornerMap, WallMap
from contourslam.slam.mapper import Mapper

Stage = tuple[str, Callable[[], None]]
FILTER = Config(slam=SlamConfig(walls=True, contour_matching=True))
ASSOCIATIONS: tuple[Association, ...] = ("nearest", "mahalanobis", "mutual")
SHORT = 0.3  # laps that are enough to come to each detector and association


def stages(folder: Path) -> list[Stage]:
    """List what is to be run, in order: names for people, and what to call.

    The graph is left out where GTSAM is not installed.

    Parameters
    ----------
    folder : Path
        A map is written there between mapping and localising.
    """
    found: list[Stage] = []
    back_ends = {"filter with walls and contour matching": FILTER, "filter": Config()}
    if find_spec("gtsam") is not None:
        back_ends = {"graph": replace(FILTER, back_end="graph"), **back_ends}
    for name, config in back_ends.items():
        file = folder / f"{len(found)}.map"
        found.append((f"mapping, {name}", partial(_map, config, file)))
    if "graph" in back_ends:
        found.append(("continuing a map, graph", partial(_continue, back_ends["graph"], folder / "0.map")))
    found.append(("localising", partial(_localise, FILTER, folder / "0.map")))
    for detector in DETECTORS:
        config = Config(detector=detector)
        found.append((f"detector {detector}", partial(warm_up, config, laps=SHORT)))
    for association in ASSOCIATIONS:
        config = Config(slam=SlamConfig(association=association))
        found.append((f"association {association}", partial(warm_up, config, laps=SHORT)))
    return found


def _map(config: Config, file: Path) -> None:
    session = mapping(config, LiveConfig())
    warm_up(config, cast(Mapper, _Through(session)))
    session.save(file)
    session.close()
    warm_up(config, laps=SHORT)  # and to the end of a recording, which a session never comes to


def _continue(config: Config, file: Path) -> None:
    session = mapping(config, LiveConfig(), map_file=file)
    warm_up(config, cast(Mapper, _Through(session)))
    session.close()


def _localise(config: Config, file: Path) -> None:
    session = localization(config, LiveConfig(), file)
    warm_up(config, cast(Mapper, _Through(session)))
    session.close()


class _Through:
    """The part of a mapper that a drive needs, with a session before it."""

    def __init__(self, session: Session) -> None:
        self._session, self._now = session, 0.0

    def push_odometry(self, odometry: Odometry) -> None:
        self._now = odometry.stamp
        self._session.push_odometry(odometry, self._now)

    def push_scan(self, scan: LaserScan) -> None:
        self._now = scan.stamp
        self._session.push_scan(scan, self._now)
        self._session.poll(self._now)

    def finish(self) -> None:
        """A session has no end."""

    def corner_map(self) -> CornerMap:
        return self._session.corner_map()

    def wall_map(self) -> WallMap:
        return self._session.wall_map()


def cache_folder() -> Path:
    """Folder that Numba keeps the compiled kernels in; those of each room of the package in one of its own below."""
    kept = Path(wrap_angle.stats.cache_path)  # type: ignore[attr-defined]  # a kernel is typed as what it computes
    return kept.parents[1] if kept.name == "__pycache__" else kept.parent
