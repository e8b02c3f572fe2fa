"""One run of a sweep: the drive, the replay, and every figure about it. What runs have in common is done once."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from contourslam.config import Config
from contourslam.errors import RecordingError
from contourslam.evaluation.metrics import Metrics, run_metrics
from contourslam.evaluation.relations import judge
from contourslam.experiments.refinement import corner_score
from contourslam.experiments.sweep.files import UNREADABLE, fetched, identity, is_local, open_place
from contourslam.experiments.sweep.own_detector import OwnDetector, load_detector
from contourslam.experiments.sweep.runs import RecordedDrive, Run, SimulatedDrive
from contourslam.recordings import open_recording, read_relations
from contourslam.recordings.recording import Message
from contourslam.replay import replay
from contourslam.scan import LaserScan
from contourslam.simulation.config import LidarModel
from contourslam.simulation.drive import Drive, drive
from contourslam.simulation.lidar import IdealScan, cast_scans
from contourslam.simulation.noise import add_noise
from contourslam.simulation.odometry import WheelOdometry, read_odometry
from contourslam.simulation.rooms import ROOMS
from contourslam.simulation.simulate import SimulatedRun

Floats = NDArray[np.float64]

_WARM_UP = 20  # scans
_JUDGED = 10  # of so many scans, the corners of one are held against the true ones


@dataclass(frozen=True, slots=True)
class Material:
    """What a run is replayed from.

    Attributes
    ----------
    messages : tuple of Message
    lidar_mount : tuple of float or None
        ``T_base_lidar``: m, m, rad; None for that of the configuration.
    relations : (ndarray of shape (n, 2), ndarray of shape (n, 3)) or None
        As :func:`contourslam.recordings.read_relations` gives them.
    simulated : SimulatedRun or None
    damage : RecordingError or None
        With which the recording breaks off.
    skipped : dict of str to int
        Messages that could not be used: the reason, and how many.
    """

    messages: tuple[Message, ...]
    lidar_mount: tuple[float, float, float] | None
    relations: tuple[Floats, Floats] | None = None
    simulated: SimulatedRun | None = None
    damage: RecordingError | None = None
    skipped: dict[str, int] = field(default_factory=dict)

    def play(self) -> Iterator[Message]:
        """Yield the messages, and fail where the recording does."""
        yield from self.messages
        if self.damage is not None:
            raise self.damage


def measure(run: Run) -> Metrics:
    """Do one run.

    Parameters
    ----------
    run : Run

    Returns
    -------
    dict
        As :func:`contourslam.evaluation.metrics.run_metrics` gives it; of a simulated drive with `detection`, of a
        recording with `relations` where there are known relative poses.

    Raises
    ------
    ContourslamError
        If the recording cannot be read at all, a library is missing, or the configuration is refused.
    """
    detector = None if run.own is None else load_detector(run.own, adapted=run.config.adapted)
    material = recorded(run.drive) if isinstance(run.drive, RecordedDrive) else simulated(run.drive)
    _warm_up(run.config, run.own, run.drive)
    result = replay(material.play(), run.config, detector, lidar_mount=material.lidar_mount)
    result = replace(result, skipped={**material.skipped, **result.skipped})
    relations = material.relations
    judged = None if relations is None or len(result.stamps) < 2 else judge(result, *relations)
    simulated_run = material.simulated
    score = None if simulated_run is None else corner_score(simulated_run, run.config, detector, every=_JUDGED)
    return run_metrics(result, relations=judged, detection=score)


@lru_cache(maxsize=1)
def recorded(where: RecordedDrive) -> Material:
    """Read a recording, and the known relative poses that belong to it.

    Raises
    ------
    RecordingError
        If either cannot be read, or is not the one that was planned with.
    """
    _check(where.url, where.identity)
    with fetched(where.url) as path:
        recording = open_recording(path)
        messages: list[Message] = []
        damage = None
        try:
            messages.extend(recording.messages())
        except RecordingError as error:
            damage = error
        mount = recording.lidar_mount
    relations = None
    if where.relations is not None:
        _check(where.relations, str(where.relations_identity))
        with fetched(where.relations) as path:
            relations = read_relations(path)
    return Material(tuple(messages), mount, relations, damage=damage, skipped=dict(recording.skipped))


def _check(url: str, planned: str) -> None:
    """Refuse a file that is another here: its row would stand under a key that is not its own."""
    local = is_local(open_place(url)[0])  # elsewhere, some stores say something else after each reading
    if (local or planned.startswith(UNREADABLE)) and identity(url) != planned:
        raise RecordingError(f"{url}: is not here what it was where the sweep was started; start the sweep again")


@lru_cache(maxsize=1)
def simulated(where: SimulatedDrive) -> Material:
    """Measure a drive by a lidar with its noise; drive and beams are taken from what was done before.

    Raises
    ------
    MissingExtraError
        If the simulation's libraries are not installed.
    ConfigError
        If the robot gets stuck.
    """
    lidar = where.model
    driven, odometry = _driven(where.room, where.seed, where.speed, where.duration)
    ideal = _ideal_scans(where.room, where.seed, where.speed, where.duration, lidar.with_noise(0.0))
    scans = add_noise(ideal, lidar, where.seed)
    run = SimulatedRun(ROOMS[where.room], lidar, where.seed, driven, odometry, (), scans)
    x, y, yaw = run.lidar_mount.tolist()
    return Material(tuple(run.messages()), (x, y, yaw), simulated=run)


@lru_cache(maxsize=1)
def _driven(room: str, seed: int, speed: float, duration: float | None) -> tuple[Drive, WheelOdometry]:
    robot = SimulatedDrive(room, seed, "paper", None, None, duration, speed).simulation.robot
    driven = drive(ROOMS[room], robot, seed, speed=speed, duration=duration)
    return driven, read_odometry(driven, robot, seed)


@lru_cache(maxsize=1)
def _ideal_scans(
    room: str, seed: int, speed: float, duration: float | None, lidar: LidarModel
) -> tuple[IdealScan, ...]:
    driven, _ = _driven(room, seed, speed, duration)
    return cast_scans(ROOMS[room], driven, lidar, seed)


@lru_cache(maxsize=64)
def _warm_up(config: Config, own: OwnDetector | None, where: SimulatedDrive | RecordedDrive) -> None:
    """Replay the first scans: to compile or to load the kernels is no part of the time per scan."""
    material = recorded(where) if isinstance(where, RecordedDrive) else simulated(where)
    first = _first_scans(material.messages)
    if any(isinstance(message, LaserScan) for message in first):
        detector = None if own is None else load_detector(own, adapted=config.adapted)
        replay(first, config, detector, lidar_mount=material.lidar_mount)


def _first_scans(messages: Sequence[Message]) -> Sequence[Message]:
    scans = (i for i, message in enumerate(messages) if isinstance(message, LaserScan))
    return messages[: next(islice(scans, _WARM_UP, None), len(messages))]
