"""Keyframes that several maps hold, because a drive is in all of them."""

from collections import Counter
from collections.abc import Sequence
from itertools import combinations

import numpy as np

from contourslam.contour.contours import Ints
from contourslam.maps.saved_map import Contoured


def identify(maps: Sequence[Contoured]) -> tuple[Ints, ...]:
    """Number the keyframes of several maps; one that is in several of them has one number.

    A keyframe is known again by its stamp and by each of its contour points, which never change: two robots, or two
    drives, never see the same to the bit. One without a point shows nothing to be known again by.

    Parameters
    ----------
    maps : sequence of Contoured

    Returns
    -------
    tuple of ndarray of int
        Of each map, the numbers of its keyframes: 0 to k - 1 for the first map, and on for what the next ones add.
    """
    known: dict[tuple[float, bytes, int], int] = {}
    numbers = []
    count = 0
    for keyframes in maps:
        own, before = np.empty(len(keyframes), np.int64), Counter[tuple[float, bytes]]()
        for i, stamp in enumerate(keyframes.stamps.tolist()):
            contour = keyframes.contour(i).tobytes()
            which = before[stamp, contour]  # a recording that was mapped twice into one map is in it twice
            before[stamp, contour] += 1
            own[i] = known.setdefault((stamp, contour, which), count) if contour else count
            count = max(count, int(own[i]) + 1)
        numbers.append(own)
    return tuple(numbers)


def shared(maps: Sequence[Contoured]) -> dict[tuple[int, int], tuple[Ints, Ints]]:
    """Give the keyframes of all pairs of maps that hold the same drive: their numbers in the one and in the other."""
    numbers = identify(maps)
    found = {}
    for first, second in combinations(range(len(maps)), 2):
        _, one, other = np.intersect1d(numbers[first], numbers[second], return_indices=True)
        if len(one):
            found[first, second] = one, other
    return found
