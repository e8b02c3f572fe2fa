"""The error of each known relative pose as a plain table."""

from pathlib import Path

import numpy as np

from contourslam.atomic import write_text
from contourslam.evaluation.relations import JudgedRelations

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
