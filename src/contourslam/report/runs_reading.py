"""Result folders read back and judged, by what the run was judged by or by something new."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contourslam.config import Config
from contourslam.errors import ConfigError, RecordingError, ResultError
from contourslam.evaluation.errors import pose_errors
from contourslam.evaluation.metrics import run_metrics
from contourslam.evaluation.relations import JudgedRelations, judge
from contourslam.geometry.poses import interpolate
from contourslam.recordings import read_relations, read_trajectory
from contourslam.report.relation_table import RELATIONS, read_relation_table
from contourslam.report.result_folder import StoredRun, read_result_folder
from contourslam.slam.result import RunResult

Floats = NDArray[np.float64]

NEEDED = ("metrics.json", "config.yaml", "scans.csv", "map.geojson")
"""Files without which a folder tells nothing."""


@dataclass(frozen=True, slots=True)
class JudgedRun:
    """A result folder with what it is judged by.

    Attributes
    ----------
    name : str
        Short, and no other run's.
    folder : Path
    result : RunResult
    config : Config
    about : dict
        ``metrics.json`` as it stands.
    metrics : dict
        Of :func:`contourslam.evaluation.metrics.run_metrics`, with "map_kb" and "cpu_seconds".
    relations : JudgedRelations or None
    aligned : bool
        Whether the truth is in another frame, and is compared after the first poses are laid on each other.
    notes : tuple of str
        What the folder lacks, as sentences.
    """

    name: str
    folder: Path
    result: RunResult
    config: Config
    about: dict[str, Any]
    metrics: dict[str, Any]
    relations: JudgedRelations | None
    aligned: bool = False
    notes: tuple[str, ...] = ()

    @property
    def position_errors(self) -> Floats | None:
        """Distance of each pose from the true one, m, NaN where that is not known; None without true poses."""
        result = self.result
        if result.truth is None or not np.isfinite(result.truth).any():
            return None
        return np.asarray(np.hypot(*pose_errors(result.poses, result.truth, aligned=self.aligned)[:, :2].T))

    @property
    def distance(self) -> float:
        """Length of the estimated way, m."""
        return float(np.hypot(*np.diff(self.result.poses[:, :2], axis=0).T).sum())


def read_runs(folders: Sequence[Path], *, truth: Path | None = None, relations: Path | None = None) -> list[JudgedRun]:
    """Read result folders and judge them.

    Parameters
    ----------
    folders : sequence of Path
        As :func:`contourslam.report.result_folder.write_result_folder` wrote them.
    truth : Path, optional
        True trajectory, moved so that the first poses agree; else the truth that the recording held is used.
    relations : Path, optional
        Known relative poses; else the errors are those that the run was judged by, where it was.

    Raises
    ------
    ResultError
        If a folder is no result, or a file of it is missing or damaged; the message names all that is missing.
    ConfigError
        If ``config.yaml`` is damaged or of another version, or a folder is given twice.
    RecordingError
        If truth or relations cannot be read, or do not overlap with a run in time.
    """
    known = None if relations is None else read_relations(relations)
    true = None if truth is None else read_trajectory(truth)
    runs = []
    for name, folder in zip(distinct_names(folders), folders, strict=True):
        stored, notes = _read(folder), []
        result = stored.result
        if truth is not None and true is not None:
            result = replace(result, truth=_truth_at(truth, *true, result))
        if relations is not None and known is not None:
            judged = _judged(folder, result, relations, *known)
        elif (folder / RELATIONS).exists():
            judged = read_relation_table(folder / RELATIONS, stored.metrics)
        else:
            judged = None
            if "relations" in stored.metrics:
                notes.append(
                    f"{name}: was judged by relations, but {RELATIONS} is missing, so that its errors are left out; "
                    "give --relations FILE"
                )
        metrics = run_metrics(result, aligned=truth is not None, relations=judged)
        metrics |= {"map_kb": (folder / "map.geojson").stat().st_size / 1e3}
        metrics |= {"cpu_seconds": sum(result.seconds.values()) or None}
        runs.append(
            JudgedRun(
                name, folder, result, stored.config, stored.metrics, metrics, judged, truth is not None, tuple(notes)
            )
        )
    return runs


def distinct_names(folders: Sequence[Path]) -> list[str]:
    """Name folders by the last parts of their paths, as many as tell them apart.

    Raises
    ------
    ConfigError
        If one is given twice.
    """
    parts = [folder.resolve().parts for folder in folders]
    twice = next((folder for i, folder in enumerate(folders) if parts[i] in parts[:i]), None)
    if twice is not None:
        raise ConfigError(f"{twice} is given twice; name each once")
    names = []
    for own in parts:
        depth = 1
        while sum(other[-depth:] == own[-depth:] for other in parts) > 1:
            depth += 1
        names.append("/".join(own[-depth:]))
    return names


def _read(folder: Path) -> StoredRun:
    missing = [name for name in NEEDED if not (folder / name).is_file()]
    if folder.is_dir() and missing:
        lacking = f"{', '.join(missing)} {'is' if len(missing) == 1 else 'are'} missing"
        if len(missing) == len(NEEDED):
            raise ResultError(
                f"{folder}: is no result folder, {lacking}; `contourslam run RECORDING -o DIR` writes one"
            )
        raise ResultError(
            f"{folder}: {lacking}; the run was cut off, or an older version wrote it: "
            f"map the recording again with `contourslam run RECORDING -o {folder} --overwrite`"
        )
    stored = read_result_folder(folder)
    if not len(stored.result.stamps):
        raise ResultError(f"{folder}: holds no scan; map the recording again with `contourslam run`")
    return stored


def _truth_at(path: Path, stamps: Floats, poses: Floats, result: RunResult) -> Floats:
    """True poses at the times of a run's scans, NaN outside of what is known."""
    order = np.argsort(stamps, kind="stable")
    truth = interpolate(stamps[order], poses[order], result.stamps)
    truth[(result.stamps < stamps.min()) | (result.stamps > stamps.max())] = np.nan
    if not np.isfinite(truth).any():
        raise _no_overlap(path, stamps, result)
    return truth


def _judged(folder: Path, result: RunResult, path: Path, stamps: Floats, poses: Floats) -> JudgedRelations:
    if stamps.max() < result.stamps.min() or stamps.min() > result.stamps.max():
        raise _no_overlap(path, stamps, result)
    if len(result.stamps) < 2:
        raise ResultError(f"{folder}: holds a single scan, which no relation can judge; run more of them")
    return judge(result, stamps, poses)


def _no_overlap(path: Path, stamps: Floats, result: RunResult) -> RecordingError:
    return RecordingError(
        f"{path}: its stamps, {stamps.min():.3f} to {stamps.max():.3f} s, do not overlap those of the run, "
        f"{result.stamps.min():.3f} to {result.stamps.max():.3f} s; do both use the same clock?"
    )
