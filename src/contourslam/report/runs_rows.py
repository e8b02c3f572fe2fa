"""What is told of a run when it stands beside others, in words and numbers: on the terminal and on the page alike."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class Measure:
    """One row of the table.

    Attributes
    ----------
    title, unit : str
        rad are told in degrees where the unit is "deg".
    keys : tuple of str
        Where it stands in the metrics.
    digits : int
        Decimals.
    smaller_wins : bool
        Whether the smallest one is the best; else there is none.
    else_keys : tuple of str
        Where to look for runs that have no such value, if others have one: the poses of a run that revises nothing are
        those known at the time.
    """

    title: str
    unit: str
    keys: tuple[str, ...]
    digits: int = 0
    smaller_wins: bool = False
    else_keys: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """Title with unit."""
        return self.title + (f", {self.unit}" if self.unit else "")

    def values(self, metrics: Iterable[dict[str, Any]]) -> list[Any]:
        """Look it up in each run's metrics; None where it is not known."""
        runs = list(metrics)
        found = [_at(run, self.keys) for run in runs]
        if self.else_keys and any(value is not None for value in found):
            others = (_at(run, self.else_keys) for run in runs)
            found = [other if value is None else value for value, other in zip(found, others, strict=True)]
        return found

    def text(self, value: Any) -> str:
        """Give a value as text; nothing where it is not known."""
        if value is None:
            return ""
        if isinstance(value, int | str):
            return str(value)
        return f"{self.in_unit(value):.{self.digits}f}"

    def in_unit(self, value: float) -> float:
        """Give a value of the metrics in the unit of the row."""
        return math.degrees(value) if self.unit == "deg" else value


def _at(metrics: dict[str, Any], keys: tuple[str, ...]) -> Any:
    found: Any = metrics
    for key in keys:
        found = found.get(key) if isinstance(found, dict) else None
    return found


def _relations(prefix: str, keys: str, others: str = "") -> tuple[Measure, ...]:
    return tuple(
        Measure(
            f"{prefix}relation error, {name}",
            unit,
            (keys, part, kind),
            digits,
            True,
            (others, part, kind) if others else (),
        )
        for name, unit, part, kind, digits in (
            ("mean", "m", "translation", "mean", 4),
            ("median", "m", "translation", "median", 4),
            ("rotation, mean", "deg", "rotation", "mean", 3),
        )
    )


MEASURES = (
    Measure("back end", "", ("back_end",)),
    Measure("RMSE x", "m", ("rmse", "x"), 4, True),
    Measure("RMSE y", "m", ("rmse", "y"), 4, True),
    Measure("RMSE heading", "rad", ("rmse", "theta"), 5, True),
    Measure("absolute trajectory error, RMS", "m", ("ate", "rmse"), 4, True),
    Measure("relative trajectory error, RMS per m", "m", ("rpe", "rmse"), 4, True),
    *_relations("", "relations"),
    *_relations("online ", "online_relations", "relations"),
    Measure("raw odometry's relation error, mean", "m", ("odometry_relations", "translation", "mean"), 4),
    Measure("raw odometry's rel. error, rotation, mean", "deg", ("odometry_relations", "rotation", "mean"), 3),
    Measure("pose NEES (ideal 3)", "", ("nees",), 2),
    Measure("NIS per degree of freedom", "", ("nis",), 2),
    Measure("loops closed", "", ("loops",)),
    Measure("quality of the contour matching", "", ("quality",), 3),
    Measure("false-negative rate of corners", "", ("fnr",), 3, True),
    Measure("false-negative rate of walls", "", ("fnr_walls",), 3, True),
    Measure("corners in the map", "", ("landmarks", "corners")),
    Measure("walls in the map", "", ("landmarks", "walls")),
    Measure("corners and walls as a file", "kB", ("map_kb",), 1),
    Measure("scans", "", ("scans",)),
    Measure("CPU time", "s", ("cpu_seconds",), 2, True),
    Measure("scans per second", "1/s", ("scans_per_second",), 0),
)
"""All that may be told, in the order in which it is."""
