"""The map saved by itself, beside the work, so that a slow card holds up no scan."""

import math
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path

from contourslam.maps.saved_map import SavedMap

RESTS = 200  # times as long as it takes to make a map, no other is made


class Autosave:
    """Writes a map every so often while it changes, in a thread of its own; changed in place.

    A failure is kept in `trouble`, and the next try is made a period later.

    Parameters
    ----------
    path : Path
    period : float
        s.
    write : callable
        Writes a map to a file, atomically.

    Attributes
    ----------
    path : Path
    trouble : str
        What was wrong with the last try; empty where nothing was.
    saved_at : float
        When the last map that was written whole was handed over, on the caller's clock, s; NaN before the first.
    """

    def __init__(self, path: Path, period: float, write: Callable[[Path, SavedMap], None]) -> None:
        self.path, self._period, self._write = path, period, write
        self.trouble, self.saved_at = "", math.nan
        self._version = 0
        self._next = math.nan
        self._at, self._handed = math.nan, 0
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="autosave")
        self._writing: Future[None] | None = None

    def due(self, version: int, now: float) -> bool:
        """Whether a map of this version is to be handed over now."""
        self._collect(wait=False)
        if math.isnan(self._next):
            self._next = now + self._period
        return self._writing is None and now >= self._next and version != self._version

    def hand_over(self, keep: Callable[[], SavedMap], version: int, now: float) -> None:
        """Make the map, here, and have it written, there."""
        self._next = now + self._period
        try:
            saved = keep()
        except Exception as error:  # whatever is wrong with saving must not end the drive
            self.trouble = str(error) or repr(error)
            return
        self._at, self._handed = now, version
        self._writing = self._thread.submit(self._write, self.path, saved)

    def took(self, seconds: float, now: float) -> None:
        """Say how long the work was held up to make the map: the larger it is, the rarer it is saved."""
        self._next = max(self._next, now + RESTS * seconds)

    def set_aside(self, keep: Callable[[], SavedMap]) -> None:
        """Write the map beside the file, as ``previous-NAME``, before it is left for another."""
        self._collect(wait=True)
        try:
            self._write(self.path.with_name(f"previous-{self.path.name}"), keep())
        except Exception as error:  # as above
            self.trouble = str(error) or repr(error)

    def close(self, keep: Callable[[], SavedMap], version: int, now: float) -> None:
        """Write what has not been written yet, and end the thread."""
        self._collect(wait=True)
        if version != self._version:
            self.hand_over(keep, version, now)
            self._collect(wait=True)
        self._thread.shutdown()

    def _collect(self, *, wait: bool) -> None:
        writing = self._writing
        if writing is None or not (wait or writing.done()):
            return
        self._writing = None
        error = writing.exception()
        self.trouble = "" if error is None else str(error) or repr(error)
        if error is None:
            self.saved_at, self._version = self._at, self._handed
