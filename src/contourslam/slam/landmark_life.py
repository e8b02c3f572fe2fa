"""Birth, death and marriage of landmarks: a role of its own, apart from the association."""

import math

import numpy as np

from contourslam.config import SlamConfig
from contourslam.contour.contours import Floats, Ints
from contourslam.geometry.angles import wrap
from contourslam.kernels import kernel
from contourslam.slam import observation as look
from contourslam.slam.ekf import covariance_block, landmark_columns
from contourslam.slam.gates import chi_square_gate
from contourslam.slam.gating import angle_between, looks_alike, offset_from
from contourslam.slam.landmark_filter import LandmarkFilter
from contourslam.slam.measurement import (
    ANCHOR_X,
    ANCHOR_Y,
    COLUMNS,
    CONVEX,
    CORNER,
    DIRECTION,
    END,
    KIND,
    OPENING,
    START,
)
from contourslam.slam.observation import Observations

SAME_PLACE = 0.30  # two sightings this close (m) and alike are one landmark in the making
FORGET_AFTER = 15  # scans without another sighting after which a landmark in the making is given up
SAME_NORMAL = math.radians(12.0)


@kernel
def nearest_alike(world: Floats, mean: Floats, table: Floats, count: int, within: float) -> Ints:
    """Nearest landmark that each observation could be by its looks and place, -1 for none."""
    out = np.full(world.shape[0], -1, dtype=np.int64)
    for i in range(world.shape[0]):
        best = within
        for j in range(count):
            if not looks_alike(world[i], table[j], mean[3 + 2 * j]):
                continue
            apart = offset_from(world[i], table[j], mean[3 + 2 * j], mean[4 + 2 * j])
            if apart < best:
                best, out[i] = apart, j
    return out


class Nursery:
    """Landmarks in the making: sightings that matched nothing wait here until they have come several times."""

    def __init__(self) -> None:
        self._mean = np.zeros(3)
        self._table = np.zeros((0, COLUMNS))
        self._sightings = np.zeros(0, np.int64)
        self._last_seen = np.zeros(0, np.int64)
        self._scan = 0

    @property
    def empty(self) -> bool:
        """Whether nothing waits."""
        return len(self._table) == 0

    def ripe(self, world: Floats, config: SlamConfig) -> Ints:
        """Take in the observations without a landmark; returns which of them have now been seen often enough.

        Parameters
        ----------
        world : ndarray, shape (k, 8)
            Looks of these observations, moved to the world.
        config : SlamConfig

        Returns
        -------
        ndarray of int
            Indices into `world`.
        """
        if config.sightings_to_birth <= 1:
            return np.arange(len(world))
        self._scan += 1
        known = nearest_alike(world, self._mean, self._table, len(self._table), SAME_PLACE)
        ripe: list[int] = []
        gone: set[int] = set()
        fresh: list[Floats] = []
        for i, j in enumerate(known):
            if j < 0:
                fresh.append(world[i])
                continue
            if self._last_seen[j] == self._scan:
                continue
            self._sightings[j] += 1
            self._last_seen[j] = self._scan
            if self._sightings[j] >= config.sightings_to_birth:
                ripe.append(i)
                gone.add(int(j))
            else:
                self._mean[3 + 2 * j : 5 + 2 * j], self._table[j] = _as_landmark(world[i])
        keep = self._last_seen > self._scan - FORGET_AFTER
        keep[list(gone)] = False
        if not keep.all():
            self._table, self._sightings = self._table[keep], self._sightings[keep]
            self._last_seen = self._last_seen[keep]
            self._mean = np.concatenate([np.zeros(3), self._mean[3:].reshape(-1, 2)[keep].ravel()])
        if fresh:
            states, rows = zip(*(_as_landmark(row) for row in fresh), strict=True)
            self._mean = np.concatenate([self._mean, *states])
            self._table = np.concatenate([self._table, rows])
            self._sightings = np.concatenate([self._sightings, np.ones(len(fresh), np.int64)])
            self._last_seen = np.concatenate([self._last_seen, np.full(len(fresh), self._scan)])
        return np.array(ripe, dtype=np.int64)


