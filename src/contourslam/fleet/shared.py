"""A common map as the server gives it away: the map, whose drives are in it, and how it came about."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from contourslam.contour.contours import Floats, Ints
from contourslam.fleet.common import CommonMap, Joined
from contourslam.fleet.inbox import Source
from contourslam.maps.saved_map import SavedMap


@dataclass(frozen=True, slots=True)
class Shared:
    """A common map, as it is given away.

    Attributes
    ----------
    number : int
    members : tuple of (str, int)
        Robot and run, in the order of the map's keyframes.
    counts : tuple of int
        Keyframes that each of them added.
    saved : SavedMap
    joined : tuple of Joined
        How it came about, and on which evidence.
    rows : tuple of ndarray of int
        Of each of them, where all its keyframes are in the map: one that began in a map that was kept shares those with
        the run before.
    """

    number: int
    members: tuple[Source, ...]
    counts: tuple[int, ...]
    saved: SavedMap
    joined: tuple[Joined, ...]
    rows: tuple[Ints, ...]

    def frames(self) -> Iterator[tuple[Source, Floats, Floats]]:
        """Give the runs, and the stamps (s) and poses of their keyframes, of shapes (k,) and (k, 3)."""
        if self.saved.keyframes is not None:
            for source, rows in zip(self.members, self.rows, strict=True):
                yield source, self.saved.keyframes.stamps[rows], self.saved.keyframes.poses[rows]


def share(common: CommonMap, saved: SavedMap) -> Shared:
    """Give a common map away; `saved` is what is kept of it, or that solved as a whole."""
    runs = [run for run in common.runs if run.keys]
    members = tuple((run.robot, run.number) for run in runs)
    index = np.empty(len(common), np.int64)
    index[[run.keys[number] for run in runs for number in run.own]] = np.arange(len(common))
    rows = tuple(index[run.keys] for run in runs)
    return Shared(common.number, members, tuple(len(run.own) for run in runs), saved, common.joined, rows)
