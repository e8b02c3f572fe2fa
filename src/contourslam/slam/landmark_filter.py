"""The one mutable thing of the pipeline: pose and landmarks with their joint covariance, and their life stories."""

import math

import numpy as np

from contourslam.contour.contours import Floats, Ints
from contourslam.geometry.angles import wrap, wrap_angle
from contourslam.kernels import kernel
from contourslam.slam import ekf
from contourslam.slam import observation as look
from contourslam.slam.landmark_map import CornerMap, WallMap
from contourslam.slam.measurement import (
    ANCHOR_X,
    ANCHOR_Y,
    COLUMNS,
    CONVEX,
    CORNER,
    DIRECTION,
    END,
    FIRST_A,
    FIRST_B,
    KIND,
    OPENING,
    START,
    WALL,
)
from contourslam.slam.observation import Observations, to_world

END_POINT_SIGMA = 0.05  # along a wall its end is known no better than this, m


@kernel
def _sides_by_way(world: Floats) -> tuple[float, float]:
    """Lengths of a corner's sides at direction -opening/2 and +opening/2; observed is the contour's order."""
    # Along the contour matter lies to the right: at a convex corner the second side is the one at +opening/2.
    first, second = world[look.X2], world[look.Y2]
    return (first, second) if world[look.CONVEX] > 0.5 else (second, first)


@kernel
def _refresh(mean: Floats, table: Floats, observed: Ints, landmarks: Ints, world: Floats) -> None:
    for k in range(landmarks.size):
        i = landmarks[k]
        row, seen = table[i], world[k]
        if row[KIND] == CORNER:
            weight = 1.0 / min(observed[i] + 1.0, 20.0)
            row[DIRECTION] = wrap_angle(row[DIRECTION] + weight * wrap_angle(seen[look.DIRECTION] - row[DIRECTION]))
            row[OPENING] += weight * (seen[look.OPENING] - row[OPENING])
            first, last = _sides_by_way(seen)
            row[START], row[END] = max(row[START], first), max(row[END], last)
        else:
            tx, ty = -math.sin(mean[3 + 2 * i]), math.cos(mean[3 + 2 * i])
            first = tx * (seen[look.X1] - row[ANCHOR_X]) + ty * (seen[look.Y1] - row[ANCHOR_Y])
            last = tx * (seen[look.X2] - row[ANCHOR_X]) + ty * (seen[look.Y2] - row[ANCHOR_Y])
            row[START], row[END] = min(row[START], first), max(row[END], last)


@kernel
def _wrap_walls(mean: Floats, table: Floats, landmarks: Ints) -> None:
    for i in landmarks:
        if table[i, KIND] == WALL:
            mean[3 + 2 * i] = wrap_angle(mean[3 + 2 * i])


