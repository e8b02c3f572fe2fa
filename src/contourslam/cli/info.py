"""``contourslam info``: what is in a recording, and whether it can be mapped."""

import shlex
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import tyro

from contourslam.cli.console import print_json, progress, unused_folder
from contourslam.cli.interrupt import Interrupt, UntilStopped
from contourslam.cli.options import Json

if TYPE_CHECKING:
    from contourslam.recordings import Message, Recording


@dataclass(frozen=True)
class Info:
    """Say what is in a recording: topics, rates, beams, clocks, damage, and what is missing to map it.

    Example: contourslam info out/room
    """

    recording: tyro.conf.Positional[Path]
    """Recording to look at: a file, or the folder of a rosbag2."""
    json: Json = False

    def execute(self, command: str) -> int:
        """Read the recording once and print what was found."""
        from contourslam.recordings import open_recording

        recording = open_recording(self.recording)
        found = _survey(recording)
        if self.json:
            print_json(found)
        else:
            _print(found)
        return 0


@dataclass
class _Stream:
    """What is learnt about one kind of message while they pass by."""

    stamps: list[float] = field(default_factory=list)

    def summary(self) -> dict[str, Any]:
        import numpy as np

        stamps = np.array(self.stamps)
        steps = np.diff(stamps)
        forward = steps[steps > 0.0]
        return {
            "count": len(stamps),
            "start": stamps.min() if len(stamps) else None,
            "end": stamps.max() if len(stamps) else None,
            "rate": 1.0 / np.median(forward) if len(forward) else None,
            "longest_pause": forward.max() if len(forward) else None,
            "stamps_backwards": int((steps < 0.0).sum()),
        }


def _survey(recording: "Recording") -> dict[str, Any]:
    """Read all messages once; damage ends the reading and is reported."""
    from contourslam.errors import RecordingError
    from contourslam.scan import LaserScan, Odometry, TruePose

    streams = {LaserScan: _Stream(), Odometry: _Stream(), TruePose: _Stream()}
    beams: list[int] = []
    span: list[float] = []
    limits: list[tuple[float, float]] = []
    returned = total = 0
    damage = None
    with Interrupt() as interrupt:
        messages: UntilStopped[Message] = UntilStopped(recording.messages(), interrupt)
        try:
            for message in progress(messages, "message"):
                streams[type(message)].stamps.append(message.stamp)
                if isinstance(message, LaserScan) and len(message.angles):
                    beams.append(len(message.ranges))
                    span += [message.angles.min(), message.angles.max()]
                    limits.append((message.range_min, message.range_max))
                    total += len(message.ranges)
                    returned += int(((message.ranges > message.range_min) & (message.ranges < message.range_max)).sum())
        except RecordingError as error:
            damage = str(error)
    scans = streams[LaserScan].summary()
    if beams:
        scans |= {
            "beams": [min(beams), max(beams)],
            "angles": [min(span), max(span)],
            "range_limits": [min(low for low, _ in limits), max(high for _, high in limits)],
            "returns": returned / total,
        }
    missing = [name for kind, name in ((LaserScan, "scans"), (Odometry, "wheel odometry")) if not streams[kind].stamps]
    return {
        "recording": str(recording.path),
        "topics": [{"name": t.name, "type": t.message_type, "count": t.count} for t in recording.topics()],
        "scans": scans,
        "odometry": streams[Odometry].summary(),
        "truth": streams[TruePose].summary(),
        "lidar_mount": recording.lidar_mount,
        "skipped": recording.skipped,
        "notes": recording.notes,
        "damage": damage,
        "read_to_end": damage is None and not messages.interrupted,
        "missing": missing,
    }


def _print(found: dict[str, Any]) -> None:
    from math import degrees

    print(found["recording"])
    width = max((len(topic["name"]) for topic in found["topics"]), default=0)
    for topic in found["topics"]:
        print(f"  {topic['name']:<{width}}  {topic['count']:>8}  {topic['type']}")
    for name, title in (("scans", "scans"), ("odometry", "wheel odometry"), ("truth", "true poses")):
        print(f"{title + ':':<16}{_stream_line(found[name])}")
    scans = found["scans"]
    if "beams" in scans:
        low, high = scans["beams"]
        first, last = (degrees(angle) for angle in scans["angles"])
        near, far = scans["range_limits"]
        print(
            f"{'beams:':<16}{low if low == high else f'{low} to {high}'} a scan, {first:.1f}° to {last:.1f}°, "
            f"ranges {near:g} to {far:g} m, {scans['returns']:.0%} return"
        )
    mount = found["lidar_mount"]
    where = "not stated; taken from --mount-x, --mount-y, --mount-yaw"
    if mount is not None:
        where = f"x {mount[0]:.3f} m, y {mount[1]:.3f} m, yaw {mount[2]:.4f} rad"
    print(f"{'lidar mount:':<16}{where}")
    for reason, count in found["skipped"].items():
        print(f"{'skipped:':<16}{count}: {reason}")
    for text in found["notes"]:
        print(f"{'note:':<16}{text}")
    if found["damage"]:
        print(f"{'damage:':<16}{found['damage']}")
    if "scans" in found["missing"]:
        print("it holds no scan: it cannot be mapped")
    else:
        recording = found["recording"]
        print(f"map it with: contourslam run {shlex.quote(recording)} -o {unused_folder(Path(recording), 'map')}")


def _stream_line(stream: dict[str, Any]) -> str:
    if not stream["count"]:
        return "none"
    text = f"{stream['count']} in {stream['end'] - stream['start']:.1f} s"
    if stream["rate"]:
        text += f", {stream['rate']:.3g} Hz, longest pause {stream['longest_pause']:.2f} s"
    if stream["stamps_backwards"]:
        text += f", stamps run backwards {stream['stamps_backwards']} times"
    return text
