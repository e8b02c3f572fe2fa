"""Corners that a detector found in each scan, held against the true corners of the room."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contourslam.evaluation.extras import require
from contourslam.evaluation.ground_truth import GroundTruth
from contourslam.evaluation.visibility import VisibilityLimits, visible_corners
from contourslam.geometry.angles import wrap
from contourslam.geometry.poses import transform

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class DetectedCorners:
    """Corners found in one scan, in the lidar's frame.

    Attributes
    ----------
    positions : ndarray, shape (k, 2)
        m; the refined ones where there is a refinement.
    directions : ndarray, shape (k,)
        Bisectors pointing into the angle, rad.
    convex : ndarray of bool, shape (k,)
        True where matter fills the angle.
    raw_positions : ndarray, shape (k, 2), or None
        The contour's own vertices before the refinement, m.
    """

    positions: Floats
    directions: Floats
    convex: NDArray[np.bool_]
    raw_positions: Floats | None = None


@dataclass(frozen=True, slots=True)
class MatchLimits:
    """When a detected corner is a true one; both must be convex, or both concave.

    Attributes
    ----------
    radius : float
        They lie no farther apart than this, m.
    turn_deg : float
        Their bisectors differ by no more than this, degrees.
    """

    radius: float = 0.2
    turn_deg: float = 30.0


@dataclass(frozen=True, slots=True)
class DetectionScore:
    """Detections against truth; one row per scan, totals as properties (NaN where there was nothing to count).

    Attributes
    ----------
    detected, matched : ndarray of int, shape (t,)
        Corners detected, and those among them that are true corners.
    visible, found : ndarray of int, shape (t,)
        True corners the scan shows (``visible_corners``), and those among them that were detected.
    errors : ndarray, shape (m,)
        Distance of every matched corner from the true one, m.
    raw_errors : ndarray, shape (m,), or empty where a scan came without raw positions
        The same for the raw contour vertices.
    repeatable, repeated : int
        Corners found in one scan and visible in the next, and those among them found there again.
    """

    detected: Ints
    matched: Ints
    visible: Ints
    found: Ints
    errors: Floats
    raw_errors: Floats
    repeatable: int
    repeated: int

    @property
    def precision(self) -> float:
        """Share of the detected corners that are true ones."""
        return _share(int(self.matched.sum()), int(self.detected.sum()))

    @property
    def recall(self) -> float:
        """Share of the visible true corners that were detected."""
        return _share(int(self.found.sum()), int(self.visible.sum()))

    @property
    def repeatability(self) -> float:
        """Share of the corners found in one scan, and visible in the next, that are found again there.

        The idea of Schmid, Mohr & Bauckhage (2000), "Evaluation of interest point detectors": repeated points over
        the points of the part that both views show. Theirs compares points with points; here both are tied to the
        true corner, so a detector cannot gain by repeating a false one.
        """
        return _share(self.repeated, self.repeatable)

    @property
    def mean_error(self) -> float:
        """Mean localisation error, m."""
        return float(self.errors.mean()) if len(self.errors) else np.nan

    @property
    def rms_error(self) -> float:
        """Root mean square localisation error, m."""
        return float(np.sqrt(np.mean(self.errors**2))) if len(self.errors) else np.nan

    @property
    def raw_mean_error(self) -> float:
        """Mean localisation error of the raw vertices, m."""
        return float(self.raw_errors.mean()) if len(self.raw_errors) else np.nan

    @property
    def raw_rms_error(self) -> float:
        """Root mean square localisation error of the raw vertices, m."""
        return float(np.sqrt(np.mean(self.raw_errors**2))) if len(self.raw_errors) else np.nan


def match_corners(
    detected: DetectedCorners, lidar_pose: Floats, truth: GroundTruth, limits: MatchLimits | None = None
) -> tuple[Ints, Ints]:
    """Match detected corners to true ones, one to one: as many as possible, then the least sum of distances.

    Parameters
    ----------
    detected : DetectedCorners
    lidar_pose : ndarray, shape (3,)
        True pose of the lidar in the world frame.
    truth : GroundTruth
    limits : MatchLimits, optional

    Returns
    -------
    rows, columns : ndarray of int, shape (m,)
        Indices of the detected and of the true corners.

    Raises
    ------
    MissingExtraError
        If scipy is not installed.
    """
    limits = limits or MatchLimits()
    world = transform(lidar_pose, detected.positions)
    distance = np.linalg.norm(world[:, None] - truth.positions, axis=-1)
    turn = np.abs(wrap(detected.directions[:, None] + lidar_pose[2] - truth.directions))
    possible = (distance <= limits.radius) & (turn <= np.radians(limits.turn_deg))
    possible &= detected.convex[:, None] == truth.convex
    # An impossible pair costs more than all possible ones together.
    cost = np.where(possible, distance, (limits.radius + 1.0) * (min(distance.shape, default=0) + 1))
    rows, columns = require("scipy.optimize").linear_sum_assignment(cost)
    kept = possible[rows, columns]
    return np.asarray(rows[kept], dtype=np.int64), np.asarray(columns[kept], dtype=np.int64)


def score_detections(
    scans: Sequence[DetectedCorners],
    lidar_poses: Floats,
    truth: GroundTruth,
    angles: Floats | Sequence[Floats],
    visibility: VisibilityLimits | None = None,
    match: MatchLimits | None = None,
) -> DetectionScore:
    """Precision, recall, localisation error and repeatability of a detector over a run.

    Parameters
    ----------
    scans : sequence of DetectedCorners, length t
        In the order in which they were taken.
    lidar_poses : ndarray, shape (t, 3)
        True poses of the lidar in the world frame.
    truth : GroundTruth
    angles : ndarray, shape (n,), or sequence of t of them
        Beam directions in the lidar's frame, rad: one set for all scans, or one per scan.
    visibility : VisibilityLimits, optional
    match : MatchLimits, optional

    Returns
    -------
    DetectionScore

    Raises
    ------
    ValueError
        If the numbers of scans, poses and sets of angles differ.
    MissingExtraError
        If scipy is not installed.
    """
    per_scan = [angles] * len(scans) if isinstance(angles, np.ndarray) else angles
    if not len(scans) == len(lidar_poses) == len(per_scan):
        raise ValueError(f"{len(scans)} scans, {len(lidar_poses)} poses and {len(per_scan)} sets of angles must agree")
    counts = np.zeros((4, len(scans)), dtype=np.int64)
    errors: list[Floats] = []
    raw_errors: list[Floats] = []
    repeatable = repeated = 0
    found_before = np.zeros(len(truth.positions), dtype=np.bool_)
    for t, (scan, pose, beams) in enumerate(zip(scans, lidar_poses, per_scan, strict=True)):
        rows, columns = match_corners(scan, pose, truth, match)
        seen = visible_corners(truth, pose, beams, visibility)
        found = np.zeros(len(seen), dtype=np.bool_)
        found[columns] = True
        counts[:, t] = len(scan.positions), len(rows), seen.sum(), (found & seen).sum()
        errors.append(_distances(pose, scan.positions[rows], truth.positions[columns]))
        if scan.raw_positions is not None:
            raw_errors.append(_distances(pose, scan.raw_positions[rows], truth.positions[columns]))
        repeatable += int((found_before & seen).sum())
        repeated += int((found_before & seen & found).sum())
        found_before = found
    raw = raw_errors if len(raw_errors) == len(scans) else []
    detected, matched, visible, found_visible = counts
    return DetectionScore(
        detected, matched, visible, found_visible, _joined(errors), _joined(raw), repeatable, repeated
    )


def _distances(lidar_pose: Floats, positions: Floats, true_positions: Floats) -> Floats:
    return np.asarray(np.linalg.norm(transform(lidar_pose, positions) - true_positions, axis=-1))


def _joined(parts: list[Floats]) -> Floats:
    return np.concatenate(parts) if parts else np.empty(0)


def _share(part: int, whole: int) -> float:
    return part / whole if whole else np.nan
