"""The row of a run: what was varied, what it gave or why it failed, and by which program; and tables of rows.

Columns (SI units, angles in rad; empty where a thing is not known or does not apply):

``key``
    Name of the run: 32 hexadecimal digits.
``status``
    ``done`` or ``failed``.
``source``
    ``simulation`` or ``recording``.
``recording``, ``recording_url``
    Name and place of a recording.
``room``, ``seed``, ``noise``, ``beams``, ``lidar``, ``duration``, ``speed``
    Of a simulated drive.
``detector``, ``setting``, ``back_end``
    What it was replayed through.
``version``
    Of the package, with a digest of its source: rows of one version are comparable.
``config``
    The complete configuration of the run as JSON.
``host``, ``python``, ``libraries``, ``started``, ``seconds``, ``tries``
    Where, with what, when (UTC), and how long it took with all that was done for it; on which try.
``error_type``, ``error``, ``traceback``
    Of a failed run.
``skipped``
    What of the recording could not be used and how often, as JSON.

Every other column is a figure of :mod:`contourslam.evaluation.metrics`, by its name there: ``rmse.x``, ``ate.rmse``,
``odometry_rmse.x``, ``relations.translation.mean``, ``odometry_relations.translation.mean``, ``detection.recall``,
``nees``, ``landmarks.corners``, ... Its ``seconds`` per stage are ``stage_seconds.STAGE`` here.
"""

import json
import platform
import socket
import traceback
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from typing import Any

from contourslam.evaluation.extras import require
from contourslam.evaluation.metrics import Metrics
from contourslam.experiments.sweep.runs import Run
from contourslam.experiments.sweep.versions import libraries, program

DONE, FAILED = "done", "failed"
Row = dict[str, Any]

FIXED = {
    "key": "string", "status": "string", "source": "string", "recording": "string", "recording_url": "string",
    "room": "string", "seed": "int64", "noise": "float64", "beams": "int64", "lidar": "string", "duration": "float64",
    "speed": "float64", "detector": "string", "setting": "string", "back_end": "string", "version": "string",
    "config": "string", "host": "string", "python": "string", "libraries": "string", "started": "time",
    "seconds": "float64", "tries": "int64", "error_type": "string", "error": "string", "traceback": "string",
    "skipped": "string",
}  # fmt: skip
"""Columns that every table has, in this order; those of the figures follow."""
_NOT_FIGURES = ("detector", "back_end", "skipped", "seconds")


def done_row(run: Run, metrics: Metrics, *, started: datetime, seconds: float, tries: int) -> Row:
    """Row of a run that came to its end; where its recording did not, the row says `failed` and still has the figures.

    Parameters
    ----------
    run : Run
    metrics : dict
    started : datetime
        With its time zone.
    seconds : float
    tries : int
    """
    skipped = metrics["skipped"]
    row = _row(run, DONE if metrics["complete"] else FAILED, started, seconds, tries)
    row |= {"skipped": json.dumps(skipped)}
    if not metrics["complete"]:
        reason = list(skipped)[-1] if skipped else "it ended early"
        row |= {"error_type": "RecordingError", "error": f"the recording breaks off: {reason}"}
    figures = {name: value for name, value in metrics.items() if name not in _NOT_FIGURES}
    return row | _flat(figures) | _flat({"stage_seconds": metrics["seconds"]})


def failed_row(run: Run, error: BaseException, *, started: datetime, seconds: float, tries: int) -> Row:
    """Row of a run that failed.

    Parameters
    ----------
    run : Run
    error : BaseException
    started : datetime
        With its time zone.
    seconds : float
    tries : int
    """
    row = _row(run, FAILED, started, seconds, tries)
    told = "".join(traceback.format_exception(error)) if error.__traceback__ is not None else ""
    return row | {"error_type": type(error).__name__, "error": str(error) or repr(error), "traceback": told}


def table_of(rows: Sequence[Row]) -> Any:
    """Rows as a ``pyarrow.Table``: the fixed columns, then the figures in alphabetical order."""
    pa = require("pyarrow", "sweep")
    figures = sorted({name for row in rows for name in row} - set(FIXED))
    kinds = {"string": pa.string(), "int64": pa.int64(), "float64": pa.float64(), "time": pa.timestamp("us", tz="UTC")}
    fixed = [(name, kinds[kind]) for name, kind in FIXED.items()]
    schema = pa.schema(fixed + [(name, pa.bool_() if name == "complete" else pa.float64()) for name in figures])
    return pa.Table.from_pylist(list(rows), schema=schema)


def _row(run: Run, status: str, started: datetime, seconds: float, tries: int) -> Row:
    return {
        "key": run.key,
        "status": status,
        **run.axes,
        "version": program(),
        "config": json.dumps(run.description, sort_keys=True),
        "host": socket.gethostname(),
        "python": platform.python_version(),
        "libraries": json.dumps(libraries()),
        "started": started.astimezone(UTC),
        "seconds": seconds,
        "tries": tries,
    }


def _flat(values: Mapping[str, Any], above: str = "") -> Row:
    """Nested figures under dotted names; texts and what is not known are left out."""
    flat: Row = {}
    for name, value in values.items():
        if isinstance(value, Mapping):
            flat |= _flat(value, f"{above}{name}.")
        elif isinstance(value, bool):
            flat[f"{above}{name}"] = value
        elif isinstance(value, int | float):
            flat[f"{above}{name}"] = float(value)
    return flat
