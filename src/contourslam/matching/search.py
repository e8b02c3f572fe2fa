"""Where in a map a scan lies: an exhaustive search of a window of poses, coarse to fine, with the runners-up.

Branch and bound over position and heading (Hess et al., "Real-time loop closure in 2D LIDAR SLAM", ICRA 2016). Nodes
are taken best bound first, so poses come out in the order of their score and the first that is no neighbour of a better
one is the true runner-up. Two things differ from that paper: headings are halved along with the position, and the map
has a layer for each direction of the surface, so that a wall matches neither its far side nor one that crosses it.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from contourslam.contour.contours import Floats
from contourslam.geometry.angles import wrap
from contourslam.matching.search_grid import BLOCK, TOP, SearchGrid, directions_of, finite_points
from contourslam.matching.search_tree import ID_BITS, NEAR, SCORE_BITS, Flags, branch_and_bound

WIDEST_STEP = 0.02  # rad; a heading step for points that all lie near the scan's origin
ANYWHERE: Flags = np.empty((0, 0), np.bool_)
CERTAIN: Floats = np.ones(TOP + 1)


@dataclass(frozen=True, slots=True)
class Hypothesis:
    """A pose that a scan may have.

    Attributes
    ----------
    pose : ndarray, shape (3,)
        Frame of the scan in the map: m, m, rad.
    score : float
        Mean likelihood of its points there, between 0 and 1.
    """

    pose: Floats
    score: float


def search(
    grid: SearchGrid,
    points: Floats,
    guess: ArrayLike,
    window: ArrayLike,
    *,
    normals: Floats | None = None,
    min_score: float = 0.4,
    rival: float = 0.8,
    keep: int = 5,
) -> tuple[Hypothesis, ...]:
    """Best poses of a scan in a window about a guess, by trying all of them.

    Positions are tried a cell apart and headings such that the farthest point moves by a cell at most; what is found is
    the same as by scoring each one. The place is ambiguous where a second hypothesis scores about as well as the first.

    Parameters
    ----------
    grid : SearchGrid
    points : ndarray, shape (n, 2)
        Contour points in the frame of the scan, m. Those not finite are left out; those that come to lie outside of the
        grid count as no match. Some 200 that are spread evenly along the contour will do.
    guess, window : array_like, shape (3,)
        Middle and half widths of the window: m, m, rad.
    normals : ndarray, shape (n, 2), optional
        Directions of the surface towards the lidar, for a grid that was built with them.
    min_score : float
        Poses that score less are none, 0 to 1.
    rival : float
        Nor are those that score less than this part of the best, 0 to 1. The less, the slower.
    keep : int
        Number of hypotheses wanted at most.

    Returns
    -------
    tuple of Hypothesis
        Best first, each of them 0.3 m or 5 degrees away from all better ones; empty where nothing scores enough.

    Raises
    ------
    ValueError
        An array has the wrong shape, the guess or the window is not finite, normals were given to only one of grid and
        points, or there are too many points or poses to tell apart.

    Notes
    -----
    With normals the score counts only points whose surface faces about the same way, as
    :func:`contourslam.matching.search_grid.build_search_grid` says.
    """
    points, normals = finite_points(points, normals, "the scan's")
    middle, half = np.asarray(guess, np.float64), np.asarray(window, np.float64)
    if middle.shape != (3,) or half.shape != (3,) or not (np.isfinite([middle, half]).all() and (half >= 0.0).all()):
        raise ValueError(
            f"guess {guess!r} and window {window!r} must be three finite numbers, the window's not negative"
        )
    if (normals is None) != (len(grid.top) == 1):
        raise ValueError("normals must be given for both the map and the scan, or for neither")
    if not len(points) or keep < 1:
        return ()
    reach = float(np.hypot(points[:, 0], points[:, 1]).max())
    turn = min(float(half[2]), math.pi)
    # A hair less than a cell, so that rounding takes no point beyond its window.
    headings = math.ceil(turn / min((1.0 - 1e-6) * grid.cell / max(reach, 1e-9), WIDEST_STEP))
    step = turn / headings if headings else WIDEST_STEP
    kx, ky = (int(w / grid.cell + 1e-9) for w in half[:2])
    counts = (2 * headings + 1, 2 * ky + 1, 2 * kx + 1)
    if math.prod(counts) * (TOP + 1) >= 1 << ID_BITS or 255 * len(points) >= 1 << SCORE_BITS:
        raise ValueError(f"{len(points)} points and {math.prod(counts)} poses are too many for one search")
    # Points in an order that mixes all parts of the contour: a bad node shows early.
    mixed = np.argsort(np.arange(len(points)) * 0.6180339887498949 % 1.0)
    rows, width = -(-counts[1] // BLOCK), grid.top.shape[4]
    found = np.empty((keep, 4), np.int64)
    count, _ = branch_and_bound(
        grid.fields,
        grid.top,
        points[mixed] / grid.cell,
        np.zeros(0) if normals is None else directions_of(normals[mixed]),
        (middle[:2] - grid.origin) / grid.cell - (kx, ky),
        float(middle[2]) - headings * step,
        step,
        counts,
        (ANYWHERE,) * 5,
        CERTAIN,
        np.empty(rows * width, np.uint32),
        max(math.ceil(min_score * 255 * len(points)), 1),
        rival,
        NEAR / grid.cell,
        -1,
        found,
    )
    offsets = (found[:count, 2::-1] - (kx, ky, headings)) * (grid.cell, grid.cell, step)
    poses = middle + offsets
    poses[:, 2] = wrap(poses[:, 2])
    return tuple(Hypothesis(p, int(s) / (255 * len(points))) for p, s in zip(poses, found[:count, 3], strict=True))
