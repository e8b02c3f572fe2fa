"""What runs would take, by those that are done."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from contourslam.experiments.sweep.runs import RecordedDrive, Run


def expected_seconds(runs: Sequence[Run], table: Any) -> float | None:
    """Estimate how long runs take on one core.

    Parameters
    ----------
    runs : sequence of Run
    table : pyarrow.Table
        Rows of runs that are over, with what they took.

    Returns
    -------
    float or None
        s: for each run the mean of those in the same place with the same detector and setting, else of those in the
        same place, else of all; None where there are none.
    """
    known: dict[tuple[object, ...], list[float]] = {}
    for row in table.to_pylist():
        place = row["room"] or row["recording"]
        for kind in ((place, row["detector"], row["setting"]), (place,), ()):
            known.setdefault(kind, []).append(row["seconds"])
    if not known:
        return None
    means = {kind: float(np.mean(values)) for kind, values in known.items()}
    return sum(_expected(run, means) for run in runs)


def _expected(run: Run, means: dict[tuple[object, ...], float]) -> float:
    place = run.drive.name if isinstance(run.drive, RecordedDrive) else run.drive.room
    return means.get((place, run.detector, run.setting), means.get((place,), means[()]))
