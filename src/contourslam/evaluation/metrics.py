"""A run as one dictionary of numbers, ready for metrics.json, and its mean over seeds.

Schema of one run (SI units, angles in rad; null where a quantity is not known or its library is not installed):

``detector``, ``scans``, ``complete``, ``skipped``
    Name, number of scans, whether the recording was replayed to its end, what could not be used by reason.
``rmse.x``, ``rmse.y``, ``rmse.theta``; ``online_rmse`` and ``odometry_rmse`` with the same keys
    Table I; of the poses as known at the time, where they differ; and raw odometry's own error.
``ate.rmse``, ``.mean``, ``.median``, ``.max``, ``.rotation_rmse``, ``.aligned_rmse``
    Absolute trajectory error; the last after the rigid motion that fits best.
``rpe.rmse``, ``.mean``, ``.median``, ``.max``, ``.rotation_rmse``
    Relative trajectory error per metre of the true path.
``nees``, ``nees_inside``
    Mean NEES of the pose (ideal 3), and the share of the steps inside the 95 % bounds of one run.
``inside_two_sigma.x``, ``.y``, ``.theta``
    Share of the errors within two stated standard deviations (ideal 0.954).
``nis``, ``nis_inside``
    Mean NIS per degree of freedom, and the share of the corrections inside their 95 % bounds. The filter's is of
    landmarks, ideally 1; the graph's is of contours against wheels, which it takes for worse than they are.
``fnr``, ``fnr_median``; ``fnr_walls``, ``fnr_walls_median``
    False-negative rate f/(f+o) of corners and of walls: weighted by chances, and the median over the landmarks.
``landmarks.corners``, ``landmarks.walls``; ``per_scan.corners``, ``.walls``, ``.matched``
    Size of the final map; what one scan gave on average.
``seconds``, ``scans_per_second``
    Time per stage; scans over their sum.
``back_end``, ``loops``, ``quality``
    What estimated it, how many loops were closed, and the mean quality of the contour matching.
``relations``, ``online_relations``, ``odometry_relations``
    Relation metric, if given, of the trajectory, of the poses known at the time and of raw odometry: ``.count``,
    ``.outside`` (those beyond the ends of the trajectory), ``.translation.mean``, ``.sd``, ``.median``, ``.max``;
    ``.rotation`` likewise.
``cramer_rao.scan``, ``cramer_rao.filtered``: ``.x``, ``.y``, ``.theta``
    Bound of localisation in the known room, RMS over the run, if given.
``detection.precision``, ``.recall``, ``.repeatability``, ``.mean_error``, ``.rms_error``, ``.raw_*_error``
    Corners against the true ones, if given; errors of the refined and of the raw positions.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from contourslam.errors import MissingExtraError
from contourslam.evaluation.consistency import average_nees, average_nis, inside_sigmas, mean_nis, nees
from contourslam.evaluation.cramer_rao import CramerRaoBound
from contourslam.evaluation.detection import DetectionScore
from contourslam.evaluation.errors import align_first, pose_errors, rmse
from contourslam.evaluation.false_negatives import false_negatives
from contourslam.evaluation.relations import JudgedRelations, RelationErrors
from contourslam.evaluation.timing import timing
from contourslam.evaluation.trajectory import absolute_error, relative_error
from contourslam.slam.result import RunResult

Metrics = dict[str, Any]
Floats = NDArray[np.float64]
T = TypeVar("T")


def run_metrics(
    result: RunResult,
    *,
    aligned: bool = False,
    relations: JudgedRelations | None = None,
    bound: CramerRaoBound | None = None,
    detection: DetectionScore | None = None,
) -> Metrics:
    """Everything measured about one run, by the schema of this module.

    Parameters
    ----------
    result : RunResult
    aligned : bool
        Take the errors against truth after moving estimate and odometry so that their first pose is the true one: for
        recordings whose truth is given in another frame.
    relations : JudgedRelations, optional
    bound : CramerRaoBound, optional
    detection : DetectionScore, optional

    Returns
    -------
    dict
        Plain numbers, strings, lists and None: ``json.dumps`` takes it.
    """
    times = timing(result)
    corners, walls = false_negatives(result.corner_map), false_negatives(result.wall_map)
    nis = _optional(lambda: average_nis(result.nis, result.nis_dof))
    metrics: Metrics = {
        "detector": result.detector,
        "back_end": result.back_end,
        "scans": len(result.stamps),
        "complete": result.complete,
        "skipped": dict(result.skipped),
        **_against_truth(result, aligned),
        "nis": mean_nis(result.nis, result.nis_dof),
        "nis_inside": nis and nis.inside,
        "fnr": corners.mean,
        "fnr_median": corners.median,
        "fnr_walls": walls.mean,
        "fnr_walls_median": walls.median,
        "landmarks": {"corners": corners.count, "walls": walls.count},
        "per_scan": {
            "corners": _mean(result.corner_count),
            "walls": _mean(result.wall_count),
            "matched": _mean(result.matched_count),
        },
        "loops": len(result.loops),
        "quality": None if result.quality is None else _mean(result.quality),
        "seconds": times.seconds,
        "scans_per_second": times.scans_per_second,
    }
    if relations is not None:
        metrics["relations"] = _relations(relations.estimate)
        if relations.online is not None:
            metrics["online_relations"] = _relations(relations.online)
        metrics["odometry_relations"] = _relations(relations.odometry)
    if bound is not None:
        metrics["cramer_rao"] = {"scan": _coordinates(bound.scan_rms), "filtered": _coordinates(bound.filtered_rms)}
    if detection is not None:
        names = ["precision", "recall", "repeatability", "mean_error", "rms_error", "raw_mean_error", "raw_rms_error"]
        metrics["detection"] = {name: getattr(detection, name) for name in names}
    cleaned: Metrics = _clean(metrics)
    return cleaned


def aggregate(runs: Sequence[Metrics]) -> Metrics:
    """Mean and standard deviation over runs (seeds), key by key.

    Parameters
    ----------
    runs : sequence of dict
        As :func:`run_metrics` gives them.

    Returns
    -------
    dict
        The same keys; each number becomes ``{"mean": .., "sd": .., "n": ..}``, n being the runs in which it is known
        and sd the sample standard deviation (None for fewer than two). A truth value becomes true if it is in every
        run; a text stays where all runs agree. What no run knows, or the runs' texts disagree on, is None.
    """
    keys = dict.fromkeys(key for run in runs for key in run)
    return {key: _merge([run[key] for run in runs if run.get(key) is not None]) for key in keys}


def _merge(known: list[Any]) -> Any:
    if not known:
        return None
    if isinstance(known[0], dict):
        return aggregate(known)
    if isinstance(known[0], bool):
        return all(known)
    if isinstance(known[0], str):
        return known[0] if len(set(known)) == 1 else None
    sd = float(np.std(known, ddof=1)) if len(known) > 1 else None
    return {"mean": float(np.mean(known)), "sd": sd, "n": len(known)}


def _against_truth(result: RunResult, aligned: bool) -> Metrics:
    names = ("rmse", "online_rmse", "odometry_rmse", "ate", "rpe", "nees", "nees_inside", "inside_two_sigma")
    if result.truth is None or not np.isfinite(result.truth).any():
        return dict.fromkeys(names)
    poses, odometry, truth, covariances = result.poses, result.odometry, result.truth, result.covariances
    online = result.online_poses
    if aligned:
        moved = align_first(poses, truth)
        covariances = _turned(covariances, moved[0, 2] - poses[0, 2])
        poses, odometry = moved, align_first(odometry, truth)
        online = None if online is None else align_first(online, truth)
    errors = pose_errors(poses, truth)
    values = nees(errors, covariances)
    average = _optional(lambda: average_nees(values))
    return {
        "rmse": asdict(rmse(poses, truth)),
        "online_rmse": None if online is None else asdict(rmse(online, truth)),
        "odometry_rmse": asdict(rmse(odometry, truth)),
        "ate": _optional(lambda: _absolute(poses, truth)),
        "rpe": _optional(lambda: _relative(poses, truth)),
        "nees": _mean(values),
        "nees_inside": average and average.inside,
        "inside_two_sigma": _coordinates(inside_sigmas(errors, covariances)),
    }


def _turned(covariances: Floats, angle: float) -> Floats:
    rotation = np.eye(3)
    rotation[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    return np.asarray(rotation @ covariances @ rotation.T)


def _absolute(poses: Floats, truth: Floats) -> Metrics:
    error = absolute_error(poses, truth)
    aligned = absolute_error(poses, truth, aligned=True)
    return {
        **_summary(error.translation),
        "rotation_rmse": error.rotation.rmse,
        "aligned_rmse": aligned.translation.rmse,
    }


def _relative(poses: Floats, truth: Floats) -> Metrics:
    error = relative_error(poses, truth)
    return {**_summary(error.translation), "rotation_rmse": error.rotation.rmse}


def _summary(errors: Any) -> Metrics:
    return {name: getattr(errors, name) for name in ("rmse", "mean", "median", "max")}


def _relations(errors: RelationErrors) -> Metrics:
    return {
        "count": len(errors.translation),
        "outside": errors.outside,
        "translation": asdict(errors.translation_summary),
        "rotation": asdict(errors.rotation_summary),
    }


def _coordinates(values: Floats) -> Metrics:
    return dict(zip(("x", "y", "theta"), values.tolist(), strict=True))


def _mean(values: NDArray[Any]) -> float | None:
    known = values[np.isfinite(values)]
    return float(known.mean()) if len(known) else None


def _optional(measure: Callable[[], T]) -> T | None:
    """A core install has neither evo nor scipy: its runs are reported without what they measure."""
    try:
        return measure()
    except MissingExtraError:
        return None


def _clean(value: Any) -> Any:
    """Replace NaN and infinity, which JSON does not have, by None."""
    if isinstance(value, dict):
        return {key: _clean(item) for key, item in value.items()}
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
