"""Joint compatibility branch and bound (Neira and Tardos 2001): the largest set of pairs that agree with each other."""

import math

import numpy as np

from contourslam.contour.contours import Floats, Ints
from contourslam.kernels import kernel
from contourslam.slam.ekf import covariance_block, landmark_columns
from contourslam.slam.measurement import CORNER, KIND

# A single pair has no other to agree with: its direction must be known this well (rad) beforehand.
ALONE = 0.08
LOG_TWO_PI = math.log(2.0 * math.pi)
MOST_NODES = 20_000  # the search ends here with the best set so far


@kernel
def _pair_covariance(
    noises: Floats, covariance: Floats, by_pose: Floats, by_landmark: Floats, seen: Ints, landmark: Ints
) -> Floats:
    """Covariance of the stacked innovations of all pairs (2p x 2p): those of two pairs share pose and map."""
    p = seen.size
    block = covariance_block(covariance, landmark_columns(landmark))
    h = np.zeros((2 * p, 3 + 2 * p))
    for q in range(p):
        h[2 * q : 2 * q + 2, :3] = by_pose[landmark[q]]
        h[2 * q : 2 * q + 2, 3 + 2 * q : 5 + 2 * q] = by_landmark[landmark[q]]
    out = np.zeros((2 * p, 2 * p))
    hp = np.zeros((2 * p, 3 + 2 * p))
    for a in range(2 * p):
        q = a // 2
        for m in range(3 + 2 * p):
            total = 0.0
            for k in range(3):
                total += h[a, k] * block[k, m]
            for k in range(3 + 2 * q, 5 + 2 * q):
                total += h[a, k] * block[k, m]
            hp[a, m] = total
    for a in range(2 * p):
        for b in range(2 * p):
            q = b // 2
            total = 0.0
            for k in range(3):
                total += hp[a, k] * h[b, k]
            for k in range(3 + 2 * q, 5 + 2 * q):
                total += hp[a, k] * h[b, k]
            out[a, b] = total
    for q in range(p):
        for r in range(p):
            if seen[q] == seen[r]:  # two pairs of one observation share its noise too
                out[2 * q : 2 * q + 2, 2 * r : 2 * r + 2] += noises[seen[q]]
    return out


@kernel
def _extend(lower: Floats, y: Floats, s: Floats, nu: Floats, order: Ints, depth: int) -> bool:
    """Add pair ``order[depth]`` to the Cholesky factor and the whitened innovation of the pairs before it."""
    for half in range(2):
        row = 2 * depth + half
        a = 2 * order[depth] + half
        square, value = s[a, a], nu[a]
        for column in range(row):
            b = 2 * order[column // 2] + column % 2
            total = s[a, b]
            for k in range(column):
                total -= lower[row, k] * lower[column, k]
            lower[row, column] = total / lower[column, column]
            square -= lower[row, column] ** 2
            value -= lower[row, column] * y[column]
        if square <= 1e-15:
            return False
        lower[row, row] = square**0.5
        y[row] = value / lower[row, row]
    return True


@kernel
def joint_compatibility(
    news: Floats, noises: Floats, covariance: Floats, table: Floats, by_pose: Floats, by_landmark: Floats, seen: Ints,
    landmark: Ints, innovations: Floats, gates: Floats,
) -> Ints:  # fmt: skip
    """Largest jointly compatible set of pairs, of equally large ones the one of least joint distance.

    A set must also be likelier than that all its observations are landmarks never seen before: where the pose is in
    doubt by more than landmarks lie apart, one that falls inside the gate says nothing.

    Parameters
    ----------
    news : ndarray, shape (k,)
        Logarithm of how many unknown landmarks there are per unit of each observation's measurement.
    noises, covariance, table, by_pose, by_landmark
        As in :func:`contourslam.slam.gating.compatible_pairs`.
    seen, landmark : ndarray of int, shape (p,)
        Individually compatible pairs, in ascending order of `seen`.
    innovations : ndarray, shape (p, 2)
    gates : ndarray, shape (>= k + 1,)
        ``gates[m]`` is the chi-square gate for m pairs, 2 m degrees of freedom.

    Returns
    -------
    ndarray of int, shape (k,)
        Landmark of each observation, or -1.
    """
    k, p = news.size, seen.size
    chosen = np.full(k, -1, dtype=np.int64)
    if p == 0:
        return chosen
    s = _pair_covariance(noises, covariance, by_pose, by_landmark, seen, landmark)
    nu = innovations.copy().reshape(2 * p)
    first = np.full(k + 1, p, dtype=np.int64)
    for q in range(p - 1, -1, -1):
        first[seen[q]] = q
    for i in range(k - 1, -1, -1):
        first[i] = min(first[i], first[i + 1])
    lower, y = np.zeros((2 * k, 2 * k)), np.zeros(2 * k)
    order = np.empty(k, dtype=np.int64)  # pairs of the present hypothesis
    # Depth-first over the observations: at level i try each pair of observation i, then "none of them".
    tried = np.empty(k + 1, dtype=np.int64)
    took = np.zeros(k + 1, dtype=np.bool_)
    best_size, best_distance, best_evidence = 0, np.inf, 0.0
    best_angular = 0.0
    level, size, nodes = 0, 0, 0
    tried[0] = first[0]
    while level >= 0 and nodes < MOST_NODES:
        if level == k:
            distance = 0.0
            for a in range(2 * size):
                distance += y[a] * y[a]
            if size > best_size or (size == best_size and distance < best_distance):
                best_size, best_distance = size, distance
                best_evidence = -distance
                if size == 1:
                    q = order[0]
                    a = 2 * q + (1 if table[landmark[q], KIND] == CORNER else 0)  # its angle
                    best_angular = s[a, a]
                for a in range(2 * size):
                    best_evidence -= 2.0 * math.log(lower[a, a])
                for q in range(size):
                    best_evidence -= 2.0 * (LOG_TWO_PI + news[seen[order[q]]])
                chosen[:] = -1
                for q in range(size):
                    chosen[seen[order[q]]] = landmark[order[q]]
            level -= 1
            continue
        if took[level]:
            size -= 1
            took[level] = False
        nodes += 1
        descend = False
        while tried[level] < first[level + 1]:
            pair = tried[level]
            tried[level] += 1
            used = False
            for q in range(size):
                used = used or landmark[order[q]] == landmark[pair]
            if used:
                continue
            order[size] = pair
            if not _extend(lower, y, s, nu, order, size):
                continue
            distance = 0.0
            for a in range(2 * size + 2):
                distance += y[a] * y[a]
            if distance <= gates[size + 1]:
                size += 1
                took[level] = True
                descend = True
                break
        if not descend and tried[level] == first[level + 1]:
            tried[level] += 1  # the last branch: this observation is none of them
            # Bound: even if all that are left were paired, it must not fall short of the best.
            descend = size + (k - level - 1) >= max(best_size, 1)
        if descend:
            level += 1
            if level < k:
                tried[level] = first[level]
                took[level] = False
        else:
            level -= 1
    if best_size == 1 and best_angular > ALONE * ALONE:
        chosen[:] = -1
    if best_evidence <= 0.0:  # twice the logarithm of the ratio of the two likelihoods
        chosen[:] = -1
    return chosen
