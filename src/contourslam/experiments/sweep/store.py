"""Where the rows are kept: on any file system that fsspec knows, one small file a run, brought into tables later.

Below the results' place::

    experiment.json      the experiment, as it was read, and the keys of its runs
    starts/SESSION/KEY/  a mark for each time that a run was begun
    parts/KEY.done.parquet, parts/KEY.failed.parquet    one row each, written as soon as the run is over
    tables/ID.parquet    rows together; never changed, and removed only once another table holds all that is in it
    results.parquet      all rows, a copy for other tools

Whoever reads takes the union, each run once. So several sweeps may write to one place, and crash, and no row is lost.
"""

import json
import secrets
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

from contourslam.errors import ResultError
from contourslam.evaluation.extras import require
from contourslam.experiments.sweep.place import Place
from contourslam.experiments.sweep.rows import DONE, FAILED, Row, table_of

_AT_ONCE = 16  # files read side by side: elsewhere, each is a wait
_READINGS = 20  # until files keep still that another sweep brings together
_COPY = "results.parquet"


@dataclass(frozen=True, slots=True)
class Planned:
    """What ``experiment.json`` says.

    Attributes
    ----------
    name : str
        Of the experiment.
    text : str
        The experiment file.
    keys : tuple of str
        Of its runs.
    """

    name: str
    text: str
    keys: tuple[str, ...]


