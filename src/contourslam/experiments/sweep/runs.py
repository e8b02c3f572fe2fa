"""One run of a sweep: everything that its result depends on, and the key that this makes."""

import hashlib
import json
import math
from dataclasses import asdict, dataclass, replace
from functools import cached_property, lru_cache
from typing import Any

from contourslam.config import Config
from contourslam.experiments.sweep.own_detector import OwnDetector
from contourslam.experiments.sweep.versions import program
from contourslam.simulation.config import LIDARS, LidarModel, SimulationConfig

Described = dict[str, Any]


@dataclass(frozen=True, slots=True)
class SimulatedDrive:
    """A drive in a simulated room, measured by one lidar.

    Attributes
    ----------
    room : str
        A key of ``contourslam.simulation.rooms.ROOMS``.
    seed : int
    lidar : str
        A key of ``contourslam.simulation.config.LIDARS``.
    noise : float or None
        Standard deviation of every range, m; None for the lidar's own where that grows with the range.
    beams : int or None
        Of one turn, at the lidar's nominal turn rate; None for the lidar's own where they vary.
    duration : float or None
        s; None for two laps, at least 180 s.
    speed : float
        m/s.
    """

    room: str
    seed: int
    lidar: str
    noise: float | None
    beams: int | None
    duration: float | None
    speed: float

    @property
    def model(self) -> LidarModel:
        """The lidar with so many beams and the noise."""
        lidar = LIDARS[self.lidar]
        if self.beams is not None:
            lidar = replace(lidar, samples_per_second=self.beams * lidar.turn_rate)
        return lidar.with_noise(self.noise)

    @property
    def simulation(self) -> SimulationConfig:
        """All that the simulation is told."""
        return SimulationConfig(self.duration, self.speed, None, self.model)

    @property
    def shared(self) -> tuple[object, ...]:
        """What drives have in common that are the same but for the lidar."""
        return self.room, self.seed, self.speed, self.duration


@dataclass(frozen=True, slots=True)
class RecordedDrive:
    """A recording, wherever it lies.

    Attributes
    ----------
    name : str
        What people call it.
    url : str
        Path or URL.
    identity : str
        Size and checksum of its content, or why it cannot be read.
    relations, relations_identity : str or None
        Known relative poses to judge by, likewise.
    """

    name: str
    url: str
    identity: str
    relations: str | None = None
    relations_identity: str | None = None

    @property
    def shared(self) -> tuple[object, ...]:
        """What runs of the same recording have in common."""
        return (self.url,)


@dataclass(frozen=True)
class Run:
    """One run of a sweep.

    Attributes
    ----------
    drive : SimulatedDrive or RecordedDrive
    detector : str
    own : OwnDetector or None
        Where the detector comes from, unless it is one of the package.
    setting : str
        Name of the overrides.
    config : Config
        The whole configuration of the pipeline.
    """

    drive: SimulatedDrive | RecordedDrive
    detector: str
    own: OwnDetector | None
    setting: str
    config: Config

    @cached_property
    def description(self) -> Described:
        """The complete configuration, ready for JSON; with the program's version it makes the key."""
        drive = asdict(self.drive)
        if isinstance(self.drive, SimulatedDrive):
            drive["simulation"] = _as_dict(self.drive.simulation)
        own = None if self.own is None else {"place": self.own.place, "digest": self.own.digest}
        return {
            "drive": drive,
            "detector": self.detector,
            "own_detector": own,
            "setting": self.setting,
            "config": _as_dict(self.config),
        }

    @cached_property
    def key(self) -> str:
        """Name of the run's row: 32 hexadecimal digits, the same for the same configuration and program only."""
        known = self.description | {"program": program()}
        if self.own is not None:  # where the file lies does not matter
            known["own_detector"] = [self.own.digest, self.own.factory]
        if isinstance(self.drive, RecordedDrive):  # nor where the recording does
            known["drive"] = [self.drive.identity, self.drive.relations_identity]
        return hashlib.sha256(json.dumps(known, sort_keys=True, allow_nan=False).encode()).hexdigest()[:32]

    @property
    def axes(self) -> dict[str, Any]:
        """Columns that say what was varied."""
        drive = self.drive
        columns: dict[str, Any] = {"detector": self.detector, "setting": self.setting, "back_end": self.config.back_end}
        if isinstance(drive, RecordedDrive):
            return columns | {"source": "recording", "recording": drive.name, "recording_url": drive.url}
        names = ("room", "seed", "lidar", "noise", "beams", "duration", "speed")
        return columns | {"source": "simulation", **{name: getattr(drive, name) for name in names}}

    @property
    def order(self) -> tuple[object, ...]:
        """Sorted by this, runs of one drive that share scans follow each other."""
        drive = self.drive
        if isinstance(drive, RecordedDrive):
            return ()
        return drive.lidar, drive.beams or 0, -1.0 if drive.noise is None else drive.noise

    @property
    def name(self) -> str:
        """Say in words which run it is."""
        drive = self.drive
        if isinstance(drive, RecordedDrive):
            place = drive.name
        else:
            noise = "" if drive.noise is None else f", noise {drive.noise:g} m"
            beams = "" if drive.beams is None else f", {drive.beams} beams"
            place = f"{drive.room}, seed {drive.seed}{noise}{beams}"
        return f"{self.detector}, {self.setting}, {place}"


@lru_cache(maxsize=4096)
def _as_dict(values: Config | SimulationConfig) -> Described:
    """As names and values, once for all runs that share it."""
    cleaned: Described = _for_json(asdict(values))
    return cleaned


def _for_json(values: Any) -> Any:
    """Infinity, which JSON does not have, becomes a text."""
    if isinstance(values, dict):
        return {name: _for_json(value) for name, value in values.items()}
    return str(values) if isinstance(values, float) and not math.isfinite(values) else values
