"""Where the rows are kept: on any file system that fsspec knows, one small file a run, and one table in the end.

Below the results' place::

    experiment.json      the experiment, as it was read, and the keys of its runs
    starts/SESSION/KEY/  a mark for each time that a run was begun
    parts/KEY.done.parquet, parts/KEY.failed.parquet    one row each, written as soon as the run is over
    results.parquet      the rows together

A run that is done twice by accident is written to the same place twice, so every row is there once.
"""

import json
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from contourslam.atomic import write_bytes
from contourslam.errors import ContourslamError, ResultError
from contourslam.experiments.sweep.extras import require
from contourslam.experiments.sweep.files import is_local, open_place
from contourslam.experiments.sweep.rows import DONE, FAILED, Row, table_of

_AT_ONCE = 16  # files read side by side: elsewhere, each is a wait


class Store:
    """The results of one experiment.

    Parameters
    ----------
    url : str
        Path or URL of a folder; made where needed.

    Raises
    ------
    ConfigError, MissingExtraError
        If the kind of URL is unknown, or its library is not installed.
    """

    def __init__(self, url: str) -> None:
        self.url = url if "://" in url else str(Path(url).resolve())
        self._system, self._root = open_place(self.url)

    def write_experiment(self, name: str, text: str, keys: list[str]) -> None:
        """Note which experiment this is and which runs belong to it.

        Raises
        ------
        ResultError
            If the results are another experiment's, or cannot be written.
        """
        there = self._read("experiment.json")
        if there is not None:
            other = json.loads(there).get("name")
            if other != name:
                raise ResultError(f"{self.url} holds the results of {other!r}, not of {name!r}; choose another folder")
        self._write("experiment.json", json.dumps({"name": name, "text": text, "keys": keys}).encode())

    def keys(self) -> list[str] | None:
        """Keys of the runs that belong to the experiment as it was last read; None where there is none."""
        there = self._read("experiment.json")
        return None if there is None else list(json.loads(there)["keys"])

    def begin(self, session: str, key: str) -> int:
        """Mark that a run is begun, and tell how often it has been in this session, this time included."""
        folder = f"starts/{session}/{key}"
        tries = len(self._names(folder)) + 1
        self._write(f"{folder}/{tries}", b"")
        return tries

    def starts(self) -> dict[str, int]:
        """How often each run was begun, by its key, in all sessions since the marks were last removed."""
        counts: dict[str, int] = {}
        for path in self._system.find(f"{self._root}/starts"):
            key = str(path).split("/")[-2]
            counts[key] = counts.get(key, 0) + 1
        return counts

    def write_row(self, row: Row) -> None:
        """Keep a row, whole or not at all; one that was done stands above one that failed.

        Raises
        ------
        ResultError
            If it cannot be written.
        """
        pa, parquet = require("pyarrow"), require("pyarrow.parquet")
        sink = pa.BufferOutputStream()
        parquet.write_table(table_of([row]), sink)
        self._write(_part(row["key"], row["status"]), sink.getvalue().to_pybytes())
        if row["status"] == DONE:
            self._remove(_part(row["key"], FAILED))

    def status_of(self, key: str) -> str | None:
        """``done`` or ``failed`` where the run has a row of its own; None where it has not."""
        there = (status for status in (DONE, FAILED) if self._system.exists(f"{self._root}/{_part(key, status)}"))
        return next(there, None)

    def forget_failed(self, keys: Iterable[str]) -> None:
        """Remove rows of runs that failed and are to be done again."""
        failed = {key for key, status in self._parts() if status == FAILED}
        for key in failed & set(keys):
            self._remove(_part(key, FAILED))

    def status(self) -> dict[str, str]:
        """``done`` or ``failed`` of every run that has a row, by its key; cheap."""
        table = self._table(["key", "status"])
        found = {} if table is None else dict(zip(*(table.column(i).to_pylist() for i in range(2)), strict=True))
        for key, status in self._parts():
            if found.get(key) != DONE:
                found[key] = status
        return found

    def read(self) -> Any:
        """Every row, of earlier programs and experiments too, once: a ``pyarrow.Table``.

        Raises
        ------
        ResultError
            If a file cannot be read.
        """
        pa = require("pyarrow")
        table = self._table()
        there = set() if table is None else set(table.column("key").to_pylist())
        done = set() if table is None else {k for k, s in _statuses(table) if s == DONE}
        parts = [part for part in self._parts() if part[0] not in done]
        parts = [part for part in parts if part[1] == DONE or (part[0], DONE) not in parts]
        with ThreadPoolExecutor(_AT_ONCE) as pool:
            rows = list(pool.map(lambda part: self._parquet(_part(*part)), parts))
        newer = {key for key, _ in parts}
        if table is not None and there & newer:
            kept = [key not in newer for key in table.column("key").to_pylist()]
            table = table.filter(pa.array(kept))
        tables = [each for each in (table, *rows) if each is not None]
        return pa.concat_tables(tables, promote_options="default") if tables else table_of([])

    def compact(self) -> int:
        """Bring all rows into ``results.parquet``, then remove the files that they came from.

        Returns
        -------
        int
            How many rows there are.

        Raises
        ------
        ResultError
            If a file cannot be read or written.
        """
        pa, parquet = require("pyarrow"), require("pyarrow.parquet")
        parts = self._parts()
        table = self.read()
        if parts or self._table(["key"]) is None:
            sink = pa.BufferOutputStream()
            parquet.write_table(table, sink)
            self._write("results.parquet", sink.getvalue().to_pybytes())
            for part in parts:
                self._remove(_part(*part))
        return int(table.num_rows)

    def remove_starts(self) -> None:
        """Remove the marks of runs begun."""
        if self._system.exists(f"{self._root}/starts"):
            self._system.rm(f"{self._root}/starts", recursive=True)

    def _parts(self) -> list[tuple[str, str]]:
        names = [name.split(".") for name in self._names("parts") if name.endswith(".parquet")]
        return [(name[0], name[1]) for name in names if len(name) == 3]

    def _names(self, folder: str) -> list[str]:
        self._system.invalidate_cache()
        try:
            found = self._system.ls(f"{self._root}/{folder}", detail=False)
        except FileNotFoundError:
            return []
        return sorted(name for name in (str(path).rpartition("/")[2] for path in found) if not name.startswith("."))

    def _table(self, columns: list[str] | None = None) -> Any:
        self._system.invalidate_cache()
        there = self._system.exists(f"{self._root}/results.parquet")
        return self._parquet("results.parquet", columns) if there else None

    def _parquet(self, name: str, columns: list[str] | None = None) -> Any:
        parquet = require("pyarrow.parquet")
        path = f"{self._root}/{name}"
        try:
            with self._system.open(path, "rb") as file:
                return parquet.read_table(file, columns=columns)
        except (OSError, ValueError, require("pyarrow").ArrowException) as error:
            raise ResultError(f"{path}: cannot be read ({error}); remove it, and its runs are done again") from error

    def _read(self, name: str) -> bytes | None:
        try:
            return bytes(self._system.cat_file(f"{self._root}/{name}"))
        except FileNotFoundError:
            return None

    def _write(self, name: str, content: bytes) -> None:
        path = f"{self._root}/{name}"
        if is_local(self._system):
            write_bytes(Path(path), content)
            return
        try:
            self._system.pipe_file(path, content)  # object stores show an object once it is whole
        except ContourslamError:
            raise
        except Exception as error:  # each store has errors of its own
            raise ResultError(f"{self.url}: {name} cannot be written ({error})") from error

    def _remove(self, name: str) -> None:
        try:
            self._system.rm_file(f"{self._root}/{name}")
        except FileNotFoundError:
            return