def _as_landmark(world: Floats) -> tuple[Floats, Floats]:
    """State and table row of a sighting, as a landmark of the map would have them."""
    row = np.zeros(COLUMNS)
    row[KIND] = world[look.KIND]
    if row[KIND] == CORNER:
        row[DIRECTION], row[OPENING], row[CONVEX] = world[look.DIRECTION : look.CONVEX + 1]
        return world[look.X1 : look.Y1 + 1].copy(), row
    dx, dy = world[look.X2] - world[look.X1], world[look.Y2] - world[look.Y1]
    row[ANCHOR_X] = 0.5 * (world[look.X1] + world[look.X2])
    row[ANCHOR_Y] = 0.5 * (world[look.Y1] + world[look.Y2])
    half = 0.5 * math.hypot(dx, dy)
    row[START], row[END] = -half, half
    return np.array([math.atan2(-dx, dy), 0.0]), row


def bear(filter_: LandmarkFilter, nursery: Nursery, seen: Observations, world: Floats, chosen: Ints, mount: Floats,
         config: SlamConfig) -> tuple[int, ...]:  # fmt: skip
    """Add the landmarks that were seen often enough and are not there yet; returns their ids."""
    loose = (chosen < 0).nonzero()[0]
    if loose.size == 0 and nursery.empty:
        return ()
    # What lies beside a landmark of its kind, outside the gate but close, is most likely that landmark seen badly.
    near = nearest_alike(world[loose], filter_.mean, filter_.table, filter_.count, SAME_PLACE)
    loose = loose[near < 0]
    return tuple(filter_.add(mount, seen, int(loose[i])) for i in nursery.ripe(world[loose], config))


def drop_unseen(filter_: LandmarkFilter, config: SlamConfig) -> tuple[int, ...]:
    """Drop the landmarks whose false-negative rate f/(f+o) has grown too high; returns their ids."""
    count = filter_.count
    chances = filter_.observed[:count] + filter_.failed[:count]
    rate = filter_.failed[:count] / np.maximum(chances, 1)
    doomed = ((chances >= config.min_chances) & (rate > config.max_false_negative_rate)).nonzero()[0]
    return tuple(filter_.drop(int(i)) for i in doomed[::-1])


@kernel
def _difference(mean: Floats, table: Floats, i: int, j: int) -> tuple[float, float, Floats]:
    """Landmark i less landmark j, both in the terms of i, and the Jacobian by both (2 x 4)."""
    jacobian = np.zeros((2, 4))
    jacobian[0, 0] = jacobian[1, 1] = 1.0
    jacobian[0, 2] = jacobian[1, 3] = -1.0
    a, b = mean[3 + 2 * i], mean[4 + 2 * i]
    c, d = mean[3 + 2 * j], mean[4 + 2 * j]
    if table[i, KIND] == CORNER:
        return a - c, b - d, jacobian
    # The line j about the anchor of i lies n_j . (anchor_j - anchor_i) farther out.
    dx, dy = table[j, ANCHOR_X] - table[i, ANCHOR_X], table[j, ANCHOR_Y] - table[i, ANCHOR_Y]
    nx, ny = math.cos(c), math.sin(c)
    jacobian[1, 2] = -(-ny * dx + nx * dy)
    turn = -((-(a - c) + math.pi) % (2.0 * math.pi) - math.pi)
    return turn, b - (d + nx * dx + ny * dy), jacobian


