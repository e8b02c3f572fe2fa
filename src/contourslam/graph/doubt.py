"""How well one place is known as seen from another: covariances added up along a tree of places.

Exact marginals of the graph cost more the larger it gets; this costs nothing and is on the safe side, for it follows
only the best chain between two places.
"""

import math

import numpy as np

from contourslam.contour.contours import Floats, Ints
from contourslam.kernels import kernel

# Columns of the sums from the root to a node: xx, xy, yy, theta, theta x, theta y, theta xx, theta xy, theta yy, where
# x, y is the place where the heading was lost.
SUMS = 9
# Heading lost by contour odometry after one metre, rad: what lidars err alike in from scan to scan (bias with the angle
# of incidence) adds up along a wall, beyond what the noise of the points explains.
HEADING_PER_M = math.radians(0.35)


class DoubtTree:
    """Places, each with the one from which it is best known; changed in place."""

    def __init__(self) -> None:
        self._parents = np.zeros(16, np.int64)
        self._sums = np.zeros((16, SUMS))
        self.count = 0

    def add(self, parent: int, pose: Floats, covariance: Floats) -> int:
        """Add a place at `pose`, known from `parent` with `covariance` (world axes); returns its number."""
        if self.count == len(self._parents):
            self._parents = np.concatenate([self._parents, np.zeros_like(self._parents)])
            self._sums = np.concatenate([self._sums, np.zeros_like(self._sums)])
        number = self.count
        self.count += 1
        self._place(number, parent if number else 0, pose, covariance)
        return number

    def better(self, number: int, parent: int, pose: Floats, covariance: Floats) -> None:
        """Let one of the newest places be known from `parent`, older than itself, where that way is the surer one."""
        before, was = self._sums[number].copy(), int(self._parents[number])
        self._place(number, parent, pose, covariance)
        if _size(before, pose) <= _size(self._sums[number], pose):
            self._sums[number], self._parents[number] = before, was
            return
        for child in range(number + 1, self.count):  # one at most: the local map that has been begun since
            if self._parents[child] == number:
                self._sums[child] += self._sums[number] - before

    def _place(self, number: int, parent: int, pose: Floats, covariance: Floats) -> None:
        x, y, turn = pose[0], pose[1], covariance[2, 2]
        own = np.array(
            [
                covariance[0, 0], covariance[0, 1], covariance[1, 1],
                turn, turn * x, turn * y, turn * x * x, turn * x * y, turn * y * y,
            ]
        )  # fmt: skip
        self._parents[number] = parent
        self._sums[number] = own + (self._sums[parent] if number else 0.0)

    def between(self, first: int, others: Ints, pose: Floats) -> Floats:
        """Covariances of `pose` (known from `first`) as seen from each of `others`, world's axes, shape (n, 3, 3)."""
        return _between(self._parents, self._sums, first, others, pose)

    def from_start(self, number: int, pose: Floats) -> Floats:
        """Covariance of `pose` (known from place `number`) as seen from where the drive began."""
        return _spread(self._sums[number], pose)


@kernel
def _spread(sums: Floats, pose: Floats) -> Floats:
    x, y = pose[0], pose[1]
    t, tx, ty = sums[3], sums[4], sums[5]
    out = np.empty((3, 3))
    # A turn by dt at (ex, ey) moves (x, y) by dt (-(y - ey), x - ex).
    out[0, 0] = max(sums[0] + t * y * y - 2.0 * y * ty + sums[8], 0.0)
    out[1, 1] = max(sums[2] + t * x * x - 2.0 * x * tx + sums[6], 0.0)
    out[0, 1] = out[1, 0] = sums[1] - (t * x * y - x * ty - y * tx + sums[7])
    out[0, 2] = out[2, 0] = -(t * y - ty)
    out[1, 2] = out[2, 1] = t * x - tx
    out[2, 2] = max(t, 0.0)
    return out


@kernel
def _between(parents: Ints, sums: Floats, first: int, others: Ints, pose: Floats) -> Floats:
    """A parent's number is smaller than its child's, so the way to the root is a way down to 0."""
    above = np.zeros(first + 1, dtype=np.bool_)  # first and what it is known from: walked once, for all the others
    node = first
    while node > 0:
        above[node] = True
        node = parents[node]
    above[0] = True
    out = np.empty((others.size, 3, 3))
    for i in range(others.size):
        common = others[i]
        while common > first or not above[common]:
            common = parents[common]
        out[i] = _spread(sums[first] + sums[others[i]] - 2.0 * sums[common], pose)
    return out


def _size(sums: Floats, pose: Floats) -> float:
    p = _spread(sums, pose)
    return float(p[0, 0] + p[1, 1] + 9.0 * p[2, 2])  # what a heading error does to points 3 m away
