"""The map that a run goes on in, and the one that it leaves."""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from contourslam.cli.console import progress
from contourslam.config import Config
from contourslam.errors import MapError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from contourslam.maps import SavedMap
    from contourslam.recordings import Message
    from contourslam.slam.mapper import Mapper

LOOK = 1000  # scans in which the start is looked for
GIVEN = (0.5, 0.5, math.radians(15.0))  # standard deviations of a pose that somebody gives: m, m, rad


class Growing(Protocol):
    """The beginning of a recording, of which more is read as it is needed."""

    def growing(self) -> "Iterator[Message]":
        """Yield its messages."""


class KeptMap:
    """Makes the mapper of a run, in an earlier map where there is one, and saves the map at its end.

    Parameters
    ----------
    settings : Config
    path : Path or None
        The map to go on in.
    given : (float, float, float), optional
        Where the drive begins: m, m, degrees.

    Attributes
    ----------
    pose : ndarray, shape (3,), or None
        Where the drive begins, as far as that is known.
    notes : list of str
        What is worth saying.

    Raises
    ------
    ContourslamError
        If the map cannot be read or continued.
    """

    def __init__(self, settings: Config, path: Path | None, given: tuple[float, float, float] | None) -> None:
        import numpy as np

        self._settings, self._path = settings, path
        self._mapper: Mapper | None = None
        self._saved: SavedMap | None = None
        self.notes: list[str] = []
        self.pose: NDArray[np.float64] | None = None
        if given is not None:
            self.pose = np.array([given[0], given[1], math.radians(given[2])])
        self._covariance = np.diag(np.square(GIVEN))
        if path is not None:
            from contourslam.maps import load_map
            from contourslam.replay import check_continuable

            self._saved = load_map(path)
            try:
                check_continuable(self._saved, settings)
            except MapError as error:
                raise MapError(f"{path}: {error}") from error

    def find_start(self, opening: Growing, mount: tuple[float, float, float] | None) -> None:
        """Find where in the map the drive begins.

        Raises
        ------
        MapError
            If the first scans do not show it, and nobody said where it is.
        """
        import numpy as np

        from contourslam.scan import LaserScan, Odometry

        if self._saved is None:
            return
        from contourslam.graph.start import find_start

        messages = (m for m in opening.growing() if isinstance(m, LaserScan | Odometry))
        scans = 0

        def first() -> "Iterator[LaserScan | Odometry]":
            nonlocal scans
            for message in messages:
                yield message
                scans += isinstance(message, LaserScan)
                if scans == LOOK:
                    return

        lidar, bar = None if mount is None else np.array(mount), progress(first(), "message")
        found = find_start(self._saved, self._settings, bar, guess=self.pose, lidar_mount=lidar)
        if found is not None:
            self.pose, self._covariance = found
            x, y, turn = self.pose
            at = f"x {x:.2f} m, y {y:.2f} m, {math.degrees(turn):.0f}°"
            self.notes.append(f"the drive was found to begin at {at} of {self._path}")
        elif scans == 0:
            return  # that there is none is said when the recording is mapped
        elif self.pose is None:
            raise MapError(
                f"{self._path}: none of the first {scans} scans shows where in this map the drive begins; say about "
                "where with --initial-pose X Y DEGREES, or map anew without --map"
            )
        else:
            self.notes.append("the first scans do not show where the drive begins; --initial-pose is taken as it is")

    def make(self, config: Config, detector: Any = None, **options: Any) -> "Mapper":
        """Make the mapper: the arguments are those of :func:`contourslam.replay.make_mapper`."""
        from contourslam.replay import continue_mapper, make_mapper

        if self._saved is None:
            self._mapper = make_mapper(config, detector, **options)
        else:
            self._mapper = continue_mapper(self._saved, self._covariance, config, detector, **options)
        return self._mapper

    def keep(self, path: Path, recording: str) -> None:
        """Save the map of the mapper that was made."""
        from datetime import datetime

        from contourslam import __version__
        from contourslam.maps import save_map
        from contourslam.replay import keep_map

        if self._mapper is None:
            return
        before = "" if self._saved is None else self._saved.about.get("recordings", "") + "\n"
        about = {
            "contourslam": __version__,
            "back_end": self._settings.back_end,
            "detector": self._settings.detector,
            "made": datetime.now().astimezone().isoformat(timespec="seconds"),
            "recordings": f"{before}{recording}".strip(),
        }
        save_map(path, keep_map(self._mapper, about))
