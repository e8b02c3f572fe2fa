"""What a session stands on, handed to it so that it works over any mapper and any way of keeping maps."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from contourslam.contour.contours import Floats
from contourslam.maps.saved_map import SavedMap
from contourslam.replay import Stopwatch
from contourslam.slam.mapper import Mapper


def _always(mapper: Mapper) -> bool:
    return True


def _itself(mapper: Mapper) -> tuple[Mapper, SavedMap | None]:
    return mapper, None


@dataclass(frozen=True, slots=True)
class Backing:
    """Mappers and map files; :mod:`contourslam.live.start` makes it for mapping and for localisation.

    Attributes
    ----------
    begin : callable
        Make a mapper that begins anew.
    lost : callable
        Given a mapper whose robot may be anywhere now, and about where somebody says it is (None: nobody does), make
        the mapper that goes on; it may be the same one.
    localized : callable
        Whether a mapper knows where the robot is; it always does by default.
    first : callable or None
        Make the mapper to start with; as `begin` by default.
    keep : callable or None
        Make a map to be saved of a mapper; None where that cannot be done.
    open : callable or None
        Make a mapper that continues a saved map, or localises in it.
    write, read : callable or None
        Write a map to a file, atomically, and read it: :func:`contourslam.maps.file.save_map` and ``load_map``.
    standing : callable
        Given a mapper, the one that works inside it now, and the map in which that localises, or None where it maps;
        the mapper itself by default.
    fixed : bool
        The map never changes: localisation.
    guesses : bool
        The mapper finds motion from the scans where the odometry is silent; else it waits for the odometry to catch up.
    stopwatch : Stopwatch
        What the mappers tell the end of each stage.
    """

    begin: Callable[[], Mapper]
    lost: Callable[[Mapper, Floats | None], Mapper]
    localized: Callable[[Mapper], bool] = _always
    first: Callable[[], Mapper] | None = None
    keep: Callable[[Mapper], SavedMap] | None = None
    open: Callable[[SavedMap], Mapper] | None = None
    write: Callable[[Path, SavedMap], None] | None = None
    read: Callable[[Path], SavedMap] | None = None
    standing: Callable[[Mapper], tuple[Mapper, SavedMap | None]] = _itself
    fixed: bool = False
    guesses: bool = True
    stopwatch: Stopwatch = field(default_factory=Stopwatch)
