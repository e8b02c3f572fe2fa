"""One recorded run replayed once per detector, and once more with walls."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from contourslam.config import Config
from contourslam.experiments.parallel import Step
from contourslam.recordings.recording import Message
from contourslam.replay import replay
from contourslam.scan import LaserScan
from contourslam.slam.result import RunResult

Floats = NDArray[np.float64]

Mode = Literal["corners", "walls"]
MODES: tuple[Mode, ...] = ("corners", "walls")
"""Landmarks of the filter: corners only, as in the paper's Table I, and corners with walls."""

_WARM_UP = 20  # scans


@dataclass(frozen=True, slots=True)
class Variant:
    """What one replay differs in from another of the same recording."""

    detector: str
    mode: Mode


def variants(detectors: Sequence[str], modes: Sequence[Mode] = MODES) -> list[Variant]:
    """List all pairs of detector and mode, the modes of a detector side by side."""
    return [Variant(detector, mode) for detector in detectors for mode in modes]


def replay_each(
    messages: Sequence[Message],
    wanted: Iterable[Variant],
    config: Config,
    *,
    lidar_mount: Floats,
    step: Step,
) -> Iterator[tuple[Variant, RunResult]]:
    """Replay one recording in every variant from its first true pose; stops after the first that was interrupted.

    Parameters
    ----------
    messages : sequence
        The recording.
    wanted : iterable of Variant
    config : Config
        What the variants share.
    lidar_mount : ndarray, shape (3,)
        Pose of the lidar in the base frame.
    step : Step
        Called after each variant; false ends the work.

    Yields
    ------
    Variant, RunResult
    """
    todo = list(wanted)

    def run(variant: Variant, part: Iterable[Message]) -> RunResult:
        chosen = replace(config, detector=variant.detector, slam=replace(config.slam, walls=variant.mode == "walls"))
        return replay(part, chosen, lidar_mount=lidar_mount)

    # Compiling is no part of the time per scan.
    for variant in todo:
        run(variant, _first_scans(messages, _WARM_UP))
    for variant in todo:
        result = run(variant, messages)
        yield variant, result
        if not step() or not result.complete:
            return


def _first_scans(messages: Sequence[Message], count: int) -> Sequence[Message]:
    scans = (i for i, message in enumerate(messages) if isinstance(message, LaserScan))
    last = next(islice(scans, count, None), len(messages))
    return messages[:last]
