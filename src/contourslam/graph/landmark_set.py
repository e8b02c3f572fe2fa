"""The map of a whole drive: sightings sorted into landmarks anew, once it is known where the keyframes are."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contourslam.contour.contours import Floats, Ints
from contourslam.graph.association import TIGHT_GATES, unlikeness
from contourslam.graph.landmark_fit import fit
from contourslam.graph.sightings import COLUMNS, END, KIND, PXX, PYY, START, Sightings, to_world
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
def _cluster(world: Floats, order: Ints, gates: Floats) -> tuple[Ints, Floats]:
    """Sort sightings, best first, each to the likest landmark so far, or let it begin one of its own."""
    labels = np.empty(world.shape[0], np.int64)
    table = np.empty((world.shape[0], COLUMNS))
    count = 0
    for i in order:
        best, labels[i] = np.inf, count
        for j in range(count):
            cost = unlikeness(world[i], table[j], gates)
            if cost < best:
                best, labels[i] = cost, j
        if labels[i] == count:
            table[count] = world[i]
            count += 1
    return labels, table[:count].copy()


@kernel
def _assign(world: Floats, table: Floats, gates: Floats) -> Ints:
    labels = np.full(world.shape[0], -1, np.int64)
    for i in range(world.shape[0]):
        best = np.inf
        for j in range(table.shape[0]):
            cost = unlikeness(world[i], table[j], gates)
            if cost < best:
                best, labels[i] = cost, j
    return labels


@kernel
def _merge(table: Floats, order: Ints, gates: Floats) -> Ints:
    """Landmark that each landmark becomes part of, itself if none; those early in `order` take in the later ones."""
    into = np.empty(order.size, np.int64)
    roots = np.empty(order.size, np.int64)
    count = 0
    for j in order:
        best, into[j] = np.inf, j
        for k in range(count):
            cost = unlikeness(table[j], table[roots[k]], gates)
            if cost < best:
                best, into[j] = cost, roots[k]
        if into[j] == j:
            roots[count] = j
            count += 1
    return into


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
    labels, table = _cluster(world, order, TIGHT_GATES)
    for _ in range(ROUNDS):
        table = fit(world, labels, table)
        counts = np.bincount(labels[labels >= 0], minlength=len(table))
        into = _merge(table, np.argsort(-counts, kind="stable"), TIGHT_GATES)
        labels = np.where(labels >= 0, into[labels], -1)
        table = fit(world, labels, table)[np.unique(into)]
        labels = _assign(world, table, TIGHT_GATES)
    table = fit(world, labels, table)
    found = LandmarkSet(table, labels, *_count(labels, keys, len(table)))
    return found.only(found.observed >= FEWEST)
