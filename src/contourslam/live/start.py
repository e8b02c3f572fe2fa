"""Sessions ready to use, one for mapping and one for localisation: what a node or a command needs to know."""

from collections.abc import Callable, Mapping
from datetime import datetime
from pathlib import Path

from contourslam import __version__
from contourslam.config import Config, LiveConfig
from contourslam.contour.contours import Floats
from contourslam.errors import ConfigError, MapError
from contourslam.live.backing import Backing
from contourslam.live.events import Source
from contourslam.live.resuming import Resuming
from contourslam.live.session import Session
from contourslam.localization.follow import Localizer
from contourslam.localization.known_map import KnownMap
from contourslam.localization.locate import Locator
from contourslam.maps.file import load_map, save_map
from contourslam.maps.saved_map import SavedMap
from contourslam.replay import Stopwatch, keep_map, make_mapper
from contourslam.slam.mapper import Mapper


def mapping(
    config: Config,
    live: LiveConfig,
    *,
    map_file: Path | None = None,
    autosave: Path | None = None,
    initial_pose: Floats | None = None,
    lidar_mount: Floats | None = None,
    clock: Callable[[], float] | None = None,
    topics: Mapping[Source, str] | None = None,
    expects_odometry: bool = True,
) -> Session:
    """Make a session that maps.

    Parameters
    ----------
    config : Config
    live : LiveConfig
    map_file : Path, optional
        A map to continue; a new one by default.
    autosave : Path, optional
        Where the map is saved by itself.
    initial_pose : ndarray, shape (3,), optional
        Of the base in a new map, the origin by default; about where it is in one that is continued, where it is looked
        for everywhere by default.
    lidar_mount : ndarray, shape (3,), optional
        ``T_base_lidar``; that of the configuration by default.
    clock, topics, expects_odometry
        As of :class:`Session`.

    Raises
    ------
    ContourslamError
        If the map cannot be read or continued, or a setting or an extra is missing.
    """
    watch = Stopwatch()

    def begin(pose: Floats | None = initial_pose) -> Mapper:
        return make_mapper(config, initial_pose=pose, lidar_mount=lidar_mount, lap=watch)

    def keep(mapper: Mapper) -> SavedMap:
        about = {
            "contourslam": __version__,
            "back_end": config.back_end,
            "detector": config.detector,
            "made": datetime.now().astimezone().isoformat(timespec="seconds"),
        }
        return mapper.keep(about) if isinstance(mapper, Resuming) else keep_map(mapper, about)

    def lost(mapper: Mapper, pose: Floats | None) -> Mapper:
        known = keep(mapper)
        if config.back_end != "graph" or known.keyframes is None or not len(known.keyframes):
            return begin(initial_pose if pose is None else pose)
        return Resuming(known, config, live, initial_pose=pose, lidar_mount=lidar_mount, begin=begin, lap=watch)

    def go_on(saved: SavedMap, pose: Floats | None = None) -> Mapper:
        if config.back_end != "graph":
            raise ConfigError(f"a map is continued by the graph, not by {config.back_end}; choose --back-end graph")
        if saved.relations is None:
            raise MapError("this map cannot be continued, it holds landmarks alone; localise in it, or map anew")
        return Resuming(saved, config, live, initial_pose=pose, lidar_mount=lidar_mount, lap=watch)

    def standing(mapper: Mapper) -> tuple[Mapper, SavedMap | None]:
        return mapper.standing if isinstance(mapper, Resuming) else (mapper, None)

    first = None
    if map_file is not None:
        continued = load_map(map_file)

        def first() -> Mapper:
            return go_on(continued, initial_pose)

    backing = Backing(
        begin=begin, first=first, lost=lost, localized=lambda m: not isinstance(m, Resuming) or m.localized, keep=keep,
        open=go_on, write=save_map, read=load_map, standing=standing,
        guesses=config.back_end == "graph" or config.slam.contour_matching, stopwatch=watch,
    )  # fmt: skip
    return Session(
        backing, live, odometry_lag=config.slam.odometry_lag, autosave=autosave, clock=clock, topics=topics,
        expects_odometry=expects_odometry,
    )  # fmt: skip


def localization(
    config: Config,
    live: LiveConfig,
    map_file: Path,
    *,
    initial_pose: Floats | None = None,
    lidar_mount: Floats | None = None,
    clock: Callable[[], float] | None = None,
    topics: Mapping[Source, str] | None = None,
    expects_odometry: bool = True,
) -> Session:
    """Make a session that localises in a saved map, which it leaves as it is.

    Parameters
    ----------
    config : Config
    live : LiveConfig
    map_file : Path
    initial_pose : ndarray, shape (3,), optional
        About where the base is in the map as it starts; it is looked for everywhere by default.
    lidar_mount : ndarray, shape (3,), optional
        ``T_base_lidar``; that of the configuration by default.
    clock, topics, expects_odometry
        As of :class:`Session`.

    Raises
    ------
    ContourslamError
        If the map cannot be read, or nothing can be localised in it.
    """
    current = load_map(map_file)
    finder = Locator(KnownMap(current))  # made ready once: a robot that is lost must not wait for it
    watch = Stopwatch()

    def begin(pose: Floats | None = initial_pose) -> Mapper:
        return Localizer(current, config, finder=finder, initial_pose=pose, lidar_mount=lidar_mount, lap=watch)

    def lost(mapper: Mapper, pose: Floats | None) -> Mapper:
        return begin(pose)

    def open_map(saved: SavedMap) -> Mapper:
        nonlocal current, finder
        ready = Locator(KnownMap(saved))
        mapper = Localizer(saved, config, finder=ready, lidar_mount=lidar_mount, lap=watch)
        current, finder = saved, ready
        return mapper

    def localized(mapper: Mapper) -> bool:
        return isinstance(mapper, Localizer) and mapper.localized

    backing = Backing(
        begin=begin, lost=lost, localized=localized, keep=lambda mapper: current, open=open_map, write=save_map,
        read=load_map, standing=lambda mapper: (mapper, current), fixed=True, stopwatch=watch,
    )  # fmt: skip
    return Session(
        backing, live, odometry_lag=config.slam.odometry_lag, clock=clock, topics=topics,
        expects_odometry=expects_odometry,
    )  # fmt: skip
