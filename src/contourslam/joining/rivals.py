"""Other ways of laying a map than the best: slid along a corridor, by one door, or turned about."""

import math

import numpy as np
from numpy.typing import NDArray

from contourslam.contour.contours import Floats
from contourslam.geometry.angles import wrap
from contourslam.joining.overlay import Overlay
from contourslam.matching.align import align

FARTHEST, STEP = 10.0, 0.2  # m: shifts that are tried, along x and y
TURNS = np.radians([0.0, 90.0, 180.0, -90.0])  # buildings are built so
SOME = 250  # points of each map that are looked at at all shifts
CLOSER = 24  # shifts that are looked at closely
NEIGHBOUR, NEIGHBOUR_ANGLE = 0.5, math.radians(5.0)  # m, rad: a shift less than this is no other way
LOOSE = np.diag([1.0 / 0.15**2, 1.0 / 0.15**2, 1.0 / math.radians(3.0) ** 2])
ALIGNED = 800  # points


def best_rival(overlay: Overlay) -> float:
    """Worth of the best other way of laying the map near where it was laid, m; may be negative."""
    steps = np.arange(-round(FARTHEST / STEP), round(FARTHEST / STEP) + 1) * STEP
    shifts = np.stack(np.meshgrid(steps, steps, TURNS, indexing="ij"), axis=-1).reshape(-1, 3)
    shifts = shifts[elsewhere(shifts)]
    rough = overlay.worths(overlay.shifted(shifts), SOME)
    points = overlay.second.points[:: max(len(overlay.second.points) // ALIGNED, 1)]
    best, looked = -math.inf, np.empty((0, 3))
    for k in np.argsort(-rough, kind="stable"):
        if ((np.abs(looked - shifts[k]) < (2.0 * STEP, 2.0 * STEP, 0.1)).all(axis=1)).any():
            continue
        looked = np.vstack([looked, shifts[k]])
        pose = overlay.shifted(shifts[k])
        best = max(best, overlay.tally(pose).worth)
        pose = align(points, overlay.first.cells, pose, LOOSE).pose
        if elsewhere(overlay.shift(pose)):
            best = max(best, overlay.tally(pose).worth)
        if len(looked) == CLOSER:
            break
    return best


def elsewhere(shifts: Floats) -> NDArray[np.bool_]:
    """Whether shifts (m, m, rad) lead to another place than where they begin."""
    away = np.hypot(shifts[..., 0], shifts[..., 1])
    return np.asarray((away > NEIGHBOUR) | (np.abs(wrap(shifts[..., 2])) > NEIGHBOUR_ANGLE))