class Store:
    """The results of one experiment.

    Parameters
    ----------
    url : str
        Path or URL of a folder; made where needed.

    Attributes
    ----------
    damaged : tuple of str
        Files of one row each that the last reading found damaged and left out: their runs count as not done.

    Raises
    ------
    ConfigError, MissingExtraError
        If the kind of URL is unknown, or its library is not installed.
    """

    def __init__(self, url: str) -> None:
        self._place = Place(url)
        self.url = self._place.url
        self.damaged: tuple[str, ...] = ()
        self._known: dict[str, dict[str, str]] = {}

    def planned(self) -> Planned | None:
        """The experiment as it was last read; None where there is none.

        Raises
        ------
        ResultError
            If the place is no folder, or its ``experiment.json`` is none of a sweep.
        """
        there = self._place.read("experiment.json")
        if there is None:
            return None
        try:
            said = json.loads(there)
            return Planned(str(said["name"]), str(said["text"]), tuple(map(str, said["keys"])))
        except (ValueError, KeyError, TypeError) as error:
            raise ResultError(
                f"{self.url}/experiment.json: is none of a sweep ({error!r}); remove it, or choose another folder"
            ) from error

    def check_name(self, name: str) -> None:
        """Refuse an experiment of another name than the one whose results are here.

        Raises
        ------
        ResultError
            If the results are another experiment's.
        """
        there = self.planned()
        if there is not None and there.name != name:
            raise ResultError(f"{self.url} holds the results of {there.name!r}, not of {name!r}; choose another folder")

    def write_experiment(self, name: str, text: str, keys: Sequence[str]) -> None:
        """Note which experiment this is and which runs belong to it.

        Raises
        ------
        ResultError
            If the results are another experiment's, or cannot be written.
        """
        self.check_name(name)
        self._place.write("experiment.json", json.dumps({"name": name, "text": text, "keys": list(keys)}).encode())

    def begin(self, session: str, key: str) -> int:
        """Mark that a run is begun, and tell how often it has been in this session, this time included."""
        folder = f"starts/{session}/{key}"
        tries = len(self._place.names(folder)) + 1
        self._place.write(f"{folder}/{tries}", b"")
        return tries

    def starts(self) -> dict[str, int]:
        """How often each run was begun, by its key, in all sessions since the marks were last removed."""
        counts: dict[str, int] = {}
        for path in self._place.below("starts"):
            key = path.split("/")[-2]
            counts[key] = counts.get(key, 0) + 1
        return counts

    def remove_starts(self) -> None:
        """Remove the marks of runs begun."""
        self._place.remove_folder("starts")

    def write_row(self, row: Row) -> None:
        """Keep a row, whole or not at all; one that was done stands above one that failed.

        Raises
        ------
        ResultError
            If it cannot be written.
        """
        self._write_table(_part(row["key"], row["status"]), table_of([row]))
        if row["status"] == DONE:
            self._place.remove(_part(row["key"], FAILED))

    def status_of(self, key: str) -> str | None:
        """``done`` or ``failed`` of a run that has a row of its own, ``done`` of one that is in a table; else None.

        What failed in a table is no answer: it may be there since before it was to be done again.
        """
        for status in (DONE, FAILED):
            if self._place.exists(_part(key, status)):
                return status
        for name in self._tables():
            if name not in self._known and (content := self._place.read(name)) is not None:
                self._known[name] = _statuses(_parsed(content, ["key", "status"]))
            if self._known.get(name, {}).get(key) == DONE:
                return DONE
        return None

    def forget_failed(self, keys: Iterable[str]) -> None:
        """Remove rows of runs that failed and are to be done again, and what was found damaged of them."""
        wanted = set(keys)
        failed = {_part(key, status) for key, status in self._parts() if status == FAILED and key in wanted}
        for name in failed | {name for name in self.damaged if name.split("/")[1].partition(".")[0] in wanted}:
            self._place.remove(name)

    def status(self) -> dict[str, str]:
        """``done`` or ``failed`` of every run that has a row, by its key.

        Raises
        ------
        ResultError
            As :meth:`read`.
        """
        found: dict[str, str] = {}
        for table in self._files(["key", "status"]).values():
            found |= {key: status for key, status in _statuses(table).items() if found.get(key) != DONE}
        return found

    def read(self) -> Any:
        """Every row, of earlier programs and experiments too, each run once: a ``pyarrow.Table``.

        Of several rows of a run, one that was done stands above one that failed, and the later above the earlier.

        Raises
        ------
        ResultError
            If a table cannot be read. A row's own file that is damaged is left out, and is then in `damaged`.
        """
        return _once(self._files().values())

    def rows(self, keys: Iterable[str]) -> Any:
        """Rows of some runs, those that are there, in their order: a ``pyarrow.Table``."""
        table = self.read()
        place = {key: row for row, key in enumerate(table.column("key").to_pylist())}
        return table.take(_pa().array([place[key] for key in keys if key in place], "int64"))

    def compact(self) -> int:
        """Bring all rows into one table and into ``results.parquet``, then remove the files that they came from.

        Returns
        -------
        int
            How many rows there are.

        Raises
        ------
        ResultError
            If a file cannot be read or written.
        """
        found = self._files()
        if len(found) == 1 and next(iter(found)).startswith("tables/") and self._place.exists(_COPY):
            return int(_once(found.values()).num_rows)
        self._write_table(f"tables/{secrets.token_hex(16)}.parquet", _once(found.values()))
        # Only what was read is removed: what came meanwhile stays, the table of another who does the same too.
        for name in found:
            if name != _COPY:
                self._place.remove(name)
        table = self.read()
        self._write_table(_COPY, table)
        return int(table.num_rows)

    def _files(self, columns: list[str] | None = None) -> dict[str, Any]:
        """Content of all files of rows by their names, tables first; read anew where another sweep removed one."""
        for _ in range(_READINGS):
            # Parts are listed before tables: one that is gone by then is in a table that is listed.
            parts = [_part(*part) for part in self._parts()]
            tables = self._tables() or ([_COPY] if self._place.exists(_COPY) else [])
            with ThreadPoolExecutor(_AT_ONCE) as pool:
                contents = list(pool.map(self._place.read, tables + parts))
            whole = [content for content in contents if content is not None]
            if len(whole) < len(contents):
                continue
            damaged, found = [], {}
            for name, content in zip(tables + parts, whole, strict=True):
                try:
                    found[name] = _parsed(content, columns)
                except (OSError, ValueError, KeyError, _pa().ArrowException) as error:
                    if name in tables:
                        raise ResultError(
                            f"{self.url}/{name}: cannot be read ({error}); remove it, and its runs are done again"
                        ) from error
                    damaged.append(name)
            self.damaged = tuple(damaged)
            return found
        raise ResultError(f"{self.url}: others bring its rows together all the time; try again")

    def _parts(self) -> list[tuple[str, str]]:
        names = [name.split(".") for name in self._place.names("parts") if name.endswith(".parquet")]
        return [(name[0], name[1]) for name in names if len(name) == 3]

    def _tables(self) -> list[str]:
        return [f"tables/{name}" for name in self._place.names("tables") if name.endswith(".parquet")]

    def _write_table(self, name: str, table: Any) -> None:
        sink = _pa().BufferOutputStream()
        require("pyarrow.parquet", "sweep").write_table(table, sink)
        self._place.write(name, sink.getvalue().to_pybytes())


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
        :mod:`contourslam.experiments.sweep.rows`. What was found damaged is left out.

    Raises
    ------
    ResultError
        If there are no results, or a table cannot be read.
    ConfigError, MissingExtraError
        If the kind of URL is unknown, or its library is not installed.
    """
    store, planned = open_results(url)
    return store.read() if every else store.rows(planned.keys)


def open_results(url: str) -> tuple[Store, Planned]:
    """Open the results of a sweep that was begun. Errors as :func:`read_results`."""
    store = Store(url)
    planned = store.planned()
    if planned is None:
        raise ResultError(f"{url}: holds no results of a sweep; name the folder that `contourslam sweep -o` wrote")
    return store, planned


def _pa() -> Any:
    return require("pyarrow", "sweep")


def _part(key: str, status: str) -> str:
    return f"parts/{key}.{status}.parquet"


def _parsed(content: bytes, columns: list[str] | None) -> Any:
    # It is in memory and small: Arrow's threads would cost more than they save.
    parquet, source = require("pyarrow.parquet", "sweep"), _pa().BufferReader(content)
    table = parquet.read_table(source, columns=columns, use_threads=False, pre_buffer=False)
    if not {"key", "status"} <= set(table.column_names):
        raise ValueError("it holds no rows of a sweep")
    return table


def _statuses(table: Any) -> dict[str, str]:
    return dict(zip(table.column("key").to_pylist(), table.column("status").to_pylist(), strict=True))


def _once(tables: Iterable[Any]) -> Any:
    """One row a run: one that was done stands above one that failed, then what was started later."""
    several = list(tables)
    if not several:
        return table_of([])
    table = _pa().concat_tables(several, promote_options="default")
    best: dict[str, tuple[bool, Any, int]] = {}
    columns = (table.column(name).to_pylist() for name in ("key", "status", "started"))
    for row, (key, status, started) in enumerate(zip(*columns, strict=True)):
        if key not in best or best[key] < (status == DONE, started, row):
            best[key] = (status == DONE, started, row)
    return table.take(_pa().array([row for *_, row in best.values()], "int64"))
