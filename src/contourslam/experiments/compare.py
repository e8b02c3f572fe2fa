"""The paper's experiment: one run through a furnished room, recorded once, replayed once per detector; over seeds."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from contourslam.config import Config
from contourslam.detectors import DETECTORS
from contourslam.evaluation.consistency import AverageNees, average_nees, nees
from contourslam.evaluation.errors import pose_errors
from contourslam.evaluation.metrics import Metrics, aggregate, run_metrics
from contourslam.experiments.known_room import localisation_bound, told
from contourslam.experiments.parallel import Observer, Step, each
from contourslam.experiments.replays import MODES, Mode, Variant, replay_each, variants
from contourslam.recordings import open_recording, write_recording
from contourslam.recordings.recording import Message
from contourslam.simulation.config import SimulationConfig
from contourslam.simulation.room import Room
from contourslam.simulation.simulate import SimulatedRun, simulate
from contourslam.slam.result import RunResult

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class SeedRuns:
    """All replays of the run of one seed.

    Attributes
    ----------
    seed : int
    metrics : dict of Variant to dict
        As :func:`contourslam.evaluation.metrics.run_metrics` gives them.
    nees : dict of Variant to ndarray, shape (t,)
        Normalised estimation error squared of the pose at each scan.
    results : dict of Variant to RunResult
        The runs themselves, where they were asked for.
    """

    seed: int
    metrics: dict[Variant, Metrics] = field(default_factory=dict)
    nees: dict[Variant, Floats] = field(default_factory=dict)
    results: dict[Variant, RunResult] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Comparison:
    """The comparison's outcome.

    Attributes
    ----------
    room : Room
    detectors : tuple of str
    config : Config
        What every replay used, but for detector and walls.
    simulation : SimulationConfig
    seeds : tuple of SeedRuns
        Those begun; the first one holds its `results`.
    complete : bool
        False where it was stopped before every seed and variant was done.
    """

    room: Room
    detectors: tuple[str, ...]
    config: Config
    simulation: SimulationConfig
    seeds: tuple[SeedRuns, ...]
    complete: bool

    def runs(self, detector: str, mode: Mode) -> list[Metrics]:
        """Metrics of one variant, seed by seed; an interrupted run is left out."""
        found = [seed.metrics.get(Variant(detector, mode)) for seed in self.seeds]
        return [metrics for metrics in found if metrics is not None and metrics["complete"]]

    def table(self, mode: Mode) -> dict[str, Metrics]:
        """Mean and standard deviation over the seeds of everything measured, per detector that has a run."""
        runs = {detector: self.runs(detector, mode) for detector in self.detectors}
        return {detector: aggregate(found) for detector, found in runs.items() if found}

    def nees(self, detector: str, mode: Mode) -> AverageNees | None:
        """NEES over time, averaged over the seeds, up to the end of the shortest run; None without a run."""
        found = [seed.nees[Variant(detector, mode)] for seed in self.seeds if Variant(detector, mode) in seed.nees]
        if not found:
            return None
        length = min(map(len, found))
        return average_nees(np.stack([values[:length] for values in found]))

    def first(self, detector: str, mode: Mode) -> RunResult | None:
        """Run of the first seed, for the figures."""
        return self.seeds[0].results.get(Variant(detector, mode)) if self.seeds else None


@dataclass(frozen=True, slots=True)
class _Task:
    room: Room
    seed: int
    variants: tuple[Variant, ...]
    config: Config
    simulation: SimulationConfig
    recording: Path | None
    keep: bool


def compare(
    room: Room,
    seeds: Sequence[int],
    *,
    detectors: Sequence[str] = tuple(DETECTORS),
    config: Config | None = None,
    simulation: SimulationConfig | None = None,
    recording: Path | None = None,
    jobs: int = 1,
    observer: Observer | None = None,
) -> Comparison:
    """Drive through a room once per seed and replay each drive through every detector, corners only and with walls.

    Parameters
    ----------
    room : Room
    seeds : sequence of int
        One simulated drive each.
    detectors : sequence of str
        Keys of ``contourslam.detectors.DETECTORS``.
    config : Config, optional
        What all replays share; the lidar's part is taken from the simulated lidar, as from a data sheet.
    simulation : SimulationConfig, optional
    recording : Path, optional
        Folder to make: the first seed's drive is recorded there as a rosbag2 (MCAP), and replayed from it.
    jobs : int
        Processes to use. Other processes import the main script, which must then start its work under
        ``if __name__ == "__main__":``.
    observer : Observer, optional
        Told of each replay done, and may stop the work early.

    Returns
    -------
    Comparison
        With what was done, also where it was stopped.

    Raises
    ------
    MissingExtraError
        If the simulation's libraries are not installed.
    ResultError
        If the recording cannot be written.
    """
    simulation = simulation or SimulationConfig()
    config = told(config or Config(back_end="ekf"), simulation.measuring_lidar)
    wanted = tuple(variants(detectors))
    tasks = [
        _Task(room, seed, wanted, config, simulation, None if i else recording, keep=i == 0)
        for i, seed in enumerate(seeds)
    ]
    done = []
    for runs in each(_replay_seed, tasks, steps=len(wanted), jobs=jobs, observer=observer):
        done.append(runs)
        if not _whole(runs, wanted):
            break
    complete = len(done) == len(tasks) and all(_whole(runs, wanted) for runs in done)
    return Comparison(room, tuple(detectors), config, simulation, tuple(done), complete)


def _whole(runs: SeedRuns, wanted: Sequence[Variant]) -> bool:
    return all(variant in runs.metrics and runs.metrics[variant]["complete"] for variant in wanted)


def _replay_seed(task: _Task, step: Step) -> SeedRuns:
    run = simulate(task.room, task.simulation, task.seed)
    bound = localisation_bound(run, task.config)
    outcome = SeedRuns(task.seed)
    messages = _recorded(run, task.recording) if task.recording else list(run.messages())
    for variant, result in replay_each(
        messages,
        task.variants,
        task.config,
        lidar_mount=run.lidar_mount,
        step=step,
    ):
        outcome.metrics[variant] = run_metrics(result, bound=bound)
        if result.truth is not None:
            outcome.nees[variant] = nees(pose_errors(result.poses, result.truth), result.covariances)
        if task.keep:
            outcome.results[variant] = result
    return outcome


def _recorded(run: SimulatedRun, path: Path) -> list[Message]:
    """Record a run and read it back: what is replayed is what the file holds."""
    x, y, yaw = run.lidar_mount.tolist()
    write_recording(path, run.messages(), lidar_mount=(x, y, yaw))
    return list(open_recording(path).messages())


__all__ = ["MODES", "Comparison", "SeedRuns", "compare"]
