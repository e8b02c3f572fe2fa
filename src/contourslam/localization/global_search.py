"""Where in a whole map a scan may lie, at all headings: the branch and bound of the contour search without a guess."""

import math
from dataclasses import dataclass

import numpy as np

from contourslam.contour.contours import Floats
from contourslam.geometry.angles import wrap
from contourslam.localization.view import View
from contourslam.matching.search import WIDEST_STEP, Hypothesis
from contourslam.matching.search_grid import BLOCK, TOP, SearchGrid, directions_of
from contourslam.matching.search_tree import NEAR, Flags, branch_and_bound

LEAST_SCORE = 0.35  # a pose of which fewer points touch the map is no candidate
RIVAL = 0.8  # nor is one that scores less than this part of the best
# What a bound of one level of the search mostly comes to at the next: taken to its word, it has the search look where
# hope is, ten times as fast, and miss what hides behind an uncommonly high bound.
HOPE = 0.95
BUDGET = 20_000  # nodes that are looked at; in an ambiguous place all of them would be, for little gain


@dataclass(frozen=True, slots=True)
class Standing:
    """Positions at which a robot can be, a cell of the search grid apart.

    Attributes
    ----------
    levels : tuple of ndarray of bool, each of shape (rows, columns)
        Whether one of the 2^k by 2^k positions from each onwards can be; k from 0 to the search's top level.
    start : ndarray, shape (2,)
        The first position in cells of the search grid.
    """

    levels: tuple[Flags, Flags, Flags, Flags, Flags]
    start: Floats


def standing_on(positions: Flags, start: Floats) -> Standing:
    """Prepare the positions, rows along y, of which the first lies at `start` (cells of the search grid)."""
    levels = [np.ascontiguousarray(positions)]
    for k in range(TOP):
        wide = np.pad(levels[-1], (0, 1 << k))
        levels.append(wide[: -(1 << k), : -(1 << k)] | wide[1 << k :, : -(1 << k)])
        levels[-1] = levels[-1] | wide[: -(1 << k), 1 << k :] | wide[1 << k :, 1 << k :]
    return Standing((levels[0], levels[1], levels[2], levels[3], levels[4]), start)


def search_everywhere(
    grid: SearchGrid, standing: Standing, view: View, *, keep: int
) -> tuple[tuple[Hypothesis, ...], float]:
    """Best poses of a view anywhere in a map.

    Parameters
    ----------
    grid : SearchGrid
        With layers for the directions of the surfaces.
    standing : Standing
    view : View
    keep : int
        Number of hypotheses wanted at most.

    Returns
    -------
    tuple of Hypothesis
        Best first, each 0.3 m or 5 degrees away from all better ones.
    float
        What a pose may score that was not looked at, for there were too many; 0 where all were.
    """
    points = view.points[view.chosen]
    if not len(points) or not standing.levels[0].size:
        return (), 0.0
    reach = float(np.hypot(points[:, 0], points[:, 1]).max())
    headings = math.ceil(2.0 * math.pi / min((1.0 - 1e-6) * grid.cell / max(reach, 1e-9), WIDEST_STEP))
    step = 2.0 * math.pi / headings
    rows, columns = standing.levels[0].shape
    mixed = np.argsort(np.arange(len(points)) * 0.6180339887498949 % 1.0)
    found = np.empty((keep, 4), np.int64)
    whole = 255 * len(points)
    count, rest = branch_and_bound(
        grid.fields,
        grid.top,
        points[mixed, :2] / grid.cell,
        directions_of(points[mixed, 2:]),
        standing.start,
        -math.pi,
        step,
        (headings, rows, columns),
        standing.levels,
        HOPE ** np.arange(TOP + 1.0),
        np.empty(-(-rows // BLOCK) * grid.top.shape[4], np.uint32),
        max(math.ceil(LEAST_SCORE * whole), 1),
        RIVAL,
        NEAR / grid.cell,
        BUDGET,
        found,
    )
    poses = np.empty((count, 3))
    poses[:, :2] = grid.origin + (standing.start + found[:count, 2:0:-1]) * grid.cell
    poses[:, 2] = wrap(np.asarray(found[:count, 0] * step - math.pi, np.float64))
    return tuple(Hypothesis(p, int(s) / whole) for p, s in zip(poses, found[:count, 3], strict=True)), max(
        rest, 0
    ) / whole
