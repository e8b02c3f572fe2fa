"""The trajectory at every odometry reading, for those who ask where the robot was between two scans."""

import numpy as np

from contourslam.geometry.angles import wrap
from contourslam.geometry.poses import between, compose
from contourslam.slam.result import Floats, RunResult

_SAME = 1e-9  # stamps closer than this (s) are the same one: files keep no more of them


def dense_trajectory(result: RunResult, *, online: bool = False) -> tuple[Floats, Floats]:
    """Give a pose at each scan and at each odometry reading, in the order of the recording.

    A reading's pose is carried along the wheels from the scan before it (readings before the first scan: back from
    that). What the wheels then lack to the next scan's pose is spread evenly over the readings between the two. The
    order of the recording counts and not the stamps, which in real logs come in bunches and run backwards.

    Parameters
    ----------
    result : RunResult
    online : bool
        Take the poses as they were known at the time: only carried forward, and none before the first scan.

    Returns
    -------
    stamps : ndarray, shape (n,)
        s. A reading with the stamp of the scan before or after it is left out: that stamp has the scan's pose.
    poses : ndarray, shape (n, 3)
        Base in the world frame: m, m, rad.
    """
    poses = result.online_poses if online and result.online_poses is not None else result.poses
    readings, scans = result.readings, len(result.stamps)
    if readings is None or scans == 0:
        return result.stamps, poses
    after = readings.scans_before
    last, following = np.maximum(after - 1, 0), np.minimum(after, scans - 1)
    kept = np.abs(readings.stamps - result.stamps[last]) > _SAME
    kept &= np.abs(readings.stamps - result.stamps[following]) > _SAME
    if online:
        kept &= after > 0
    after, last, following = after[kept], last[kept], following[kept]
    carried = compose(poses[last], between(result.odometry[last], readings.poses[kept]))
    if not online:
        arrived = compose(poses[last], between(result.odometry[last], result.odometry[following]))
        lacking = poses[following] - arrived
        lacking[:, 2] = wrap(lacking[:, 2])
        lacking[(after == 0) | (after == scans)] = 0.0
        first, end = np.searchsorted(after, after), np.searchsorted(after, after, side="right")
        weight = (np.arange(len(after)) - first + 1) / (end - first + 1)
        carried += weight[:, None] * lacking
        carried[:, 2] = wrap(carried[:, 2])
    order = np.argsort(np.concatenate([np.arange(scans), after - 0.5]), kind="stable")
    return (
        np.concatenate([result.stamps, readings.stamps[kept]])[order],
        np.concatenate([poses, carried])[order],
    )