class LandmarkFilter:
    """Pose, landmarks and covariance; it is changed in place by every step.

    Attributes
    ----------
    mean : ndarray
        x (m), y (m), heading (rad), then two numbers for each landmark; room to grow lies behind them.
    covariance : ndarray
        Lower triangle of the joint covariance.
    table : ndarray
        What is fixed about each landmark, see :mod:`contourslam.slam.measurement`.
    ids, observed, failed : ndarray of int
        Identity, o and f of each landmark.
    count : int
        Number of landmarks.
    """

    def __init__(self, pose: Floats) -> None:
        self.count = 0
        self.next_id = 0
        self._allocate(16)
        self.mean[:3] = pose
        # Exactly known, but for what keeps the covariance positive definite.
        self.covariance[:3, :3] = np.diag([1e-10, 1e-10, 1e-10])

    def _allocate(self, landmarks: int) -> None:
        old = self.__dict__.copy()
        size = 3 + 2 * landmarks
        self.mean, self.covariance = np.zeros(size), np.zeros((size, size))
        self.table = np.zeros((landmarks, COLUMNS))
        self.ids, self.observed, self.failed = (np.zeros(landmarks, np.int64) for _ in range(3))
        if self.count:
            n = self.size
            self.mean[:n], self.covariance[:n, :n] = old["mean"][:n], old["covariance"][:n, :n]
            for name in ("table", "ids", "observed", "failed"):
                getattr(self, name)[: self.count] = old[name][: self.count]

    @property
    def size(self) -> int:
        """Numbers in the state."""
        return 3 + 2 * self.count

    @property
    def pose(self) -> Floats:
        """Copy of the pose, shape (3,)."""
        return self.mean[:3].copy()

    @property
    def pose_covariance(self) -> Floats:
        """Full covariance of the pose, shape (3, 3)."""
        p = self.covariance
        return np.array([[p[0, 0], p[1, 0], p[2, 0]], [p[1, 0], p[1, 1], p[2, 1]], [p[2, 0], p[2, 1], p[2, 2]]])

    def add(self, mount: Floats, seen: Observations, index: int) -> int:
        """Bring observation `index` into the state as a new landmark with full cross-covariance; returns its id."""
        if self.count == len(self.ids):
            self._allocate(2 * self.count)
        pose = self.mean[:3]
        world = to_world(pose, mount, seen.looks[index : index + 1])[0]
        heading = pose[2] + mount[2]
        swing_x = -math.sin(pose[2]) * mount[0] - math.cos(pose[2]) * mount[1]  # lidar's motion by heading
        swing_y = math.cos(pose[2]) * mount[0] - math.sin(pose[2]) * mount[1]
        row = np.zeros(COLUMNS)
        row[KIND] = world[look.KIND]
        if row[KIND] == CORNER:
            a, b = world[look.X1], world[look.Y1]
            r, bearing = seen.values[index, 0], heading + seen.values[index, 1]
            cos, sin = math.cos(bearing), math.sin(bearing)
            by_pose = np.array([[1.0, 0.0, swing_x - r * sin], [0.0, 1.0, swing_y + r * cos]])
            by_measurement = np.array([[cos, -r * sin], [sin, r * cos]])
            row[DIRECTION], row[OPENING] = wrap(world[look.DIRECTION]), world[look.OPENING]
            row[CONVEX] = world[look.CONVEX]
            row[START], row[END] = _sides_by_way(world)
        else:
            a, b = float(wrap(heading + seen.values[index, 0])), 0.0
            nx, ny = math.cos(a), math.sin(a)
            x, y = 0.5 * (world[look.X1] + world[look.X2]), 0.5 * (world[look.Y1] + world[look.Y2])
            row[ANCHOR_X], row[ANCHOR_Y] = x, y
            # b = distance + n . (lidar - anchor) = 0 at the anchor; its derivatives:
            lx = pose[0] + math.cos(pose[2]) * mount[0] - math.sin(pose[2]) * mount[1] - x
            ly = pose[1] + math.sin(pose[2]) * mount[0] + math.cos(pose[2]) * mount[1] - y
            b = seen.values[index, 1] + nx * lx + ny * ly
            lever = -ny * lx + nx * ly
            by_pose = np.array([[0.0, 0.0, 1.0], [nx, ny, nx * swing_x + ny * swing_y + lever]])
            by_measurement = np.array([[1.0, 0.0], [lever, 1.0]])
            half = 0.5 * math.hypot(world[look.X2] - world[look.X1], world[look.Y2] - world[look.Y1])
            row[START], row[END] = -half, half
        row[FIRST_A], row[FIRST_B] = a, b
        ekf.augment(self.mean, self.covariance, self.size, a, b, by_pose, by_measurement, seen.noises[index])
        i = self.count
        self.table[i], self.ids[i], self.observed[i], self.failed[i] = row, self.next_id, 0, 0
        self.count += 1
        self.next_id += 1
        return self.next_id - 1

    def refresh(self, landmarks: Ints, world: Floats) -> None:
        """Let sightings update what the filter does not estimate: a corner's looks, a wall's extent."""
        _refresh(self.mean, self.table, self.observed, landmarks, world)

    def drop(self, index: int) -> int:
        """Marginalise landmark `index` out of the state; returns its id."""
        gone = int(self.ids[index])
        ekf.remove(self.mean, self.covariance, self.size, 3 + 2 * index)
        for array in (self.table, self.ids, self.observed, self.failed):
            array[index : self.count - 1] = array[index + 1 : self.count]
        self.count -= 1
        return gone

    def block(self, index: int) -> Floats:
        """Covariance of one landmark's two numbers, shape (2, 2)."""
        return ekf.covariance_block(self.covariance, np.array([3 + 2 * index, 4 + 2 * index]))

    def wrap_walls(self, landmarks: Ints) -> None:
        """Wrap the directions of these landmarks that are walls, after a correction."""
        _wrap_walls(self.mean, self.table, landmarks)

    def constrain(self, first: int, second: int, jacobian: Floats, nu: Floats, noise: Floats) -> float:
        """Correct with a relation between two landmarks (`jacobian` of shape (2, 4)); returns the NIS."""
        columns = ekf.landmark_columns(np.array([first, second]))[3:]
        return ekf.correct(self.mean, self.covariance, self.size, columns, jacobian, nu, noise)

    def corner_map(self) -> CornerMap:
        """Snapshot of the corners in the world frame."""
        rows = self._rows(CORNER)
        return CornerMap(
            self.ids[rows].copy(),
            np.array([self.mean[3 + 2 * i : 5 + 2 * i] for i in rows]).reshape(-1, 2),
            np.array([self.block(i) for i in rows]).reshape(-1, 2, 2),
            self.table[rows, DIRECTION],
            self.table[rows, OPENING],
            self.table[rows, CONVEX] > 0.5,
            self.observed[rows].copy(),
            self.failed[rows].copy(),
        )

    def wall_map(self) -> WallMap:
        """Snapshot of the walls in the world frame."""
        rows = self._rows(WALL)
        end_covariances: list[Floats] = []
        line_covariances: list[Floats] = []
        ends = np.empty((len(rows), 2, 2))
        for k, i in enumerate(rows):
            row, (a, b) = self.table[i], self.mean[3 + 2 * i : 5 + 2 * i]
            normal, tangent = np.array([math.cos(a), math.sin(a)]), np.array([-math.sin(a), math.cos(a)])
            foot = row[ANCHOR_X : ANCHOR_Y + 1] + b * normal
            block = self.block(i)
            for e, along in enumerate((row[START], row[END])):
                ends[k, e] = foot + along * tangent
                # Turning the line about the anchor moves the end across by its distance from it.
                across = block[1, 1] - 2.0 * along * block[0, 1] + along * along * block[0, 0]
                spread = np.outer(normal, normal) * across + np.outer(tangent, tangent) * END_POINT_SIGMA**2
                end_covariances.append(spread)
            middle = 0.5 * (row[START] + row[END])
            turn = np.array([[1.0, 0.0], [-middle, 1.0]])
            line_covariances.append(turn @ block @ turn.T)
        return WallMap(
            self.ids[rows].copy(),
            ends,
            np.array(end_covariances).reshape(-1, 2, 2, 2),
            np.array([self.mean[3 + 2 * i] for i in rows]),
            np.array(line_covariances).reshape(-1, 2, 2),
            self.observed[rows].copy(),
            self.failed[rows].copy(),
        )

    def _rows(self, kind: float) -> Ints:
        return np.flatnonzero(self.table[: self.count, KIND] == kind)
