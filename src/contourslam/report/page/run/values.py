"""What the sections are made from, and numbers as text."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from contourslam.config import Config
from contourslam.evaluation.relations import JudgedRelations
from contourslam.slam.result import RunResult

BACK_ENDS = {"ekf": "EKF", "graph": "graph"}


@dataclass(frozen=True, slots=True)
class RunValues:
    """One run, with all that is known about it.

    Attributes
    ----------
    result : RunResult
        With one scan or more.
    config : Config
        The configuration it really used.
    metrics : dict
        Of :func:`contourslam.evaluation.metrics.run_metrics`.
    relations : JudgedRelations or None
        Its errors against known relative poses, one or more.
    command : str
        The command line.
    """

    result: RunResult
    config: Config
    metrics: dict[str, Any]
    relations: JudgedRelations | None
    command: str

    @property
    def begin(self) -> float:
        """Smallest stamp, s: times on the page count from it."""
        return float(self.result.stamps.min())


def length(value: float | None) -> str:
    """Give a length in metres, the more decimals the smaller it is, a dash where it is not known."""
    if value is None or not math.isfinite(value):
        return "–"
    return f"{value:.0f} m" if abs(value) >= 100.0 else f"{value:.{2 if abs(value) >= 1.0 else 4}f} m"


def degrees(value: float | None) -> str:
    """Give an angle (rad) in degrees, a dash where it is not known."""
    if value is None or not math.isfinite(value):
        return "–"
    return f"{round(math.degrees(value), 2) + 0.0:.2f}°"  # no negative zero


def clock(seconds: float) -> str:
    """Give a time since the start as minutes and seconds."""
    whole = round(seconds)
    return f"{whole // 60}:{whole % 60:02d}"


def count(number: int, one: str, many: str = "") -> str:
    """Give a number of things."""
    return f"{number:,} {one if number == 1 else many or one + 's'}"


def distance(result: RunResult) -> float:
    """Length of the estimated way, m."""
    return float(np.hypot(*np.diff(result.poses[:, :2], axis=0).T).sum())
