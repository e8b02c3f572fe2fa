"""A scan that fits its local map badly, looked for more widely: wheels slip, stall, and catch up, robots are pushed."""

import math
from collections.abc import Sequence

import numpy as np

from contourslam.contour.contours import Floats
from contourslam.geometry.poses import between_one
from contourslam.matching.align import Alignment, align
from contourslam.matching.cell_map import CellMap
from contourslam.matching.search import search
from contourslam.matching.search_grid import build_search_grid

WINDOW = np.array([0.6, 0.6, math.radians(25.0)])  # half widths of the search
MOST_POINTS = 120
# More overlap than the first alignment's that one elsewhere must have: inside three standard deviations of what the
# wheels said, and outside of them.
GAIN, FAR_GAIN = 0.1, 0.3
# Doubt left of what was known beforehand, once that has proved wrong.
LOOSE = np.diag([1.0 / 0.5**2, 1.0 / 0.5**2, 1.0 / math.radians(20.0) ** 2])


def find_again(
    oriented: Floats, cells: CellMap, expected: Sequence[Floats], prior: Floats, poor: Alignment, enough: float
) -> tuple[Alignment, bool]:
    """Look for a scan at other places: where each expectation has it, then all over a window.

    Parameters
    ----------
    oriented : ndarray, shape (n, 4)
        Points and normals in the scan's frame.
    cells : CellMap
    expected : sequence of ndarray, shape (3,)
        Frame of the scan in the map as different motions would have it; the first is what `prior` is about.
    prior : ndarray, shape (3, 3)
        Information of the first expectation.
    poor : Alignment
        What came of the first expectation.
    enough : float
        An overlap that needs no further search.

    Returns
    -------
    Alignment
        The best one, `poor` itself where none is better by enough.
    bool
        True where it contradicts the first expectation.
    """
    found = [align(oriented, cells, start, LOOSE) for start in expected]
    best = max(found, key=lambda a: a.overlap)
    if best.overlap < enough:
        grid = build_search_grid(cells.points[:, :2], cells.points[:, 2:4])
        some = oriented[:: max(len(oriented) // MOST_POINTS, 1)]
        start = best.pose if best.overlap > poor.overlap + GAIN else expected[0]
        for hypothesis in search(grid, some[:, :2], start, WINDOW, normals=some[:, 2:4], min_score=0.2, keep=3):
            other = align(oriented, cells, hypothesis.pose, LOOSE)
            best = max(best, other, key=lambda a: a.overlap)
    off = between_one(expected[0], best.pose)
    off[:2] = best.pose[:2] - expected[0][:2]
    contradicts = bool(off @ prior @ off > 16.0)
    if best.overlap > poor.overlap + (FAR_GAIN if contradicts else GAIN):
        return best, contradicts
    return poor, False
