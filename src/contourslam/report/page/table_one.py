"""Table I beside the paper's numbers, raw odometry's error and the bound."""

from typing import Any

import numpy as np

from contourslam.evaluation.metrics import Metrics
from contourslam.experiments.replays import MODES, Mode
from contourslam.experiments.study import Study
from contourslam.report.comparison_metrics import mean, shared
from contourslam.report.figures.bars import rmse_figure
from contourslam.report.figures.style import label
from contourslam.report.page.common import COORDINATES, MODE_NAMES, SIGNS, UNITS, Gallery, number, position, spread
from contourslam.report.page.markup import Cell, Picture, Row, Section, pair, paragraph, table
from contourslam.report.paper import TABLE_I


def section(study: Study, gallery: Gallery) -> Section:
    """Give the section; every study has it."""
    seeds = len(study.comparison.seeds)
    parts = [
        paragraph(
            f"Root mean square error of the robot's pose per detector: our mean and standard deviation over {seeds} "
            f"seed{'s' * (seeds != 1)}, beside the number printed in the paper. Its room and its robot were others, so "
            "the comparison is one of scale. Green beats the paper."
        )
    ]
    tables = {mode: found for mode in MODES if (found := study.comparison.table(mode))}
    parts += [_table(study, mode, found) for mode, found in tables.items()]
    parts.append(pair([picture for mode in tables if (picture := _overview(study, gallery, mode))]))
    return Section("table-1", "Table I", "\n".join(parts))


def _table(study: Study, mode: Mode, found: dict[str, Metrics]) -> str:
    headers = ["Detector"]
    for name in COORDINATES:
        headers += [f"{SIGNS[name]} ({UNITS[name]})", f"paper {SIGNS[name]}"]
    rows = []
    for detector, values in found.items():
        cells = []
        for name in COORDINATES:
            ours, theirs = (values.get("rmse") or {}).get(name), TABLE_I.get(detector, {}).get(name)
            measured = mean(ours)
            better = theirs is not None and measured is not None and measured < theirs
            cells += [spread(ours, better=better), Cell(number(theirs, 3))]
        rows.append(Row(label(detector), cells))
    odometry, bound = shared(study.comparison, "odometry_rmse"), shared(study.comparison, "cramer_rao")
    rows += _reference("raw odometry", odometry)
    rows += _reference("Cramér-Rao bound, room known", bound and bound["filtered"])
    return table(f"RMSE, {MODE_NAMES[mode]}", headers, rows)


def _reference(title: str, values: dict[str, Any] | None) -> list[Row]:
    if not values:
        return []
    return [Row(title, [cell for name in COORDINATES for cell in (spread(values.get(name)), Cell(""))], aside=True)]


def _overview(study: Study, gallery: Gallery, mode: Mode) -> Picture | None:
    comparison = study.comparison
    runs = {name: np.array([position(run) for run in comparison.runs(name, mode)]) for name in comparison.table(mode)}
    odometry, bound = shared(comparison, "odometry_rmse"), shared(comparison, "cramer_rao")
    if odometry is None:
        return None
    drawn = rmse_figure(
        {name: (float(e.mean()), float(e.std(ddof=1)) if len(e) > 1 else 0.0) for name, e in runs.items()},
        {name: float(np.hypot(row["x"], row["y"])) for name, row in TABLE_I.items()},
        odometry=_length(odometry),
        bound=None if bound is None else _length(bound["filtered"]),
    )
    values = ", ".join(f"{label(name)} {100 * e.mean():.2f} cm" for name, e in runs.items())
    return gallery.add(
        f"rmse_{mode}",
        drawn,
        alt=f"Position error, {MODE_NAMES[mode]}: {values}; beside each the paper's",
        caption=f"Position RMSE, {MODE_NAMES[mode]}: mean and standard deviation over the seeds; logarithmic.",
    )


def _length(values: dict[str, Any]) -> float:
    return float(np.hypot(mean(values["x"]) or 0.0, mean(values["y"]) or 0.0))
