"""What can be told of a lidar by watching it: rate, beams, noise; and a picture of a scan in plain characters."""

import math
from collections import deque
from dataclasses import dataclass

import numpy as np

from contourslam.scan import LaserScan


def range_noise(scan: LaserScan) -> float:
    """Estimate the noise of a range from three neighbours that should lie on a straight line.

    A motion of the robot or a slant of the wall does not count; a surface's roughness does.

    Parameters
    ----------
    scan : LaserScan

    Returns
    -------
    float
        Standard deviation, m; NaN with fewer than 30 such triples.
    """
    r = scan.ranges
    with np.errstate(invalid="ignore"):
        valid = (r >= scan.range_min) & (r < scan.range_max)
        joined = valid[:-1] & valid[1:] & (np.abs(np.diff(r)) < 0.05 + 0.03 * r[1:])
    bend = (r[:-2] - 2.0 * r[1:-1] + r[2:])[joined[:-1] & joined[1:]]
    # The bend of independent errors has six times their variance; the median is not moved by edges.
    return float(1.4826 * np.median(np.abs(bend)) / math.sqrt(6.0)) if bend.size >= 30 else math.nan


@dataclass(frozen=True, slots=True)
class LidarFigures:
    """Medians over the last turns.

    Attributes
    ----------
    scans : int
        How many they are taken over.
    rate : float
        Turns a second; NaN with fewer than two.
    beams : int
        Beams of a turn.
    returns : float
        Share of them that hit something.
    noise : float
        Standard deviation of a range, m.
    """

    scans: int
    rate: float
    beams: int
    returns: float
    noise: float


class LidarTally:
    """Gathers figures over the last turns.

    Parameters
    ----------
    span : int
        How many turns.
    """

    def __init__(self, span: int = 30) -> None:
        self._rows: deque[tuple[float, int, float, float]] = deque(maxlen=span)

    def add(self, scan: LaserScan) -> None:
        """Take a turn."""
        with np.errstate(invalid="ignore"):
            hits = (scan.ranges >= scan.range_min) & (scan.ranges < scan.range_max)
        share = float(hits.mean()) if hits.size else 0.0
        self._rows.append((scan.stamp, scan.ranges.size, share, range_noise(scan)))

    def figures(self) -> LidarFigures:
        """Tell the figures."""
        rows = np.array(self._rows, dtype=np.float64).reshape(-1, 4)
        if not len(rows):
            return LidarFigures(0, math.nan, 0, math.nan, math.nan)
        steps = np.diff(rows[:, 0])
        rate = 1.0 / float(np.median(steps)) if steps.size and np.median(steps) > 0.0 else math.nan
        noise = rows[np.isfinite(rows[:, 3]), 3]
        return LidarFigures(
            len(rows), rate, int(np.median(rows[:, 1])), float(np.median(rows[:, 2])),
            float(np.median(noise)) if noise.size else math.nan,
        )  # fmt: skip


def polar_picture(scan: LaserScan, columns: int, rows: int) -> tuple[list[str], float]:
    """Draw a scan from above: ahead is up, left is left, the lidar an ``o``, what it hit ``#``.

    Parameters
    ----------
    scan : LaserScan
    columns, rows : int
        Characters; one is taken as twice as high as wide.

    Returns
    -------
    lines : list of str
        `rows` lines of `columns` characters.
    metres : float
        Height of a line, m.
    """
    with np.errstate(invalid="ignore"):
        hits = (scan.ranges >= scan.range_min) & (scan.ranges < scan.range_max)
    ranges, angles = scan.ranges[hits], scan.angles[hits]
    picture = np.full((max(rows, 1), max(columns, 1)), " ")
    middle = (picture.shape[0] - 1) / 2.0, (picture.shape[1] - 1) / 2.0
    reach = float(np.percentile(ranges, 98)) if ranges.size else 1.0
    metres = max(reach, 0.1) / max(min(middle[0], middle[1] / 2.0), 1.0)
    row = np.rint(middle[0] - ranges * np.cos(angles) / metres).astype(np.int64)
    column = np.rint(middle[1] - 2.0 * ranges * np.sin(angles) / metres).astype(np.int64)
    inside = (row >= 0) & (row < picture.shape[0]) & (column >= 0) & (column < picture.shape[1])
    picture[row[inside], column[inside]] = "#"
    picture[round(middle[0]), round(middle[1])] = "o"
    return ["".join(line) for line in picture.tolist()], metres
