"""Raw contour vertices against refined corners: how well they lie, and what the filter makes of them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from contourslam.config import Config
from contourslam.detectors import DETECTORS, Detector, make_detector
from contourslam.evaluation.detection import DetectedCorners, DetectionScore, score_detections
from contourslam.evaluation.metrics import Metrics
from contourslam.evaluation.visibility import VisibilityLimits
from contourslam.experiments.known_room import told, true_room
from contourslam.experiments.parallel import Observer
from contourslam.experiments.settings import Setting, measure
from contourslam.geometry.poses import compose
from contourslam.landmarks import find_landmarks, trace
from contourslam.simulation.simulate import SimulatedRun


@dataclass(frozen=True, slots=True)
class Refinement:
    """Raw against refined corners.

    Attributes
    ----------
    raw, refined : dict of str to dict
        Metrics of the run per detector, corners only, with raw vertices and with refined corners.
    scores : dict of str to DetectionScore
        Corners per detector against the true ones: errors of both kinds, precision, recall, repeatability.
    complete : bool
        False where it was stopped early.
    """

    raw: dict[str, Metrics]
    refined: dict[str, Metrics]
    scores: dict[str, DetectionScore]
    complete: bool


def refinement(
    run: SimulatedRun,
    *,
    detectors: Sequence[str] = tuple(DETECTORS),
    config: Config | None = None,
    every: int = 5,
    jobs: int = 1,
    observer: Observer | None = None,
) -> Refinement:
    """Replay one drive with raw and with refined corners, and hold the corners against the true room.

    Parameters
    ----------
    run : SimulatedRun
    detectors : sequence of str
    config : Config, optional
    every : int
        Every so many scans, corners are held against the truth.
    jobs : int
        Processes to use.
    observer : Observer, optional

    Returns
    -------
    Refinement
    """
    config = told(config or Config(), run.lidar)
    settings = [
        Setting(run, replace(config, landmarks=replace(config.landmarks, refined=refined))) for refined in (False, True)
    ]
    metrics, complete = measure(settings, detectors, jobs=jobs, observer=observer)
    raw, refined = (*metrics, {}, {})[:2]
    scores = {name: corner_score(run, replace(config, detector=name), every=every) for name in detectors if complete}
    return Refinement(raw, refined, scores, complete)


def corner_score(
    run: SimulatedRun, config: Config, detector: Detector | None = None, *, every: int = 1
) -> DetectionScore:
    """Hold the corners of a run's scans against the true corners of its room.

    The motion during a scan is undone with the true one, so that the score is the detector's alone.

    Parameters
    ----------
    run : SimulatedRun
    config : Config
    detector : Detector, optional
        One of one's own in place of the configuration's.
    every : int
        Only every so many scans are looked at.

    Returns
    -------
    DetectionScore
    """
    detector = detector or make_detector(config.detector, adapted=config.adapted)
    mount = run.lidar_mount
    scans = run.scans[::every]
    found = []
    for scan in scans:
        times = np.linspace(0.0, max(float(scan.offsets[-1]), 1e-3), 5)
        contours = trace(scan, config, (times, run.truth(scan.stamp + times)), mount)
        corners = find_landmarks(contours, detector, config).corners
        found.append(DetectedCorners(corners.positions, corners.directions, corners.convex, corners.vertices))
    limits = VisibilityLimits(
        max_range=config.lidar.max_range, min_beams=config.landmarks.min_side_points, min_side=config.landmarks.min_side
    )
    return score_detections(
        found,
        compose(run.truth(np.array([scan.stamp for scan in scans])), mount),
        true_room(run.room, run.lidar.mount_height),
        [scan.angles for scan in scans],
        visibility=limits,
    )