@kernel
def _near_and_alike(mean: Floats, table: Floats, i: int, j: int, within: float, turn: float) -> bool:
    """Cheap test before the exact one: same kind, same looks, in one place."""
    if j == i or table[i, KIND] != table[j, KIND]:
        return False
    a, b = mean[3 + 2 * i], mean[4 + 2 * i]
    c, d = mean[3 + 2 * j], mean[4 + 2 * j]
    if table[i, KIND] == CORNER:
        if abs(a - c) > within or abs(b - d) > within or table[i, CONVEX] != table[j, CONVEX]:
            return False
        same_way = angle_between(table[i, DIRECTION], table[j, DIRECTION]) < 3.0 * turn
        return bool(same_way and math.hypot(a - c, b - d) < within)
    if angle_between(a, c) >= turn:
        return False
    dx, dy = table[j, ANCHOR_X] - table[i, ANCHOR_X], table[j, ANCHOR_Y] - table[i, ANCHOR_Y]
    if abs(b - d - math.cos(c) * dx - math.sin(c) * dy) > within:
        return False
    shift = -math.sin(a) * dx + math.cos(a) * dy
    return bool(max(table[j, START] + shift - table[i, END], table[i, START] - table[j, END] - shift) < 0.0)


@kernel
def _find_twin(
    mean: Floats, covariance: Floats, table: Floats, count: int, recent: Ints, gate: float, within: float, turn: float
) -> tuple[int, int]:
    """First pair of landmarks, one of them just seen, that the filter itself cannot tell apart; (-1, -1) for none."""
    for i in recent:
        for j in range(count):
            if not _near_and_alike(mean, table, i, j, within, turn):
                continue
            first, second, jacobian = _difference(mean, table, i, j)
            p = covariance_block(covariance, landmark_columns(np.array([i, j]))[3:])
            s = np.zeros((2, 2))
            for a in range(2):
                for b in range(2):
                    for k in range(4):
                        for m in range(4):
                            s[a, b] += jacobian[a, k] * p[k, m] * jacobian[b, m]
            # A floor of 1 cm and half a degree, what two fits to one surface differ by for other reasons than noise.
            s[0, 0] += 1e-4
            s[1, 1] += 1e-4
            determinant = s[0, 0] * s[1, 1] - s[0, 1] * s[1, 0]
            d2 = (s[1, 1] * first * first - 2.0 * s[0, 1] * first * second + s[0, 0] * second * second) / determinant
            if d2 < gate:
                return i, j
    return -1, -1


def merge_twins(filter_: LandmarkFilter, recent: Ints) -> tuple[int, ...]:
    """Make one of two landmarks that lie in one place; the older id stays. Returns the ids that went.

    The two are tied by a measurement of their difference, zero within a centimetre, so that what the younger one knew
    reaches the map; then the younger is dropped. Only pairs with one of the landmarks just seen, `recent`, are tried.
    """
    gate = chi_square_gate(0.95, 2)
    i, j = _find_twin(
        filter_.mean, filter_.covariance, filter_.table, filter_.count, recent, gate, SAME_PLACE, SAME_NORMAL
    )
    if i < 0:
        return ()
    first, second, jacobian = _difference(filter_.mean, filter_.table, i, j)
    filter_.constrain(i, j, jacobian, -np.array([first, second]), np.eye(2) * 1e-4)
    if filter_.table[i, KIND] != CORNER:
        for k in (i, j):
            filter_.mean[3 + 2 * k] = wrap(filter_.mean[3 + 2 * k])
    old, young = (i, j) if filter_.ids[i] < filter_.ids[j] else (j, i)
    keep, lose = filter_.table[old], filter_.table[young]
    if keep[KIND] == CORNER:
        keep[START], keep[END] = max(keep[START], lose[START]), max(keep[END], lose[END])
    else:
        a = filter_.mean[3 + 2 * old]
        tx, ty = -math.sin(a), math.cos(a)
        shift = tx * (lose[ANCHOR_X] - keep[ANCHOR_X]) + ty * (lose[ANCHOR_Y] - keep[ANCHOR_Y])
        keep[START], keep[END] = min(keep[START], lose[START] + shift), max(keep[END], lose[END] + shift)
    filter_.observed[old] += filter_.observed[young]
    filter_.failed[old] += filter_.failed[young]
    return (filter_.drop(int(young)),)
