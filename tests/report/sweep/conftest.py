"""Rows as a sweep leaves them, made up: four detectors' errors whose truth is known."""

import json
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest

Rows = Callable[..., list[dict[str, Any]]]
ROOMS = ("furnished_room", "office_corridor")
DETECTORS = ("matched_filter", "wu", "teh_chin", "curvature_scale_space")
STAR = (*((noise, 500) for noise in (0.0, 0.01, 0.02)), (0.01, 180), (0.01, 1000))


def _rows(
    factors: Sequence[float] = (1.0, 1.0, 1.0, 1.0),
    *,
    seeds: int = 12,
    rooms: Sequence[str] = ROOMS,
    conditions: Sequence[tuple[float, int]] = STAR,
    setting: str = "corners",
    failed: Sequence[tuple[str, int]] = (),
) -> list[dict[str, Any]]:
    """One row a run; a detector's errors are larger by its factor, and its runs of the seeds in `failed` failed."""
    rng = np.random.default_rng(4)
    rows = []
    for room in rooms:
        for seed in range(seeds):
            drive = 0.01 * np.exp(0.4 * rng.normal())
            for noise, beams in conditions:
                for name, factor in zip(DETECTORS, factors, strict=True):
                    error = factor * drive * (1.0 + 50.0 * noise) * np.exp(0.05 * rng.normal())
                    row = {
                        "key": f"{len(rows):032x}", "source": "simulation", "status": "done", "room": room,
                        "seed": seed, "lidar": "paper", "noise": noise, "beams": beams, "duration": 60.0, "speed": 0.4,
                        "setting": setting, "detector": name, "version": "0.1.0+abc", "python": "3.11.7",
                        "libraries": json.dumps({"numpy": "2.0"}), "error": None, "error_type": None,
                        "rmse.x": 0.6 * error, "rmse.y": 0.8 * error, "rmse.theta": 0.2 * error, "fnr": 0.05,
                        "odometry_rmse.x": 0.3, "odometry_rmse.y": 0.4, "odometry_rmse.theta": 0.05,
                        "detection.mean_error": 0.01, "nees": 3.0, "scans_per_second": 2000.0,
                    }  # fmt: skip
                    if (name, seed) in failed:
                        row |= {"status": "failed", "error_type": "MemoryError", "error": "no memory\nleft"}
                        row = {key: value for key, value in row.items() if "rmse" not in key}
                    rows.append(row)
    return rows


@pytest.fixture(scope="session")
def sweep_rows() -> Rows:
    return _rows


@pytest.fixture(scope="session")
def log_rows() -> list[dict[str, Any]]:
    """Two recordings, the second of which could not be read."""
    common = {"source": "recording", "room": None, "seed": None, "noise": None, "beams": None, "setting": "graph"}
    good = {
        "status": "done", "recording": "intel", "relations.translation.mean": 0.016, "relations.rotation.mean": 0.006,
        "odometry_relations.translation.mean": 7.37, "odometry_relations.rotation.mean": 0.7, "scans_per_second": 900.0,
    }  # fmt: skip
    bad = {
        "status": "failed",
        "recording": "mit",
        "error_type": "RecordingError",
        "error": "mit: <b>cannot</b> be read",
    }
    return [common | row | {"detector": name} for row in (good, bad) for name in DETECTORS[:2]]
