"""The error of each known relative pose as a plain table."""

from pathlib import Path
from typing import Any

import numpy as np

from contourslam.atomic import write_text
from contourslam.evaluation.relations import JudgedRelations, RelationErrors
from contourslam.report.csv_table import numbers_of, read_lines, wrong_header

RELATIONS = "relation_errors.csv"
_WHO = (("", "estimate"), ("online_", "online"), ("odometry_", "odometry"))


def write_relation_table(path: Path, judged: JudgedRelations) -> None:
    """Write one line per relation: its two stamps (s), then the errors in m and rad of all that was judged.

    Raises
    ------
    ResultError
        If the file cannot be written.
    """
    names, columns = ["earlier_stamp", "later_stamp"], []
    for prefix, field in _WHO:
        errors = getattr(judged, field)
        if errors is not None:
            names += [f"{prefix}translation", f"{prefix}rotation"]
            columns += [errors.translation, errors.rotation]
    lines = [",".join(names)]
    for stamps, row in zip(judged.stamps.tolist(), np.stack(columns, axis=-1).tolist(), strict=True):
        lines.append(",".join([*map(repr, stamps), *(f"{value:.6g}" for value in row)]))
    write_text(path, "\n".join(lines) + "\n")


def read_relation_table(path: Path, metrics: dict[str, Any]) -> JudgedRelations:
    """Read the table back.

    Parameters
    ----------
    path : Path
    metrics : dict
        ``metrics.json`` beside it, which says how many relations lie beyond the ends of the trajectory.

    Raises
    ------
    ResultError
        If the file cannot be read, or a line of it is not as it was written; the message names the line.
    """
    lines = read_lines(path, "relations")
    names = lines[0] if lines else []
    known = [(prefix, field) for prefix, field in _WHO if f"{prefix}translation" in names]
    expected = ["earlier_stamp", "later_stamp"]
    expected += [f"{prefix}{part}" for prefix, _ in known for part in ("translation", "rotation")]
    if names != expected or {"estimate", "odometry"} - {field for _, field in known}:
        raise wrong_header(path, "relations")
    values = numbers_of(path, lines)
    errors = {}
    for at, (prefix, field) in enumerate(known):
        told = metrics.get(f"{prefix}relations")
        outside = told.get("outside", 0) if isinstance(told, dict) else 0
        errors[field] = RelationErrors(values[:, 2 + 2 * at], values[:, 3 + 2 * at], int(outside))
    return JudgedRelations(values[:, :2], errors["estimate"], errors.get("online"), errors["odometry"])
