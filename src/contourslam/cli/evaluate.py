"""``contourslam evaluate``: a result folder judged, again or by something new."""

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import tyro

from contourslam.cli.console import print_json
from contourslam.cli.options import Json
from contourslam.errors import RecordingError, ResultError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from contourslam.slam.result import RunResult

    Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Evaluate:
    """Judge a result folder by true poses or by known relative poses; two folders or more are compared side by side.

    Where the run has been refined at its end, the figures of the poses as known at the time stand beside it (online).
    Truth that the recording held is used by itself. metrics.json is left as it is; --json prints the new figures.

    Example: contourslam evaluate out/intel --relations intel.relations.xz
    """

    folders: tyro.conf.Positional[tuple[Path, ...]]
    """Folders that `contourslam run` wrote."""
    truth: Path | None = None
    """True trajectory: rows t x y z qx qy qz qw (TUM) or t x y theta; moved so that the first poses agree."""
    relations: Path | None = None
    """Known relative poses: rows t1 t2 dx dy dz roll pitch yaw."""
    json: Json = False

    def execute(self, command: str) -> int:
        """Print the figures of each folder."""
        metrics = {str(folder): self._measure(folder) for folder in self.folders}
        if self.json:
            print_json(metrics)
        else:
            _print_table(metrics)
        return 0

    def _measure(self, folder: Path) -> dict[str, Any]:
        from contourslam.evaluation.metrics import run_metrics
        from contourslam.evaluation.relations import judge
        from contourslam.recordings import read_relations
        from contourslam.report.result_folder import read_result_folder

        result = read_result_folder(folder).result
        if self.truth is not None:
            result = _with_truth(result, self.truth)
        judged = None
        if self.relations is not None:
            stamps, poses = read_relations(self.relations)
            if stamps.max() < result.stamps.min() or stamps.min() > result.stamps.max():
                raise _no_overlap(self.relations, stamps, result)
            if len(result.stamps) < 2:
                raise ResultError(f"{folder}: holds a single scan, which no relation can judge; run more of them")
            judged = judge(result, stamps, poses)
        return run_metrics(result, aligned=self.truth is not None, relations=judged)


def _with_truth(result: "RunResult", path: Path) -> "RunResult":
    """Give the run the true poses of a file, at the times of its scans."""
    import numpy as np

    from contourslam.geometry.poses import interpolate
    from contourslam.recordings import read_trajectory

    stamps, poses = read_trajectory(path)
    order = np.argsort(stamps, kind="stable")
    truth = interpolate(stamps[order], poses[order], result.stamps)
    truth[(result.stamps < stamps.min()) | (result.stamps > stamps.max())] = np.nan
    if not np.isfinite(truth).any():
        raise _no_overlap(path, stamps, result)
    return replace(result, truth=truth)


def _no_overlap(path: Path, stamps: "Floats", result: "RunResult") -> RecordingError:
    return RecordingError(
        f"{path}: its stamps, {stamps.min():.3f} to {stamps.max():.3f} s, do not overlap those of the run, "
        f"{result.stamps.min():.3f} to {result.stamps.max():.3f} s; do both use the same clock?"
    )


# What is printed: title, unit, and where it stands in the metrics; rad are printed in degrees where the unit says so.
_ROWS = (
    ("back end", "", ("back_end",)),
    ("RMSE x", "m", ("rmse", "x")),
    ("RMSE y", "m", ("rmse", "y")),
    ("RMSE heading", "rad", ("rmse", "theta")),
    ("absolute trajectory error, RMS", "m", ("ate", "rmse")),
    ("relative trajectory error, RMS per m", "m", ("rpe", "rmse")),
    ("pose NEES (ideal 3)", "", ("nees",)),
    ("NIS per degree of freedom (ideal 1)", "", ("nis",)),
    ("relation error, mean", "m", ("relations", "translation", "mean")),
    ("relation error, median", "m", ("relations", "translation", "median")),
    ("relation error, rotation, mean", "deg", ("relations", "rotation", "mean")),
    ("online relation error, mean", "m", ("online_relations", "translation", "mean")),
    ("online relation error, median", "m", ("online_relations", "translation", "median")),
    ("online relation error, rotation, mean", "deg", ("online_relations", "rotation", "mean")),
    ("raw odometry's relation error, mean", "m", ("odometry_relations", "translation", "mean")),
    ("raw odometry's rel. error, rotation, mean", "deg", ("odometry_relations", "rotation", "mean")),
    ("loops closed", "", ("loops",)),
    ("quality of the contour matching", "", ("quality",)),
    ("false-negative rate of corners", "", ("fnr",)),
    ("false-negative rate of walls", "", ("fnr_walls",)),
    ("corners in the map", "", ("landmarks", "corners")),
    ("walls in the map", "", ("landmarks", "walls")),
    ("scans", "", ("scans",)),
    ("scans per second", "1/s", ("scans_per_second",)),
)


def _print_table(metrics: dict[str, dict[str, Any]]) -> None:
    """Print a row per figure that some folder has, a column per folder."""
    width = max(12, *(len(name) for name in metrics))
    print(" " * 48 + "".join(f"{name:>{width + 2}}" for name in metrics))
    for title, unit, keys in _ROWS:
        cells = [_cell(run, keys, in_degrees=unit == "deg") for run in metrics.values()]
        if any(cells):
            print(
                f"{title + (f', {unit}' if unit else ''):<48}"
                + "".join(f"{cell or '-':>{width + 2}}" for cell in cells)
            )


def _cell(run: dict[str, Any], keys: tuple[str, ...], *, in_degrees: bool) -> str:
    value: Any = run
    for key in keys:
        value = value.get(key) if isinstance(value, dict) else None
    if value is None:
        return ""
    if isinstance(value, int | str):
        return str(value)
    return f"{math.degrees(value) if in_degrees else value:.4g}"
