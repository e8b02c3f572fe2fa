"""The folder a run leaves behind: trajectory, map, metrics and the configuration that was really used."""

import dataclasses
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contourslam import __version__
from contourslam.atomic import make_folder, remove, write_text
from contourslam.config import Config
from contourslam.errors import RecordingError, ResultError
from contourslam.nearest import near_file, unreadable
from contourslam.recordings.trajectories import read_trajectory, write_trajectory
from contourslam.report.loop_table import read_loop_table, write_loop_table
from contourslam.report.map_files import write_geojson
from contourslam.report.map_reader import read_geojson
from contourslam.report.nav2_map import write_nav2_map
from contourslam.report.occupancy import OccupancyGrid
from contourslam.report.scan_table import read_scan_table, write_scan_table
from contourslam.report.svg.way import map_drawing
from contourslam.settings_file import read_settings, write_settings
from contourslam.slam.dense import dense_trajectory
from contourslam.slam.result import OdometryReadings, RunResult

ONLINE = "trajectory_online.tum"
ODOMETRY = "odometry.tum"
LOOPS = "loops.csv"


@dataclass(frozen=True, slots=True)
class StoredRun:
    """A result folder, read back.

    Attributes
    ----------
    result : RunResult
        The run; its map's positions are rounded to 0.1 mm.
    config : Config
        The configuration it really used.
    metrics : dict
        ``metrics.json`` as it stands.
    """

    result: RunResult
    config: Config
    metrics: dict[str, Any]


def to_json(values: dict[str, Any]) -> str:
    """Give a dictionary as JSON; a number that is not finite becomes null, which JSON can hold."""

    def plain(value: Any) -> Any:
        if isinstance(value, dict):
            return {str(key): plain(entry) for key, entry in value.items()}
        if isinstance(value, np.ndarray | np.generic):
            return plain(value.tolist())
        if isinstance(value, list | tuple):
            return [plain(entry) for entry in value]
        return None if isinstance(value, float) and not np.isfinite(value) else value

    return json.dumps(plain(values), indent=2, allow_nan=False) + "\n"


def write_result_folder(
    folder: Path,
    result: RunResult,
    config: Config,
    metrics: dict[str, Any],
    *,
    grid: OccupancyGrid | None = None,
    command: str = "",
) -> None:
    """Write what a run leaves behind; files of the same names are replaced, others are left alone.

    The trajectories hold a pose at each scan and at each odometry reading (:mod:`contourslam.slam.dense`).
    ``trajectory_online.tum``, ``odometry.tum`` and ``loops.csv`` are there only where the run has online poses,
    odometry readings and loops.

    Parameters
    ----------
    folder : Path
        Made where needed.
    result : RunResult
        The run, complete or not.
    config : Config
        The configuration it really used.
    metrics : dict
        What was measured; run, detector, timings and completeness are added to it.
    grid : OccupancyGrid, optional
        Written as ``map.pgm`` and ``map.yaml`` where given.
    command : str
        The command line, kept with the configuration.

    Raises
    ------
    ResultError
        If a file cannot be written.
    """
    make_folder(folder)
    write_trajectory(folder / "trajectory.tum", *dense_trajectory(result))
    write_scan_table(folder / "scans.csv", result)
    write_geojson(folder / "map.geojson", result.corner_map, result.wall_map)
    if result.online_poses is None:
        remove(folder / ONLINE)  # an earlier run's would not belong to this one
    else:
        write_trajectory(folder / ONLINE, *dense_trajectory(result, online=True))
    if result.readings is None:
        remove(folder / ODOMETRY)
    else:
        write_trajectory(folder / ODOMETRY, result.readings.stamps, result.readings.poses)
    if result.loops:
        write_loop_table(folder / LOOPS, result.loops)
    else:
        remove(folder / LOOPS)
    write_settings(folder / "config.yaml", config, header=f"contourslam {__version__}\n{command}".strip())
    if grid is not None:
        write_nav2_map(folder, grid)
    run = {
        "contourslam": __version__,
        "command": command,
        "complete": result.complete,
        "detector": result.detector,
        "back_end": result.back_end,
        "scans": len(result.stamps),
        "corners": len(result.corner_map.ids),
        "walls": len(result.wall_map.ids),
        "seconds": result.seconds,
        "skipped": result.skipped,
    }
    write_text(folder / "metrics.json", to_json({**run, **metrics}))
    write_text(folder / "map.svg", map_drawing(result).text)


def read_result_folder(folder: Path) -> StoredRun:
    """Read a folder written by :func:`write_result_folder`.

    Raises
    ------
    ResultError
        If a file is missing or damaged; the message names it.
    ConfigError
        If ``config.yaml`` is.
    """
    if not folder.is_dir():
        raise ResultError(
            f"{folder}: there is no such result folder{near_file(folder)}; "
            f"`contourslam run RECORDING -o {folder}` writes one"
        )
    metrics = read_metrics(folder / "metrics.json")
    corners, walls = read_geojson(folder / "map.geojson")
    scans, readings_before = read_scan_table(folder / "scans.csv")
    result = dataclasses.replace(
        scans,
        detector=str(metrics.get("detector", "")),
        corner_map=corners,
        wall_map=walls,
        seconds=dict(metrics.get("seconds") or {}),
        skipped=dict(metrics.get("skipped") or {}),
        complete=metrics.get("complete") is True,
        back_end=str(metrics.get("back_end", "ekf")),  # the only one there was before it was written down
        online_poses=_online_poses(folder / ONLINE, scans),
        loops=read_loop_table(folder / LOOPS),
        readings=None if readings_before is None else _readings(folder / ODOMETRY, readings_before),
    )
    return StoredRun(result, read_settings(folder / "config.yaml", Config), metrics)


def _online_poses(path: Path, scans: RunResult) -> NDArray[np.float64] | None:
    """Give the online poses; a folder of before they stood in the table of scans has them in a file only."""
    if scans.online_poses is not None or not path.exists():
        return scans.online_poses
    _, poses = _trajectory(path)
    if len(poses) != len(scans.stamps):
        raise ResultError(
            f"{path}: holds {len(poses)} poses where scans.csv holds {len(scans.stamps)} scans; run it again"
        )
    return poses


def _readings(path: Path, before: NDArray[np.float64]) -> OdometryReadings:
    stamps, poses = _trajectory(path)
    if not ((np.diff(before) >= 0).all() and (before >= 0).all() and (before <= len(stamps)).all()):
        raise ResultError(f"{path}: holds {len(stamps)} readings, which scans.csv contradicts; run it again")
    return OdometryReadings(stamps, poses, np.searchsorted(before, np.arange(len(stamps)), side="right"))


def _trajectory(path: Path) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    try:
        return read_trajectory(path)
    except RecordingError as error:
        raise ResultError(str(error)) from error


def read_metrics(path: Path) -> dict[str, Any]:
    """Read a ``metrics.json``.

    Raises
    ------
    ResultError
        If the file is missing or is not a JSON object.
    """
    try:
        metrics = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ResultError(f"{unreadable(path, error)}; is it in a folder that run wrote?") from error
    except (ValueError, RecursionError) as error:
        raise ResultError(f"{path}: is not valid JSON ({error})") from error
    if not isinstance(metrics, dict):
        raise ResultError(f"{path}: must hold a JSON object of metrics")
    return metrics
