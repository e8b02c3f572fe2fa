"""Which observation belongs to which landmark: gate, score and assign, each a step of its own.

The paper's own rule is the nearest neighbour within a fixed distance. Beside it stand the nearest in the sense of
Mahalanobis, the mutual nearest with a test against the runner-up, and joint compatibility (Neira and Tardos 2001).
"""

import math

import numpy as np

from contourslam.config import SlamConfig
from contourslam.contour.contours import Floats, Ints
from contourslam.kernels import kernel
from contourslam.slam import observation as look
from contourslam.slam.gates import chi_square_gate, joint_gates
from contourslam.slam.gating import compatible_pairs, looks_alike, offset_from
from contourslam.slam.joint import joint_compatibility
from contourslam.slam.landmark_filter import LandmarkFilter
from contourslam.slam.measurement import CORNER, KIND
from contourslam.slam.observation import Observations

AMBIGUITY_LEAD = 4.0  # a runner-up this much farther in squared Mahalanobis distance is e² times less likely

UNKNOWN_CORNERS = 0.1  # corners not yet in the map, per m²; in range and bearing that is as many times the range
UNKNOWN_WALLS = 1.0  # walls not yet in the map, per radian of direction and metre of distance

Model = tuple[Floats, Floats, Floats]  # expected measurements and their Jacobians by pose and by landmark


@kernel
def nearest_within(world: Floats, mean: Floats, table: Floats, count: int, threshold: float) -> Ints:
    """The paper's rule: each observation takes the nearest landmark of its kind within `threshold` m, else -1.

    Where two observations want one landmark the nearer one gets it.
    """
    chosen = np.full(world.shape[0], -1, dtype=np.int64)
    owner = np.full(count, -1, dtype=np.int64)
    closest = np.full(count, np.inf)
    for i in range(world.shape[0]):
        best = threshold
        for j in range(count):
            if world[i, look.KIND] != table[j, KIND]:
                continue
            if table[j, KIND] != CORNER and not looks_alike(world[i], table[j], mean[3 + 2 * j]):
                continue  # the paper has no walls; without direction and extent every parallel wall would be near
            apart = offset_from(world[i], table[j], mean[3 + 2 * j], mean[4 + 2 * j])
            if apart < best:
                best, chosen[i] = apart, j
        j = chosen[i]
        if j >= 0:
            if best < closest[j]:
                if owner[j] >= 0:
                    chosen[owner[j]] = -1
                owner[j], closest[j] = i, best
            else:
                chosen[i] = -1
    return chosen


@kernel
def assign_nearest(k: int, count: int, seen: Ints, landmark: Ints, distance: Floats, lead: float) -> Ints:
    """Mutual nearest pairs by Mahalanobis distance; with a `lead` only where the runner-up is that much farther.

    Two landmarks that both explain an observation, or two observations that both want one landmark, leave it open.
    """
    best_of_seen, second_of_seen = np.full(k, np.inf), np.full(k, np.inf)
    best_of_landmark, second_of_landmark = np.full(count, np.inf), np.full(count, np.inf)
    for p in range(seen.size):
        i, j, d = seen[p], landmark[p], distance[p]
        if d < best_of_seen[i]:
            best_of_seen[i], second_of_seen[i] = d, best_of_seen[i]
        elif d < second_of_seen[i]:
            second_of_seen[i] = d
        if d < best_of_landmark[j]:
            best_of_landmark[j], second_of_landmark[j] = d, best_of_landmark[j]
        elif d < second_of_landmark[j]:
            second_of_landmark[j] = d
    chosen = np.full(k, -1, dtype=np.int64)
    for p in range(seen.size):
        i, j, d = seen[p], landmark[p], distance[p]
        mutual = d == best_of_seen[i] and d == best_of_landmark[j]
        if mutual and second_of_seen[i] >= d + lead and second_of_landmark[j] >= d + lead:
            chosen[i] = j
    return chosen


@kernel
def log_unknown(world: Floats, values: Floats) -> Floats:
    """Logarithm of how many unknown landmarks there are per unit of each observation's measurement, shape (k,)."""
    out = np.empty(world.shape[0])
    for i in range(world.shape[0]):
        corner = world[i, look.KIND] == CORNER
        out[i] = math.log(UNKNOWN_CORNERS * max(values[i, 0], 0.1) if corner else UNKNOWN_WALLS)
    return out


def associate(seen: Observations, world: Floats, f: LandmarkFilter, model: Model, config: SlamConfig) -> Ints:
    """Landmark of each observation, -1 where it has none.

    Parameters
    ----------
    seen : Observations
        k of them.
    world : ndarray, shape (k, 8)
        Their looks, moved to the world.
    f : LandmarkFilter
    model : tuple of ndarray
        What :func:`contourslam.slam.measurement.predict_measurements` says of every landmark.
    config : SlamConfig

    Returns
    -------
    ndarray of int, shape (k,)
        Index of the landmark in the filter.
    """
    if config.association == "nearest":
        return nearest_within(world, f.mean, f.table, f.count, config.nearest_threshold)
    gate = chi_square_gate(config.gate_probability, 2)
    rows, landmarks, distance, innovations = compatible_pairs(
        seen.values, seen.noises, world, f.mean, f.covariance, f.table, f.count, *model, gate
    )
    if config.association == "joint":
        gates = joint_gates(config.gate_probability, len(seen))
        news = log_unknown(world, seen.values)
        return joint_compatibility(
            news, seen.noises, f.covariance, f.table, model[1], model[2], rows, landmarks, innovations, gates
        )
    lead = AMBIGUITY_LEAD if config.association == "mutual" else 0.0
    return assign_nearest(len(seen), f.count, rows, landmarks, distance, lead)
