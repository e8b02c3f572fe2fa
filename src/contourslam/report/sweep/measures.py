"""What runs of a sweep can be compared by."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class Measure:
    """A figure of a run, taken from the columns of its row.

    Attributes
    ----------
    name : str
        As ``--metric`` takes it.
    title : str
        As figures and sentences show it.
    short : str
        As the head of a column shows it.
    unit : str
        Empty for a plain number.
    scale : float
        From the column's unit to `unit`.
    columns : tuple of str
        Of several, the length of the vector that they make.
    digits : int
        Decimals in tables.
    ratio : bool
        It is above zero and compared by its ratio: at 5 cm of noise a difference of a tenth counts as much as at 0.
    odometry : tuple of str
        Columns of the same figure for the wheels alone, if there is one.
    inverse : bool
        The column holds one over the figure.
    """

    name: str
    title: str
    short: str
    unit: str
    scale: float
    columns: tuple[str, ...]
    digits: int = 2
    ratio: bool = True
    odometry: tuple[str, ...] = ()
    inverse: bool = False

    @property
    def heading(self) -> str:
        """Title with the unit."""
        return f"{self.title} ({self.unit})" if self.unit else self.title

    @property
    def step(self) -> str:
        """Unit of a difference that is no ratio."""
        return "points" if self.unit == "%" else self.unit

    @property
    def column(self) -> str:
        """Head of a column, with the unit."""
        return f"{self.short} ({self.unit})" if self.unit else self.short

    def of(self, row: Mapping[str, Any]) -> float:
        """Value of a row in the column's own unit; NaN where it is not known."""
        value = _length(row, self.columns)
        return value if not self.inverse else 1.0 / value if value else math.nan

    def of_odometry(self, row: Mapping[str, Any]) -> float:
        """Value of the wheels alone, likewise."""
        return _length(row, self.odometry)

    def text(self, value: float) -> str:
        """Value in `unit`, with its decimals; a dash where it is not known."""
        return f"{self.scale * value:.{self.digits}f}" if math.isfinite(value) else "–"


def _length(row: Mapping[str, Any], columns: tuple[str, ...]) -> float:
    values = [row.get(column) for column in columns]
    known = [float(value) for value in values if value is not None]
    return math.hypot(*known) if known and len(known) == len(values) else math.nan


_POSITION = ("odometry_rmse.x", "odometry_rmse.y")
MEASURES: dict[str, Measure] = {
    measure.name: measure
    for measure in (
        Measure("position", "RMSE of the position", "position", "cm", 100.0, ("rmse.x", "rmse.y"), odometry=_POSITION),
        Measure("x", "RMSE of x", "x", "cm", 100.0, ("rmse.x",), odometry=_POSITION[:1]),
        Measure("y", "RMSE of y", "y", "cm", 100.0, ("rmse.y",), odometry=_POSITION[1:]),
        Measure(
            "heading", "RMSE of the heading", "heading", "mrad", 1e3, ("rmse.theta",), odometry=("odometry_rmse.theta",)
        ),
        Measure("landmarks", "mean error of a detected corner", "corners", "cm", 100.0, ("detection.mean_error",)),
        Measure(
            "false_negatives", "false-negative rate", "false negatives", "%", 100.0, ("fnr",), digits=1, ratio=False
        ),
        Measure("nees", "NEES of the pose", "NEES", "", 1.0, ("nees",)),
        Measure("time", "time per scan", "time a scan", "ms", 1e3, ("scans_per_second",), inverse=True),
        Measure(
            "relations",
            "mean relation error",
            "relation error",
            "cm",
            100.0,
            ("relations.translation.mean",),
            odometry=("odometry_relations.translation.mean",),
        ),
        Measure(
            "turns",
            "mean relation error, rotation",
            "rotation",
            "mrad",
            1e3,
            ("relations.rotation.mean",),
            digits=1,
            odometry=("odometry_relations.rotation.mean",),
        ),
    )
}
"""By their names."""
TABLE_I = ("position", "x", "y", "heading", "landmarks", "false_negatives", "nees", "time")
"""Columns of Table I; those of which nothing is known are left out."""
COMPARABLE = ("position", "x", "y", "heading", "landmarks", "false_negatives")
"""What detectors can be tested by."""
