"""Absolute and relative trajectory error, as the evo library defines them.

Sturm et al. (2012), "A benchmark for the evaluation of RGB-D SLAM systems"; the alignment is Umeyama's (1991), in the
plane. Only ``evo.core`` is used: it reads no settings, writes none, and logs at debug level to its own logger.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contourslam.evaluation.errors import known_rows
from contourslam.evaluation.extras import require
from contourslam.geometry.poses import compose

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class ErrorSummary:
    """Distribution of one kind of error; every value is NaN where there was nothing to measure.

    Attributes
    ----------
    rmse, mean, median, sd, max : float
        In m or rad, as the field that holds it says.
    count : int
        Number of errors.
    """

    rmse: float
    mean: float
    median: float
    sd: float
    max: float
    count: int


@dataclass(frozen=True, slots=True)
class TrajectoryError:
    """Translation (m) and rotation (rad) part of an absolute or relative trajectory error."""

    translation: ErrorSummary
    rotation: ErrorSummary


_UNKNOWN = ErrorSummary(np.nan, np.nan, np.nan, np.nan, np.nan, 0)
_NOTHING = TrajectoryError(_UNKNOWN, _UNKNOWN)


def absolute_error(poses: Floats, truth: Floats, *, aligned: bool = False) -> TrajectoryError:
    """Absolute trajectory error: how far each pose lies from the true one.

    Parameters
    ----------
    poses, truth : ndarray, shape (t, 3)
        x (m), y (m), heading (rad), row by row at the same times.
    aligned : bool
        Move the whole estimate by the rigid motion (no scale) that fits the true positions best. Where that motion is
        not determined (the robot stood still) every value is NaN.

    Returns
    -------
    TrajectoryError

    Raises
    ------
    ValueError
        If the trajectories differ in shape.
    MissingExtraError
        If evo is not installed.
    """
    poses, truth = _known(poses, truth)
    if aligned:
        moved = _umeyama(poses, truth)
        if moved is None:
            return _NOTHING
        poses = moved
    metrics = require("evo.core.metrics")
    if len(poses) == 0:
        return _NOTHING
    return _measured(metrics.APE(metrics.PoseRelation.rotation_part), truth, poses)


def relative_error(poses: Floats, truth: Floats, *, distance: float = 1.0) -> TrajectoryError:
    """Relative trajectory error over pieces of a given length: the drift.

    Parameters
    ----------
    poses, truth : ndarray, shape (t, 3)
        x (m), y (m), heading (rad), row by row at the same times.
    distance : float
        Length of the pieces along the true path, m. Every pose starts one; it counts where another pose lies within
        a tenth of the length of its end.

    Returns
    -------
    TrajectoryError
        All NaN where the path is shorter than one piece.

    Raises
    ------
    ValueError
        If the trajectories differ in shape.
    MissingExtraError
        If evo is not installed.
    """
    poses, truth = _known(poses, truth)
    metrics, unit = require("evo.core.metrics"), require("evo.core.units").Unit.meters
    if len(poses) < 2:
        return _NOTHING
    metric = metrics.RPE(
        metrics.PoseRelation.rotation_part, distance, unit, 0.1, all_pairs=True, pairs_from_reference=True
    )
    try:
        return _measured(metric, truth, poses)
    except require("evo.core.filters").FilterException:  # no piece is as long as that
        return _NOTHING


def _known(poses: Floats, truth: Floats) -> tuple[Floats, Floats]:
    known = known_rows(poses, truth)
    return poses[known], truth[known]


def _path(poses: Floats) -> Any:
    """Build evo's path from poses in the plane."""
    zero = np.zeros(len(poses))
    half = 0.5 * poses[:, 2]
    return require("evo.core.trajectory").PosePath3D(
        positions_xyz=np.column_stack([poses[:, :2], zero]),
        orientations_quat_wxyz=np.column_stack([np.cos(half), zero, zero, np.sin(half)]),
    )


def _umeyama(poses: Floats, truth: Floats) -> Floats | None:
    """Align in the plane: evo's own method works in space, and may turn a straight path over."""
    geometry = require("evo.core.geometry")
    if len(poses) < 2:
        return None
    try:
        rotation, translation, _ = geometry.umeyama_alignment(poses[:, :2].T, truth[:, :2].T)
    except geometry.GeometryException:
        return None
    motion = np.array([*translation, np.arctan2(rotation[1, 0], rotation[0, 0])])
    return compose(motion, poses)


def _measured(metric: Any, truth: Floats, poses: Floats) -> TrajectoryError:
    """Read both parts from evo's error poses: exact in the plane, and ten times as fast as evo's rotation angles."""
    metric.process_data((_path(truth), _path(poses)))
    errors = np.array(metric.E)
    return TrajectoryError(
        _summary(np.hypot(errors[:, 0, 3], errors[:, 1, 3])),
        _summary(np.abs(np.arctan2(errors[:, 1, 0], errors[:, 0, 0]))),
    )


def _summary(errors: Floats) -> ErrorSummary:
    if len(errors) == 0:
        return _UNKNOWN
    return ErrorSummary(
        float(np.sqrt(np.mean(errors**2))),
        float(errors.mean()),
        float(np.median(errors)),
        float(errors.std()),
        float(errors.max()),
        len(errors),
    )
