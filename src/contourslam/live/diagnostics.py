"""The state of live use in a few lines: what is well, what is not, and what to do about it."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import IntEnum

from contourslam.config import LiveConfig
from contourslam.live.events import WITHOUT_ODOMETRY, Reason, Source
from contourslam.live.figures import Summary
from contourslam.live.tally import Count

# What to do about messages that are lost.
ADVICE = {
    Reason.TOO_SLOW: "use fewer beams, throttle the topic, or a faster computer",
    Reason.OUT_OF_ORDER: "do two drivers publish on this topic?",
    Reason.REPEATED: "does its driver publish each twice?",
    Reason.BEFORE_JUMP: "they were on their way when time ran back",
}
MOST_NIS, FEWEST_DOF = 2.0, 30  # corrections are called inconsistent beyond this, and not on less evidence
SLOW = 3.0  # times the usual time between two messages, after which the next one is missing
ENOUGH = 10  # scans that show how well they fit


class Level(IntEnum):
    """How bad it is; the numbers are those of ROS."""

    OK = 0
    WARN = 1
    ERROR = 2


@dataclass(frozen=True, slots=True)
class Diagnostic:
    """One thing watched.

    Attributes
    ----------
    level : Level
    name : str
        "scans", "odometry", "clock", "latency", "map", "consistency" or "saving".
    message : str
        One line: what is the matter, and what to do.
    values : dict of str to str
        Figures, with their units.
    """

    level: Level
    name: str
    message: str
    values: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Sensor:
    """How the messages of one sensor come.

    Attributes
    ----------
    topic : str
    expected : bool
    number : int
        How many have come in all.
    silent : float
        Time since the last, or since the session began, s.
    by_arrival, by_stamps : float
        How many a second, by the caller's clock and by their own stamps.
    """

    topic: str
    expected: bool
    number: int
    silent: float
    by_arrival: float
    by_stamps: float


@dataclass(frozen=True, slots=True)
class Condition:
    """All that the diagnostics are made of.

    Attributes
    ----------
    scans, odometry : Sensor
    incidents : mapping
        Counts of the last seconds, and
    totals : mapping
        from the beginning on; from (source, reason) to :class:`Count`.
    mapped : Summary
    paused, localized : bool
    jump, leap : str
        What is to be said of time that ran back, and of odometry that leapt, in the last seconds; empty for nothing.
    map_version : int
    saved : float
        Time since the map was last saved by itself, s; NaN where it never was.
    autosave : str
        Where to; empty for nowhere.
    trouble : str
        Why it could not be saved; empty where it could.
    """

    scans: Sensor
    odometry: Sensor
    incidents: Mapping[tuple[Source, Reason], Count]
    totals: Mapping[tuple[Source, Reason], Count]
    mapped: Summary
    paused: bool
    localized: bool
    jump: str
    leap: str
    map_version: int
    saved: float
    autosave: str
    trouble: str


def diagnose(condition: Condition, config: LiveConfig) -> tuple[Diagnostic, ...]:
    """Say how all is.

    Parameters
    ----------
    condition : Condition
    config : LiveConfig

    Returns
    -------
    tuple of Diagnostic
        Always one of each name, in the same order.
    """
    return (
        Diagnostic(*_scans(condition, config), _values(condition, "scan", condition.scans)),
        Diagnostic(*_odometry(condition, config), _values(condition, "odometry", condition.odometry)),
        _clock(condition),
        _latency(condition, config),
        _map(condition, config),
        _consistency(condition.mapped),
        _saving(condition),
    )


def _has_stopped(sensor: Sensor, config: LiveConfig) -> bool:
    """Whether a sensor is silent for longer than it usually is; some lidars scan less than once a second."""
    usual = SLOW / sensor.by_arrival if sensor.by_arrival > 0.0 else 0.0
    return sensor.silent >= max(config.silent_after, usual)


def _scans(c: Condition, config: LiveConfig) -> tuple[Level, str, str]:
    name, scans = "scans", c.scans
    if scans.number == 0:
        if scans.silent < config.silent_after:
            return Level.OK, name, f"waiting for the first scan on {scans.topic}"
        return Level.ERROR, name, (
            f"no scan has come on {scans.topic} for {scans.silent:.1f} s: "
            "is the lidar's driver running, and is this its topic?"
        )  # fmt: skip
    if _has_stopped(scans, config):
        return Level.ERROR, name, f"no scan for {scans.silent:.1f} s on {scans.topic}: is the lidar's driver running?"
    if c.paused:
        return Level.WARN, name, "paused: scans are left out until resumed"
    lost = {reason: n for (source, reason), n in c.incidents.items() if source == "scan" and reason.loses}
    lost.pop(Reason.PAUSED, None)
    if lost:
        reason, most = next(iter(lost.items()))
        number = sum(n.number for n in lost.values())
        return Level.WARN, name, (
            f"{number} scan{'s' * (number > 1)} lost on {scans.topic} in the last {config.remember:.0f} s: "
            f"{reason.value}{_by(most.worst)}: {ADVICE.get(reason) or most.last.detail}"
        )  # fmt: skip
    return Level.OK, name, f"{scans.by_arrival:.1f} scans a second"


def _odometry(c: Condition, config: LiveConfig) -> tuple[Level, str, str]:
    name, odometry = "odometry", c.odometry
    if not odometry.expected:
        return Level.OK, name, "not used: motion is found from the scans alone"
    if odometry.number == 0:
        if odometry.silent < config.silent_after:
            return Level.OK, name, f"waiting for the first odometry on {odometry.topic}"
        return Level.WARN, name, (
            f"no odometry has come on {odometry.topic} for {odometry.silent:.1f} s: motion is guessed from the scans "
            "alone; is the base driver running, and is this its topic?"
        )  # fmt: skip
    if _has_stopped(odometry, config):
        return Level.ERROR, name, (
            f"no odometry for {odometry.silent:.1f} s on {odometry.topic}: motion is guessed from the scans alone; "
            "is the base driver running?"
        )  # fmt: skip
    if c.leap:
        return Level.WARN, name, c.leap
    without = [n for (_, reason), n in c.incidents.items() if reason in WITHOUT_ODOMETRY]
    if without:
        number, worst = sum(n.number for n in without), max(n.worst for n in without)
        return Level.WARN, name, (
            f"{number} scan{'s' * (number > 1)} mapped without odometry in the last {config.remember:.0f} s: "
            f"{without[0].last.reason.value}{_by(worst)}: if that goes on, raise `wait`, or have it come faster"
        )  # fmt: skip
    lost = [
        n
        for (source, reason), n in c.incidents.items()
        if source == "odometry" and reason in (Reason.REFUSED, Reason.OUT_OF_ORDER)
    ]
    if lost:
        last = lost[0].last
        return Level.WARN, name, (
            f"{lost[0].number} readings dropped on {odometry.topic} in the last {config.remember:.0f} s: "
            f"{last.reason.value}: {ADVICE.get(last.reason) or last.detail}"
        )  # fmt: skip
    return Level.OK, name, f"{odometry.by_arrival:.1f} readings a second"


def _clock(c: Condition) -> Diagnostic:
    differ = c.incidents.get(("scan", Reason.CLOCKS_DIFFER))
    if differ is not None:
        return Diagnostic(
            Level.ERROR,
            "clock",
            f"scans and odometry are stamped {differ.last.delay:.1f} s apart: set the clocks of both computers alike "
            "(chrony), or is only one of them on simulated time?",
        )
    if c.jump:
        return Diagnostic(Level.WARN, "clock", c.jump)
    return Diagnostic(Level.OK, "clock", "stamps go forward")


def _latency(c: Condition, config: LiveConfig) -> Diagnostic:
    mapped = c.mapped
    values = {
        "median (ms)": f"{1e3 * mapped.latency_median:.1f}",
        "99 % (ms)": f"{1e3 * mapped.latency_99:.1f}",
        "scans": str(mapped.scans),
    }
    if not mapped.scans:
        return Diagnostic(Level.OK, "latency", f"no scan mapped in the last {config.remember:.0f} s", values)
    if mapped.latency_99 > config.late_after:
        message = (
            f"poses come up to {1e3 * mapped.latency_99:.0f} ms after their scan: "
            "is the computer busy, or the odometry late?"
        )
        return Diagnostic(Level.WARN, "latency", message, values)
    return Diagnostic(Level.OK, "latency", f"{1e3 * mapped.latency_median:.0f} ms from scan to pose", values)


def _map(c: Condition, config: LiveConfig) -> Diagnostic:
    values = {"quality": f"{c.mapped.quality:.2f}", "version": str(c.map_version)}
    if not c.localized:
        message = "the robot is not found in the map yet: drive it to where it sees walls and corners of the map"
        return Diagnostic(Level.ERROR, "map", message, values)
    if c.mapped.scans >= ENOUGH and c.mapped.quality < config.poor_quality:
        message = (
            f"scans fit the map poorly ({c.mapped.quality:.2f} of 1): "
            "does the lidar see walls, and is its mounting right?"
        )
        return Diagnostic(Level.WARN, "map", message, values)
    return Diagnostic(Level.OK, "map", "scans fit the map", values)


def _consistency(mapped: Summary) -> Diagnostic:
    values = {"NIS per degree of freedom": f"{mapped.nis:.2f}", "degrees of freedom": str(mapped.nis_dof)}
    if mapped.nis_dof >= FEWEST_DOF and mapped.nis > MOST_NIS:
        message = (
            f"measurements miss the map by {math.sqrt(mapped.nis):.1f} times what they should: "
            "raise slam.motion or lidar.sigma_range, or check the lidar's mounting"
        )
        return Diagnostic(Level.WARN, "consistency", message, values)
    return Diagnostic(Level.OK, "consistency", "measurements agree with the map", values)


def _saving(c: Condition) -> Diagnostic:
    if c.trouble:
        message = f"the map could not be saved: {c.trouble}; the file from before is kept"
        return Diagnostic(Level.ERROR, "saving", message, {"file": c.autosave})
    if not c.autosave:
        return Diagnostic(Level.OK, "saving", "the map is saved on request only")
    when = "not yet" if math.isnan(c.saved) else f"{c.saved:.0f} s ago"
    return Diagnostic(Level.OK, "saving", f"saved by itself: {when}", {"file": c.autosave})


def _by(worst: float) -> str:
    return (
        f", by up to {1e3 * worst:.0f} ms" if 0.0 < worst < 1.0 else f", by up to {worst:.1f} s" if worst > 0.0 else ""
    )


def _values(c: Condition, source: Source, sensor: Sensor) -> dict[str, str]:
    values = {
        "topic": sensor.topic,
        "received": str(sensor.number),
        "per second by arrival": f"{sensor.by_arrival:.2f}",
        "per second by stamps": f"{sensor.by_stamps:.2f}",
    }
    for (origin, reason), count in c.totals.items():
        if origin == source:
            values[reason.value] = str(count.number)
    return values
