"""Sessions ready to use, one for mapping and one for localisation: what a node or a command needs to know."""

from collections.abc import Callable
from pathlib import Path

from contourslam.config import Config, LiveConfig
from contourslam.contour.contours import Floats
from contourslam.live.session import Session


def mapping(
    config: Config,
    live: LiveConfig,
    *,
    map_file: Path | None = None,
    autosave: Path | None = None,
    initial_pose: Floats | None = None,
    lidar_mount: Floats | None = None,
    clock: Callable[[], float] | None = None,
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
        Of the base in a new map; the origin by default.
    lidar_mount : ndarray, shape (3,), optional
        ``T_base_lidar``; that of the configuration by default.
    clock : callable, optional
        What the session's `now` comes from, see :class:`Session`.

    Raises
    ------
    ContourslamError
        If the map cannot be read, or a setting or an extra is missing.
    """
    raise NotImplementedError


def localization(
    config: Config,
    live: LiveConfig,
    map_file: Path,
    *,
    initial_pose: Floats | None = None,
    lidar_mount: Floats | None = None,
    clock: Callable[[], float] | None = None,
) -> Session:
    """Make a session that localises in a saved map, which it leaves as it is.

    Parameters
    ----------
    config : Config
    live : LiveConfig
    map_file : Path
    initial_pose : ndarray, shape (3,), optional
        A first guess of the base in the map; it is looked for everywhere by default.
    lidar_mount, clock
        As for :func:`mapping`.

    Raises
    ------
    ContourslamError
        If the map cannot be read, or nothing can be localised in it.
    """
    raise NotImplementedError
