"""One run measured under several settings, each setting through every detector."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from contourslam.config import Config
from contourslam.evaluation.metrics import Metrics, run_metrics
from contourslam.experiments.parallel import Observer, Step, each
from contourslam.experiments.replays import Mode, Variant, replay_each
from contourslam.simulation.simulate import SimulatedRun


@dataclass(frozen=True, slots=True)
class Setting:
    """What is replayed: the run as it was measured, and the configuration of the pipeline."""

    run: SimulatedRun
    config: Config


@dataclass(frozen=True, slots=True)
class _Task:
    setting: Setting
    variants: tuple[Variant, ...]


def measure(
    settings: Sequence[Setting],
    detectors: Sequence[str],
    *,
    mode: Mode = "corners",
    jobs: int = 1,
    observer: Observer | None = None,
) -> tuple[list[dict[str, Metrics]], bool]:
    """Replay each setting through each detector.

    Parameters
    ----------
    settings : sequence of Setting
    detectors : sequence of str
    mode : "corners" or "walls"
    jobs : int
        Processes to use.
    observer : Observer, optional

    Returns
    -------
    metrics : list of dict of str to dict
        Per setting begun, metrics per detector whose replay was completed.
    complete : bool
        False where the work was stopped early.
    """
    wanted = tuple(Variant(detector, mode) for detector in detectors)
    # The ideal scans are most of a run's weight, and a replay needs only the measured ones.
    tasks = [_Task(replace(setting, run=replace(setting.run, ideal_scans=())), wanted) for setting in settings]
    done = []
    for metrics in each(_replay, tasks, steps=len(wanted), jobs=jobs, observer=observer):
        done.append(metrics)
        if len(metrics) < len(wanted):
            break
    complete = len(done) == len(tasks) and all(len(metrics) == len(wanted) for metrics in done)
    return done, complete


def _replay(task: _Task, step: Step) -> dict[str, Metrics]:
    run = task.setting.run
    replays = replay_each(
        list(run.messages()),
        task.variants,
        task.setting.config,
        lidar_mount=run.lidar_mount,
        step=step,
    )
    return {variant.detector: run_metrics(result) for variant, result in replays if result.complete}
