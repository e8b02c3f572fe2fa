"""A sighting of a corner or a wall as a relation between its keyframe and its landmark."""

import math

import gtsam
import numpy as np

from contourslam.contour.contours import Floats, Ints
from contourslam.graph.landmark_set import LandmarkSet
from contourslam.graph.pose_graph import PoseGraph, relation
from contourslam.graph.sightings import DIRECTION, KIND, PTT, PXT, PXX, PXY, PYY, Sightings, X, Y, to_world
from contourslam.kernels import kernel
from contourslam.slam.measurement import CORNER

LANDMARK = 1 << 40  # landmark i is variable LANDMARK + i, above all keyframes
ROBUST = 2.0  # width of the Cauchy kernel, in standard deviations
LOOSE = np.diag([0.0, 1.0 / 1.0**2, 0.0])  # a wall's point is held along its line within 1 m by one keyframe


@kernel
def measured(seen: Floats, world: Floats, landmark: Floats) -> tuple[Floats, Floats]:
    """Pose of a landmark seen from a keyframe, with its information in the landmark's frame.

    A corner is measured where it is. Of a wall only the line is measured; its origin is put where the landmark's point
    falls on the line, and along the line it has no information.

    Parameters
    ----------
    seen, world : ndarray, shape (COLUMNS,)
        The sighting in the base frame of its keyframe, and in the world.
    landmark : ndarray, shape (COLUMNS,)
        In the world.

    Returns
    -------
    pose : ndarray, shape (3,)
    information : ndarray, shape (3, 3)
    """
    pose, information = np.empty(3), np.zeros((3, 3))
    pose[0], pose[1], pose[2] = seen[X], seen[Y], seen[DIRECTION]
    if seen[KIND] == CORNER:
        a, b, c = seen[PXX], seen[PXY], seen[PYY]
        det = a * c - b * b
        information[0, 0], information[1, 1], information[2, 2] = c / det, a / det, 1.0 / seen[PTT]
        information[0, 1] = information[1, 0] = -b / det
        return pose, information
    tx, ty = -math.sin(world[DIRECTION]), math.cos(world[DIRECTION])
    s = tx * (landmark[X] - world[X]) + ty * (landmark[Y] - world[Y])
    pose[0] -= math.sin(pose[2]) * s
    pose[1] += math.cos(pose[2]) * s
    # Turning the line by dt about its middle moves it across by -s dt here.
    c = seen[PTT]
    a, b = seen[PXX] - 2.0 * s * seen[PXT] + s * s * c, seen[PXT] - s * c
    det = a * c - b * b
    information[0, 0], information[2, 2] = c / det, a / det
    information[0, 2] = information[2, 0] = -b / det
    return pose, information


@kernel
def measured_all(seen: Floats, world: Floats, landmarks: Floats) -> tuple[Floats, Floats]:
    """:func:`measured` for n rows: shapes (n, 3) and (n, 3, 3)."""
    poses, information = np.empty((seen.shape[0], 3)), np.empty((seen.shape[0], 3, 3))
    for i in range(seen.shape[0]):
        poses[i], information[i] = measured(seen[i], world[i], landmarks[i])
    return poses, information


def bind(graph: PoseGraph, rows: Floats, world: Floats, keys: Ints, numbers: Ints, table: Floats, fresh: Ints) -> None:
    """Add landmarks and their sightings to a graph.

    Parameters
    ----------
    graph : PoseGraph
    rows, world : ndarray, shape (n, COLUMNS)
        Sightings in their base frames and in the world.
    keys, numbers : ndarray of int, shape (n,)
        Their keyframes, and the numbers of their landmarks.
    table : ndarray, shape (n, COLUMNS)
        Their landmarks in the world.
    fresh : ndarray of bool, shape (n,)
        True where the landmark is not in the graph yet: once for each.
    """
    for i in range(len(rows)):
        key, variable = int(keys[i]), LANDMARK + int(numbers[i])
        pose, information = measured(rows[i], world[i], table[i])
        if fresh[i]:
            graph.add(variable, table[i, [X, Y, DIRECTION]])
            if rows[i, KIND] != CORNER:
                graph.sight(key, variable, pose, LOOSE)
        graph.sight(key, variable, pose, information, ROBUST)


def relations(
    found: LandmarkSet, sightings: Sightings, poses: Floats
) -> tuple[gtsam.NonlinearFactorGraph, gtsam.Values]:
    """Factors and starting values that put a whole set of landmarks into a graph solved at once.

    Parameters
    ----------
    found : LandmarkSet
    sightings : Sightings
        From which it was made.
    poses : ndarray, shape (k, 3)
        All keyframes in the world, at which it was made.

    Returns
    -------
    factors : gtsam.NonlinearFactorGraph
    values : gtsam.Values
        Of the landmarks; landmark i of the set is variable ``LANDMARK + i``.
    """
    factors, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
    which = np.flatnonzero(found.labels >= 0)
    keys, labels = sightings.keys[which], found.labels[which]
    rows = sightings.rows[which].astype(np.float64)
    seen, information = measured_all(rows, to_world(rows, keys, poses), found.table[labels])
    for i, (key, label) in enumerate(zip(keys.tolist(), labels.tolist(), strict=True)):
        variable = LANDMARK + label
        factors.push_back(relation(key, variable, seen[i], information[i], ROBUST))
        if key == found.first[label] and not values.exists(variable):
            values.insert(variable, gtsam.Pose2(*found.table[label, X : DIRECTION + 1]))
            if rows[i, KIND] != CORNER:
                factors.push_back(relation(key, variable, seen[i], LOOSE))
    return factors, values
