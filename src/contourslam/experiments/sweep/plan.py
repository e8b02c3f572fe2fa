"""From an experiment to its runs: every combination of every grid, each once."""

import itertools
from collections.abc import Iterator
from dataclasses import asdict, replace
from functools import lru_cache
from pathlib import PurePosixPath
from typing import Any

from contourslam.config import Config
from contourslam.errors import ConfigError
from contourslam.experiments.known_room import told
from contourslam.experiments.sweep.experiment import Experiment, Grid
from contourslam.experiments.sweep.files import identity, matching, relations_beside
from contourslam.experiments.sweep.own_detector import OwnDetector, find_detector
from contourslam.experiments.sweep.runs import RecordedDrive, Run, SimulatedDrive
from contourslam.settings_file import build
from contourslam.simulation.config import LIDARS, LidarModel


def plan(experiment: Experiment) -> tuple[Run, ...]:
    """List the runs of an experiment, those of one drive side by side.

    Parameters
    ----------
    experiment : Experiment

    Returns
    -------
    tuple of Run
        No two with the same key.

    Raises
    ------
    ConfigError
        If a pattern matches nothing, a detector's file is not as it must be, or a value is refused.
    MissingExtraError
        If a library for the place of a recording is not installed.
    """
    own = {name: _own(experiment, name, place) for name, place in experiment.own_detectors.items()}
    recorded = _recordings(experiment)
    runs: dict[str, Run] = {}
    config = lru_cache(maxsize=None)(lambda lidar, setting: _config(lidar, experiment.settings[setting]))
    for grid in experiment.grids:
        drives: list[SimulatedDrive | RecordedDrive] = []
        drives += [drive for pattern in grid.recordings for drive in recorded[pattern]]
        drives += _simulated(grid)
        for drive in drives:
            lidar = drive.model if isinstance(drive, SimulatedDrive) else None
            for setting, detector in itertools.product(grid.settings, grid.detectors):
                chosen = replace(config(lidar, setting), detector=detector)
                run = Run(drive, detector, own.get(detector), setting, chosen)
                runs.setdefault(run.key, run)
    # A stable sort: what was written first is done first, but what shares a drive stands together.
    order = {drive: i for i, drive in enumerate(dict.fromkeys(run.drive.shared for run in runs.values()))}
    return tuple(sorted(runs.values(), key=lambda run: order[run.drive.shared]))


def _own(experiment: Experiment, name: str, place: str) -> OwnDetector:
    try:
        return find_detector(name, place, experiment.folder)
    except ConfigError as error:
        raise ConfigError(f"own_detectors.{name}: {error}") from error


def _recordings(experiment: Experiment) -> dict[str, list[RecordedDrive]]:
    """Recordings by the pattern that they were found by."""
    patterns = dict.fromkeys(pattern for grid in experiment.grids for pattern in grid.recordings)
    urls = {pattern: matching(pattern, experiment.folder) for pattern in patterns}
    names = _names(list(dict.fromkeys(url for found in urls.values() for url in found)))
    known: dict[str, RecordedDrive] = {}
    for pattern, found in urls.items():
        for url in found:
            if url not in known:
                beside = experiment.relations.get(pattern)
                relations = relations_beside(url) if beside is None else matching(beside, experiment.folder)[0]
                known[url] = RecordedDrive(
                    names[url], url, identity(url), relations, None if relations is None else identity(relations)
                )
    return {pattern: [known[url] for url in found] for pattern, found in urls.items()}


def _names(urls: list[str]) -> dict[str, str]:
    """Call recordings by their file's name up to the first dot, with as many folders before it as tell them apart."""
    parts = {url: PurePosixPath(url.replace("\\", "/")).parts for url in urls}
    names = {url: parts[url][-1].partition(".")[0] or parts[url][-1] for url in urls}
    depth = 1
    while len(set(names.values())) < len(urls) and depth < max(map(len, parts.values())):
        depth += 1
        names = {url: "/".join(parts[url][-depth:]) for url in urls}
    return names


def _simulated(grid: Grid) -> Iterator[SimulatedDrive]:
    axes = (grid.rooms, grid.seeds, grid.speed, grid.duration, grid.lidar, grid.beams, grid.noise)
    for room, seed, speed, duration, name, beams, noise in itertools.product(*axes):
        # What is not said is the lidar's own, written down where that is one number: so two grids can share runs.
        lidar = LIDARS[name]
        if beams is None and not lidar.turn_rate_wobble:
            beams = round(lidar.samples_per_second / lidar.turn_rate)
        if noise is None and not lidar.sigma_relative:
            noise = lidar.sigma_range
        yield SimulatedDrive(room, seed, name, noise, beams, duration, speed)


def _config(lidar: LidarModel | None, overrides: dict[str, Any]) -> Config:
    """Defaults, what a simulated lidar's data sheet says, then what the setting says."""
    base = Config() if lidar is None else told(Config(), lidar)
    return build(Config, _merged(asdict(base), overrides))


def _merged(below: dict[str, Any], above: dict[str, Any]) -> dict[str, Any]:
    """Nested names and values, those of `above` in place of those of `below`."""
    merged = dict(below)
    for name, value in above.items():
        inner = below.get(name)
        merged[name] = _merged(inner, value) if isinstance(inner, dict) and isinstance(value, dict) else value
    return merged