def read_results(url: str, *, every: bool = False) -> Any:
    """Read the rows of a sweep, also while it runs and after it was interrupted.

    Parameters
    ----------
    url : str
        What was given as ``-o``.
    every : bool
        Also the rows of runs that no longer belong to the experiment: of earlier programs, or of what was taken out.

    Returns
    -------
    pyarrow.Table
        One row a run, in the order of the experiment, with the columns of
        :mod:`contourslam.experiments.sweep.rows`.

    Raises
    ------
    ResultError
        If there are no results, or a file cannot be read.
    ConfigError, MissingExtraError
        If the kind of URL is unknown, or its library is not installed.
    """
    store = Store(url)
    keys = store.keys()
    if keys is None:
        raise ResultError(f"{url}: holds no results of a sweep; name the folder that `contourslam sweep -o` wrote")
    table = store.read()
    if every:
        return table
    place = {key: row for row, key in enumerate(table.column("key").to_pylist())}
    return table.take(require("pyarrow").array([place[key] for key in keys if key in place], "int64"))


def _part(key: str, status: str) -> str:
    return f"parts/{key}.{status}.parquet"


def _statuses(table: Any) -> list[tuple[str, str]]:
    return list(zip(table.column("key").to_pylist(), table.column("status").to_pylist(), strict=True))
