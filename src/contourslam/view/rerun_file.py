"""A file for the Rerun viewer (.rrd), written row by row while the work goes on."""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from contourslam.errors import ConfigError, MissingExtraError, ResultError

try:
    import rerun as rr
except ModuleNotFoundError as missing:
    if missing.name != "rerun":
        raise
    raise MissingExtraError(
        "rerun-sdk writes the .rrd file and is not installed: pip install 'contourslam[rerun]'"
    ) from missing

SCAN, STAMP = "scan", "stamp"
"""The two time lines: the number of the scan, from 0, and its stamp."""
BATCH = 100  # scans that are written at once: each batch of each entity costs a kilobyte beside its rows
A_DATE = 1e8  # s; stamps from here on count from 1970 and are shown as dates
PATIENCE = 60.0  # s that a disk may take
Columns = Callable[..., Any]
_OFF = ("0", "false", "off")


def check_writable(path: Path, *, overwrite: bool) -> None:
    """Refuse what can be known to go wrong before anything is touched.

    Raises
    ------
    ConfigError
        If the suffix is another one, or the environment has switched Rerun off.
    ResultError
        If the file is there already, and `overwrite` is off.
    """
    if path.suffix != ".rrd":
        raise ConfigError(f"{path}: a Rerun file ends in .rrd; name it {path.name}.rrd")
    if path.exists() and not overwrite:
        raise ResultError(f"{path} is there already; choose another name, or replace it with --overwrite")
    if (switch := os.environ.get("RERUN", "")).lower() in _OFF:  # then the SDK writes nothing, and says nothing of it
        raise ConfigError(f"{path}: Rerun is switched off by RERUN={switch!r} in the environment")


class RerunFile:
    """A recording of the Rerun SDK that is written to a file; changed in place by each row.

    Nothing is sent anywhere and no viewer is started. Where the disk fills up, the file keeps what it has got,
    `trouble` says so, and further rows are dropped: whoever maps loses nothing.

    Parameters
    ----------
    path : Path
        File to write, .rrd.
    title : str
        What the viewer calls the recording.
    overwrite : bool
        Replace a file that is there.

    Attributes
    ----------
    stream : rerun.RecordingStream
        For what belongs to no scan.
    trouble : str
        What ended the writing early.

    Raises
    ------
    ConfigError
        If the suffix is another one, or the environment has switched Rerun off.
    ResultError
        If the file is there already, or cannot be written.
    """

    def __init__(self, path: Path, title: str, *, overwrite: bool = False) -> None:
        check_writable(path, overwrite=overwrite)
        self.path, self.trouble = path, ""
        self._tables: dict[str, tuple[Columns, list[tuple[int, float, int, dict[str, Any]]]]] = {}
        self._dates: bool | None = None
        self._last = 0
        self.stream = rr.RecordingStream("contourslam")
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.unlink(missing_ok=True)
            self.stream.save(path)
        except (OSError, RuntimeError) as error:
            raise ResultError(f"{path}: cannot be written ({error}); choose another place") from error
        self.stream.send_recording_name(title)

    def add(self, entity: str, columns: Columns, index: int, stamp: float, **components: Any) -> None:
        """Add a row to an entity: what it is from this scan on.

        Parameters
        ----------
        entity : str
            Path.
        columns : callable
            Makes columns of the components, such as ``rerun.Points3D.columns``; the same for all rows of the entity.
        index : int
            Number of the scan.
        stamp : float
            Its stamp, s.
        **components : ndarray or list
            All of one length; of length 0, the entity shows nothing.
        """
        length = len(next(iter(components.values())))
        self._tables.setdefault(entity, (columns, []))[1].append((index, stamp, length, components))

    def scan_done(self, index: int) -> None:
        """Write what has come together, once it is enough."""
        if index >= self._last + BATCH:
            self.write()
            self._last = index

    def lay_out(self, blueprint: Any) -> None:
        """Say how the viewer shows it; the last word holds."""
        self.stream.send_blueprint(blueprint)

    def fix(self, entity: str, what: Any) -> None:
        """Set what an entity is at all times."""
        self.stream.log(entity, what, static=True, strict=True)

    def write(self) -> None:
        """Write all rows that wait, and let the disk have them."""
        tables, self._tables = self._tables, {}
        if self.trouble:
            return
        for entity, (columns, rows) in tables.items():
            self._send(entity, columns, rows)
        try:
            self.stream.flush(timeout_sec=PATIENCE)
        except RuntimeError as error:  # the SDK writes in a thread of its own, and says no more than this of its end
            self.trouble = f"{self.path}: ends early, for it could not be written on ({error}); free space on the disk"

    def close(self) -> None:
        """Write all that waits, and end the file."""
        self.write()
        self.stream.disconnect()

    def _send(self, entity: str, columns: Columns, rows: list[tuple[int, float, int, dict[str, Any]]]) -> None:
        stamps = np.array([row[1] for row in rows])
        if self._dates is None:
            self._dates = bool(stamps[0] > A_DATE)
        since = np.rint(stamps * 1e9).astype(np.int64)
        times = [
            rr.TimeColumn(SCAN, sequence=[row[0] for row in rows]),
            rr.TimeColumn(STAMP, timestamp=since.astype("datetime64[ns]"))
            if self._dates
            else rr.TimeColumn(STAMP, duration=since.astype("timedelta64[ns]")),
        ]
        together = {name: _joined([row[3][name] for row in rows]) for name in rows[0][3]}
        made = columns(**together).partition([row[2] for row in rows])
        self.stream.send_columns(entity, indexes=times, columns=made, strict=True)


def _joined(parts: list[Any]) -> Any:
    if isinstance(parts[0], list):
        return [one for part in parts for one in part]
    return np.concatenate(parts)
