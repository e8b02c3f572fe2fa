"""A sweep's results, wherever they lie, as its report needs them."""

from collections.abc import Mapping, Sequence
from typing import Any

from contourslam.errors import ResultError
from contourslam.experiments.sweep.store import open_results
from contourslam.report.sweep.values import Condition, Drive, Sweep, SweepRun

_HEAVY = ("traceback", "skipped")
"""Columns that the report does without."""
_FROM = "results"
"""Column that is added: the folder or URL of a row."""
_PLACE = ("lidar", "duration", "speed")
"""Axes that become a part of the place's name where the sweep has several of one."""


def read_sweep(urls: Sequence[str]) -> Sweep:
    """Read the results of one sweep or several, also while they run.

    Parameters
    ----------
    urls : sequence of str
        Paths or URLs of folders that ``contourslam sweep -o`` wrote.

    Returns
    -------
    Sweep

    Raises
    ------
    ResultError
        If there are no results or no run was done yet, a file cannot be read, or two runs go by the same name and are
        of different configurations, recordings, detectors or programs.
    ConfigError, MissingExtraError
        If the kind of URL is unknown, or its library is not installed.
    """
    rows: list[dict[str, Any]] = []
    texts: list[str] = []
    expected: set[str] = set()
    for url in urls:
        store, experiment = open_results(url)
        table = store.rows(experiment.keys)
        found = table.drop_columns([name for name in _HEAVY if name in table.column_names]).to_pylist()
        rows += [row | {_FROM: url} for row in found]
        texts.append(experiment.text)
        expected |= set(experiment.keys)
    if not rows:
        raise ResultError(f"{', '.join(urls)}: no run is done yet; wait for the first, or go on: contourslam sweep")
    return sweep_of(rows, texts, expected=len(expected))


def sweep_of(
    rows: Sequence[Mapping[str, Any]], experiments: Sequence[str] = (), *, expected: int | None = None
) -> Sweep:
    """Bring rows together.

    Parameters
    ----------
    rows : sequence of mapping
        By the columns of :mod:`contourslam.experiments.sweep.rows`; of two of the same run the later one is taken.
    experiments : sequence of str
        The experiment files as they stand.
    expected : int, optional
        How many runs the experiments have.

    Raises
    ------
    ResultError
        If two rows of the same name are not of the same run.
    """
    several = [name for name in _PLACE if len({row.get(name) for row in rows if row["source"] == "simulation"}) > 1]
    runs: dict[tuple[Drive, Condition, str], SweepRun] = {}
    for run in (_run(row, several) for row in rows):
        name = run.drive, run.condition, run.detector
        if name in runs and runs[name].row["key"] != run.row["key"]:
            raise ResultError(_differ(runs[name], run))
        runs[name] = run
    return Sweep(tuple(runs.values()), tuple(experiments), expected)


def _run(row: Mapping[str, Any], several: Sequence[str]) -> SweepRun:
    simulated = row["source"] == "simulation"
    setting = str(row["setting"])
    if simulated:
        drive = Drive(
            ", ".join([str(row["room"]), *(_told(name, row.get(name)) for name in several)]), int(row["seed"])
        )
        condition = Condition(setting, row.get("noise"), row.get("beams"))
    else:
        drive, condition = Drive(str(row["recording"]), 0), Condition(setting, None, None)
    error = "" if row["status"] == "done" else f"{row.get('error_type')}: {row.get('error')}".splitlines()[0]
    return SweepRun(drive, condition, str(row["detector"]), simulated, error, row)


def _differ(one: SweepRun, other: SweepRun) -> str:
    """Say which two runs go by one name, and what differs."""
    columns = (("config", "configurations"), ("recording_url", "recordings"), ("version", "versions of contourslam"))
    found = (said for column, said in columns if one.row.get(column) != other.row.get(column))
    places = " and ".join(dict.fromkeys(str(run.row.get(_FROM, "the results")) for run in (one, other)))
    where = f"{one.drive.place}, seed {one.drive.seed}" if one.simulated else one.drive.place
    return (
        f"{places}: setting {one.condition.setting!r} with {one.detector} in {where} is of two different "
        f"{next(found, 'detectors or recordings')}; rename one, or report them apart"
    )


def _told(name: str, value: Any) -> str:
    if name == "lidar":
        return str(value)
    unit = {"duration": "s", "speed": "m/s"}[name]
    return f"whole {name}" if value is None else f"{value:g} {unit}"
