"""The map of a whole drive: sightings sorted into landmarks anew, once it is known where the keyframes are."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contourslam.contour.contours import Floats, Ints
from contourslam.graph.association import TIGHT_GATES
from contourslam.graph.landmark_fit import fit
from contourslam.graph.landmark_index import empty_index, insert, likest
from contourslam.graph.sightings import END, KIND, PXX, PYY, START, Sightings, to_world
from contourslam.kernels import kernel
from contourslam.slam.measurement import CORNER

FEWEST = 3  # keyframes that must have seen a landmark
ROUNDS = 2  # of fitting, merging and sorting anew


@dataclass(frozen=True, slots=True)
class LandmarkSet:
    """Landmarks of a drive.

    Attributes
    ----------
    table : ndarray, shape (m, COLUMNS)
        In the world; the covariance is that of the fit, given the keyframes.
    labels : ndarray of int, shape (n,)
        Landmark (row of `table`) of each sighting, -1 for none.
    observed : ndarray of int, shape (m,)
        Keyframes that saw each.
    first : ndarray of int, shape (m,)
        The first of them.
    """

    table: Floats
    labels: Ints
    observed: Ints
    first: Ints

    def __len__(self) -> int:
        return len(self.table)

    def only(self, kept: NDArray[np.bool_]) -> "LandmarkSet":
        """The landmarks for which `kept`, shape (m,), is true."""
        number = np.append(np.where(kept, np.cumsum(kept) - 1, -1), -1)
        return LandmarkSet(self.table[kept], number[self.labels], self.observed[kept], self.first[kept])


@kernel
def _cluster(world: Floats, order: Ints, gates: Floats) -> Ints:
    """Sort rows, those early in `order` first, each to the likest that began a landmark before it, or let it begin one.

    Returns for each row the one that began its landmark, itself if it did.
    """
    into = np.empty(world.shape[0], np.int64)
    index = empty_index(world)
    for i in order:
        into[i] = likest(index, world, world[i], gates)
        if into[i] < 0:
            into[i] = i
            insert(index, world[i], i)
    return into


@kernel
def _assign(world: Floats, table: Floats, gates: Floats) -> Ints:
    """Likest landmark of each row, -1 for none."""
    labels = np.empty(world.shape[0], np.int64)
    index = empty_index(table)
    for j in range(table.shape[0]):
        insert(index, table[j], j)
    for i in range(world.shape[0]):
        labels[i] = likest(index, table, world[i], gates)
    return labels


@kernel
def _count(labels: Ints, keys: NDArray[np.int32], count: int) -> tuple[Ints, Ints]:
    """Keyframes that saw each landmark, and the first of them; keys ascend."""
    observed, first, last = np.zeros(count, np.int64), np.full(count, -1), np.full(count, -1)
    for i in range(labels.size):
        j = labels[i]
        if j >= 0 and last[j] != keys[i]:
            if first[j] < 0:
                first[j] = keys[i]
            last[j] = keys[i]
            observed[j] += 1
    return observed, first


def find_landmark_set(sightings: Sightings, poses: Floats) -> LandmarkSet:
    """Sort all sightings of a drive into landmarks, and fit each to its own.

    What the drive took them for at the time does not count: landmarks that were mapped twice before a loop was closed
    become one, and pieces of wall that overlap in one line too.

    Parameters
    ----------
    sightings : Sightings
    poses : ndarray, shape (k, 3)
        All keyframes in the world.

    Returns
    -------
    LandmarkSet
        Seen by at least three keyframes each.
    """
    n = sightings.count
    rows, keys = sightings.rows[:n], sightings.keys[:n]
    world = to_world(rows, keys, poses)
    # The surest first: corners by their covariance, walls by their length.
    order = np.argsort(np.where(rows[:, KIND] == CORNER, rows[:, PXX] + rows[:, PYY], rows[:, START] - rows[:, END]))
    begun, labels = np.unique(_cluster(world, order, TIGHT_GATES), return_inverse=True)
    table = world[begun]
    for _ in range(ROUNDS):
        table = fit(world, labels, table)
        counts = np.bincount(labels[labels >= 0], minlength=len(table))
        into = _cluster(table, np.argsort(-counts, kind="stable"), TIGHT_GATES)
        labels = np.where(labels >= 0, into[labels], -1)
        table = fit(world, labels, table)[np.unique(into)]
        labels = _assign(world, table, TIGHT_GATES)
    table = fit(world, labels, table)
    found = LandmarkSet(table, labels, *_count(labels, keys, len(table)))
    return found.only(found.observed >= FEWEST)
