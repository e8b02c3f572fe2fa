"""A fleet judged: how far its robots are off in a frame that they share, and who met when."""

import math

import numpy as np

from contourslam.contour.contours import Floats
from contourslam.geometry.poses import compose

ROOM = 6.0  # m across: two robots were in the same room where their ways pass through the same circle of this size
WAY = 8.0  # m of either's way, within reach of the other's, from which on they have seen the same room
STEP = 0.2  # m of way between the points at which that is looked at


def rmse(poses: Floats, truth: Floats, motion: Floats) -> float:
    """Root mean square distance of positions moved by a rigid motion from the true ones, m; NaN for none."""
    if not len(poses):
        return math.nan
    off = compose(motion, poses)[:, :2] - truth[:, :2]
    return float(np.sqrt((off**2).sum(axis=1).mean()))


def met(first: Floats, second: Floats, times: tuple[Floats, Floats]) -> float:
    """Tell when two robots have seen the same room.

    That is when either's way has, for `WAY` metres, passed within half of `ROOM` of where the other has been. Walls are
    not looked at: two that drive along either side of one are taken for having met.

    Parameters
    ----------
    first, second : ndarray, shape (n, 3)
        True poses: m, m, rad.
    times : (ndarray, ndarray)
        s, of these poses.

    Returns
    -------
    float
        s; infinite where they never have.
    """
    ways = [_thinned(poses, stamps) for poses, stamps in zip((first, second), times, strict=True)]
    (a, since_a), (b, since_b) = ways
    near = np.hypot(*(a[:, None] - b[None]).transpose(2, 0, 1)) < 0.5 * ROOM
    both = np.where(near, np.maximum(since_a[:, None], since_b[None]), np.inf)
    known = max(math.ceil(WAY / STEP), 1)
    # Of each step of one way, when it and the other's way past it had both been driven.
    ends = [np.sort(both.min(axis=axis, initial=np.inf)) for axis in (0, 1)]
    return float(max(end[known - 1] if len(end) >= known else np.inf for end in ends))


def _thinned(poses: Floats, times: Floats) -> tuple[Floats, Floats]:
    """Points each `STEP` of the way, and when they were passed."""
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(poses[:, :2], axis=0).T))])
    rows = np.unique((way / STEP).astype(np.int64), return_index=True)[1]
    return poses[rows, :2], times[rows]
