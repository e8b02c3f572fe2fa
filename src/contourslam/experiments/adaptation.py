"""Each detector as its source has it, against the same with our adaptations to range noise."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from contourslam.config import Config
from contourslam.detectors import DETECTORS
from contourslam.evaluation.metrics import Metrics
from contourslam.experiments.known_room import told
from contourslam.experiments.parallel import Observer
from contourslam.experiments.settings import Setting, measure
from contourslam.simulation.simulate import SimulatedRun


@dataclass(frozen=True, slots=True)
class Adaptation:
    """Metrics per detector: faithful to its source, and adapted; `complete` is false where it was stopped early."""

    faithful: dict[str, Metrics]
    adapted: dict[str, Metrics]
    complete: bool


def adaptation(
    run: SimulatedRun,
    *,
    detectors: Sequence[str] = tuple(DETECTORS),
    config: Config | None = None,
    jobs: int = 1,
    observer: Observer | None = None,
) -> Adaptation:
    """Replay one drive through each detector twice, corners only: as its source has it, and adapted.

    Parameters
    ----------
    run : SimulatedRun
    detectors : sequence of str
    config : Config, optional
    jobs : int
        Processes to use.
    observer : Observer, optional

    Returns
    -------
    Adaptation
    """
    config = told(config or Config(), run.lidar)
    settings = [Setting(run, replace(config, adapted=adapted)) for adapted in (False, True)]
    metrics, complete = measure(settings, detectors, jobs=jobs, observer=observer)
    faithful, adapted = (*metrics, {}, {})[:2]
    return Adaptation(faithful, adapted, complete)
