"""Everything the report shows: the comparison over seeds, and on one drive noise, refinement and adaptations."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from contourslam.config import Config
from contourslam.detectors import DETECTORS
from contourslam.experiments.adaptation import Adaptation, adaptation
from contourslam.experiments.compare import Comparison, compare
from contourslam.experiments.noise import LEVELS, NoiseSweep, noise_sweep
from contourslam.experiments.parallel import Observer
from contourslam.experiments.refinement import Refinement, refinement
from contourslam.simulation.config import SimulationConfig
from contourslam.simulation.room import Room
from contourslam.simulation.simulate import simulate


@dataclass(frozen=True, slots=True)
class Study:
    """The experiments of one report; those left out, or never reached, are None."""

    comparison: Comparison
    noise: NoiseSweep | None = None
    refinement: Refinement | None = None
    adaptation: Adaptation | None = None
    complete: bool = True


def study(
    room: Room,
    seeds: Sequence[int],
    *,
    detectors: Sequence[str] = tuple(DETECTORS),
    config: Config | None = None,
    simulation: SimulationConfig | None = None,
    noise_levels: Sequence[float] = LEVELS,
    details: bool = True,
    recording: Path | None = None,
    jobs: int = 1,
    observe: Callable[[str], Observer] = lambda stage: Observer(),
) -> Study:
    """Run the comparison over seeds, then the further experiments on the drive of the first seed.

    Parameters
    ----------
    room, seeds, detectors, config, simulation, recording, jobs
        As :func:`contourslam.experiments.compare.compare`.
    noise_levels : sequence of float
        Standard deviations of a range for the noise sweep, m; none leaves the sweep out.
    details : bool
        Also hold raw against refined corners, and each detector as its source has it against the adapted one.
    observe : callable
        Gives the observer of a stage by its name.

    Returns
    -------
    Study
        With what was done, also where it was stopped.

    Raises
    ------
    MissingExtraError, ResultError
        As :func:`contourslam.experiments.compare.compare`.
    """
    observer = observe("comparison")
    comparison = compare(
        room,
        seeds,
        detectors=detectors,
        config=config,
        simulation=simulation,
        recording=recording,
        jobs=jobs,
        observer=observer,
    )
    if not comparison.complete or not (noise_levels or details):
        return Study(comparison, complete=comparison.complete)
    run = simulate(room, comparison.simulation, seeds[0])
    sweep = refined = adapted = None
    if noise_levels:
        sweep = noise_sweep(
            run, noise_levels, detectors=detectors, config=config, jobs=jobs, observer=observe("noise sweep")
        )
    if details and (sweep is None or sweep.complete):
        refined = refinement(run, detectors=detectors, config=config, jobs=jobs, observer=observe("refinement"))
        if refined.complete:
            adapted = adaptation(run, detectors=detectors, config=config, jobs=jobs, observer=observe("adaptation"))
    parts = [part for part in (sweep, refined, adapted) if part is not None]
    reached = adapted is not None or not details
    return Study(comparison, sweep, refined, adapted, reached and all(part.complete for part in parts))
