"""Corners and walls of one map that are found again in another on which it was laid."""

import math

import numpy as np

from contourslam.contour.contours import Floats
from contourslam.geometry.angles import wrap
from contourslam.geometry.poses import between, compose
from contourslam.joining.chart import Chart
from contourslam.joining.laying import Laid

SEEN_FROM = 10.0  # m; landmarks farther from all keyframes that fit are not looked for
NEAR = 0.15  # m between two corners, or of a wall's middle from the line of another, that may be one
ALIKE = math.radians(15.0)  # between two directions
OPENING = math.radians(25.0)


def refound(first: Chart, second: Chart, laid: Laid) -> tuple[int, int]:
    """Count the corners and the walls of the second map that lie on alike ones of the first."""
    if not laid.fits.any():
        return 0, 0
    mine, theirs = second.landmarks, first.landmarks
    spots, moved, near = _moved(second, laid, mine.corners, mine.directions)
    corners = 0
    for k in np.flatnonzero(near):
        away = np.hypot(*(theirs.corners - spots[k]).T)
        alike = (np.abs(wrap(theirs.directions - moved[k])) < ALIKE) & (theirs.convex == mine.convex[k])
        alike &= np.abs(theirs.openings - mine.openings[k]) < OPENING
        corners += bool((alike & (away < NEAR)).any())
    spots, moved, near = _moved(second, laid, mine.end_points.mean(axis=1), mine.normals)
    normals = np.column_stack([np.cos(theirs.normals), np.sin(theirs.normals)])
    middles, ends = theirs.end_points.mean(axis=1), theirs.end_points
    half = 0.5 * np.hypot(*(ends[:, 1] - ends[:, 0]).T)
    walls = 0
    for k in np.flatnonzero(near):
        off = spots[k] - middles
        beside = np.abs(off[:, 0] * normals[:, 1] - off[:, 1] * normals[:, 0]) < half + NEAR
        on = np.abs((off * normals).sum(axis=1)) < NEAR
        walls += bool((beside & on & (np.abs(wrap(theirs.normals - moved[k])) < ALIKE)).any())
    return corners, walls


def _moved(second: Chart, laid: Laid, spots: Floats, directions: Floats) -> tuple[Floats, Floats, np.ndarray]:
    """Landmarks as the nearest keyframe that fits takes them along, and which have one near."""
    keys, poses = laid.keyframes[laid.fits], laid.poses[laid.fits]
    own = second.frames.poses[keys]
    away = np.hypot(spots[:, None, 0] - own[None, :, 0], spots[:, None, 1] - own[None, :, 1])
    nearest = away.argmin(axis=1)
    rows = np.column_stack([spots, directions])
    out = compose(poses[nearest], between(own[nearest], rows))
    return out[:, :2], out[:, 2], away.min(axis=1, initial=np.inf) < SEEN_FROM
