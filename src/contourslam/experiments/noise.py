"""Error against the lidar's noise: the same drive, measured ever more poorly."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contourslam.config import Config
from contourslam.detectors import DETECTORS
from contourslam.evaluation.metrics import Metrics
from contourslam.experiments.known_room import told
from contourslam.experiments.parallel import Observer
from contourslam.experiments.replays import Mode
from contourslam.experiments.settings import Setting, measure
from contourslam.simulation.simulate import SimulatedRun

Floats = NDArray[np.float64]

LEVELS = (0.0, 0.01, 0.02, 0.03, 0.04, 0.05)
"""Standard deviations of a range, m."""


@dataclass(frozen=True, slots=True)
class NoiseSweep:
    """Error per noise level and detector.

    Attributes
    ----------
    levels : ndarray, shape (n,)
        Standard deviation of every range at the levels done, m.
    metrics : tuple of dict of str to dict, length n
        Metrics per detector at each level.
    complete : bool
        False where the sweep was stopped early.
    """

    levels: Floats
    metrics: tuple[dict[str, Metrics], ...]
    complete: bool

    def rmse(self, detector: str) -> Floats:
        """RMSE of x (m), y (m) and heading (rad) per level, shape (n, 3); NaN where there is no run."""
        rows = [(found.get(detector) or {}).get("rmse") or {} for found in self.metrics]
        return np.array([[row.get(name, np.nan) for name in ("x", "y", "theta")] for row in rows]).reshape(-1, 3)


def noise_sweep(
    run: SimulatedRun,
    levels: Sequence[float] = LEVELS,
    *,
    detectors: Sequence[str] = tuple(DETECTORS),
    config: Config | None = None,
    mode: Mode = "corners",
    jobs: int = 1,
    observer: Observer | None = None,
) -> NoiseSweep:
    """Measure one drive again at each noise level, and replay it through each detector.

    The pipeline is told each level, as from the lidar's data sheet; the noise is the same, scaled.

    Parameters
    ----------
    run : SimulatedRun
    levels : sequence of float
        Standard deviations of a range, m.
    detectors : sequence of str
    config : Config, optional
    mode : "corners" or "walls"
    jobs : int
        Processes to use.
    observer : Observer, optional

    Returns
    -------
    NoiseSweep
    """
    measured = [run.with_noise(sigma) for sigma in levels]
    settings = [Setting(noisy, told(config or Config(), noisy.lidar)) for noisy in measured]
    metrics, complete = measure(settings, detectors, mode=mode, jobs=jobs, observer=observer)
    return NoiseSweep(np.array(levels[: len(metrics)], dtype=np.float64), tuple(metrics), complete)
