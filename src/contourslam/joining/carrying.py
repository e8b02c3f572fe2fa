"""What becomes of a map's frame, and of a trajectory, when the keyframes come to lie elsewhere."""

import numpy as np

from contourslam.contour.contours import Floats
from contourslam.geometry.angles import wrap
from contourslam.geometry.poses import between, compose, transform


def carry(stamps: Floats, poses: Floats, key_stamps: Floats, before: Floats, after: Floats) -> Floats:
    """Move poses as the keyframes around them were moved.

    Each is seen from the keyframe before it and from the one after it, in time, and lies between where the two then
    have it: near a keyframe with that one, half way with both.

    Parameters
    ----------
    stamps : ndarray, shape (n,)
        s; in any order.
    poses : ndarray, shape (n, 3)
        At these stamps, in the old map: m, m, rad.
    key_stamps : ndarray, shape (k,)
        Of the keyframes of the same drive, k > 0, s; in any order.
    before, after : ndarray, shape (k, 3)
        Keyframes in the old map and in the new one.

    Returns
    -------
    ndarray, shape (n, 3)
        In the new map.
    """
    order = np.argsort(key_stamps, kind="stable")
    key_stamps, before, after = key_stamps[order], before[order], after[order]
    left = np.maximum(np.searchsorted(key_stamps, stamps, "right") - 1, 0)
    right = np.minimum(left + 1, len(order) - 1)
    first = compose(after[left], between(before[left], poses))
    second = compose(after[right], between(before[right], poses))
    gap = np.where(right > left, key_stamps[right] - key_stamps[left], 1.0)
    weight = np.clip((stamps - key_stamps[left]) / np.where(gap > 0.0, gap, 1.0), 0.0, 1.0)
    return compose(first, between(first, second) * weight[:, None])


def frame_among(before: Floats, after: Floats) -> tuple[Floats, float]:
    """Give the frame of a map in that of the one it went into, and how far it was bent.

    Parameters
    ----------
    before, after : ndarray, shape (k, 3)
        Its keyframes in the old map and in the new one, k > 0.

    Returns
    -------
    pose : ndarray, shape (3,)
        Rigid motion that fits all keyframes best, the headings having their say first: m, m, rad.
    bent : float
        Largest distance of a keyframe from where that motion alone would put it, m.
    """
    turns = wrap(after[:, 2] - before[:, 2])
    turn = float(np.arctan2(np.sin(turns).sum(), np.cos(turns).sum()))
    turned = transform(np.array([0.0, 0.0, turn]), before[:, :2])
    shift = (after[:, :2] - turned).mean(axis=0)
    off = after[:, :2] - turned - shift
    return np.array([*shift, turn]), float(np.hypot(off[:, 0], off[:, 1]).max())
