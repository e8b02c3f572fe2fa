"""A drive of several robots as recordings: one of each, all with one clock and one world frame."""

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from contourslam.recordings import RecordingWriter
from contourslam.scan import LaserScan, TruePose
from contourslam.simulation.drive import Progress
from contourslam.simulation.several import SeveralRobots


@dataclass(frozen=True, slots=True)
class Recorded:
    """What was recorded.

    Attributes
    ----------
    scans : tuple of int
        In each recording.
    seconds : float
        How long the robots drove.
    complete : bool
        Whether that is as long as they should.
    ways : tuple of ndarray, shape (n, 3)
        True poses of each robot: x (m), y (m), heading (rad) in the world frame.
    """

    scans: tuple[int, ...]
    seconds: float
    complete: bool
    ways: tuple[NDArray[np.float64], ...]


def recording_paths(folder: Path, robots: int) -> list[Path]:
    """Where the recordings of so many robots go: ``robot1``, ``robot2`` and so on in the folder; of one, the folder."""
    if robots == 1:
        return [folder]
    return [folder / f"robot{number}" for number in range(1, robots + 1)]


def record(
    robots: SeveralRobots,
    paths: Sequence[Path],
    *,
    stopped: Callable[[], bool] = lambda: False,
    progress: Progress | None = None,
) -> Recorded:
    """Drive several robots and record each by itself, as their messages come.

    Parameters
    ----------
    robots : SeveralRobots
    paths : sequence of Path
        Of the recording of each; folders above it are made where needed, it must not exist.
    stopped : callable
        Asked before each message: whether to end the drive here. What is recorded by then is whole.
    progress : callable, optional
        Called with the fraction done, 0 to 1.

    Raises
    ------
    MissingExtraError, ConfigError
        As :meth:`SeveralRobots.messages`; what was recorded by then is kept.
    RecordingError
        If a recording exists or cannot be written.
    """
    scans, now, complete = [0] * len(paths), 0.0, True
    poses: list[list[NDArray[np.float64]]] = [[] for _ in paths]
    with ExitStack() as stack:
        writers = []
        for path in paths:
            path.parent.mkdir(parents=True, exist_ok=True)
            writers.append(stack.enter_context(RecordingWriter(path, lidar_mount=robots.lidar_place)))
        for robot, message in robots.messages():
            if stopped():
                complete = False
                break
            writers[robot].write(message)
            if isinstance(message, LaserScan):
                scans[robot] += 1
            elif isinstance(message, TruePose):
                poses[robot].append(message.pose)
            if message.stamp > now:
                now = message.stamp
                if progress is not None:
                    progress(min(now / robots.duration, 1.0))
    return Recorded(tuple(scans), now, complete, tuple(np.array(way) for way in poses))
