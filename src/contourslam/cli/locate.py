"""``contourslam locate``: where in a known map a scan was taken, without a first guess."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from contourslam.cli.console import make_way, print_json, progress
from contourslam.cli.options import Json, Overwrite, Settings
from contourslam.config import Config
from contourslam.errors import ConfigError, RecordingError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from contourslam.localization.posterior import Located
    from contourslam.localization.view import View
    from contourslam.matching.constellation import Constellation
    from contourslam.recordings import Recording

    Floats = NDArray[np.float64]

UNSURE = 3
"""Exit code where the robot was not found, or not for sure."""


@dataclass(frozen=True)
class Locate:
    """Find a robot in a known map from one scan, or from several with the odometry between them, without a first guess.

    Prints the pose of the robot, how sure that is, and where else it may be. The exit code is 0 where the place may be
    relied on: more probable than 0.9 and known to a decimetre; 3 where the robot was not found, or not for sure.

    Example: contourslam locate out/room --map room.map --at 12.5 --picture place.svg
    """

    recording: tyro.conf.Positional[Path]
    """Recording with the scan: a file, or the folder of a rosbag2."""
    map: Annotated[Path, tyro.conf.arg(metavar="FILE")]
    """Map to look in, as `contourslam run` saved it."""
    scan: int | None = None
    """Which scan, counted from 0; by default the first."""
    at: Annotated[float | None, tyro.conf.arg(metavar="SECONDS")] = None
    """Or the first scan this long after the recording's first one."""
    scans: int = 1
    """How many scans, with the odometry between them; the pose is that at the last."""
    scan_topic: str | None = None
    """Topic of the scans; found by itself where there is only one."""
    picture: Annotated[Path | None, tyro.conf.arg(metavar="FILE.svg")] = None
    """Draw the map, the scan and the robot."""
    overwrite: Overwrite = False
    json: Json = False
    settings: Settings = field(default_factory=Config)

    def execute(self, command: str) -> int:
        """Read the scans, look for them, and say where they are."""
        from contourslam.atomic import write_text
        from contourslam.localization.known_map import KnownMap
        from contourslam.localization.locate import Locator
        from contourslam.maps.file import load_map
        from contourslam.recordings import open_recording

        self._check()
        known = KnownMap(load_map(self.map))
        recording = open_recording(self.recording, scan_topic=self.scan_topic)
        view, landmarks, stamp = _seen(recording, self)
        located = Locator(known).find(view, landmarks)
        if self.picture is not None:
            from contourslam.report.svg.place import place_drawing

            write_text(self.picture, place_drawing(known, located, view).text)
        if self.json:
            print_json(_as_json(located, stamp))
        else:
            _print(located, stamp)
        return 0 if located.confident else UNSURE

    def _check(self) -> None:
        if self.scan is not None and self.at is not None:
            raise ConfigError("--scan and --at both say which scan: give one of them")
        if (self.scan or 0) < 0 or self.scans < 1:
            raise ConfigError("--scan counts from 0, and --scans is 1 or more")
        if self.picture is not None:
            if self.picture.suffix != ".svg":
                raise ConfigError(f"{self.picture}: the picture is a .svg file")
            make_way(self.picture, overwrite=self.overwrite)


def _seen(recording: "Recording", options: Locate) -> "tuple[View, Constellation, float]":
    """What the wanted scans see together, the corners and walls of the last, and its stamp (s)."""
    import numpy as np

    from contourslam.detectors import make_detector
    from contourslam.landmarks import find_landmarks, trace
    from contourslam.localization.looks import constellation_of
    from contourslam.localization.several import SeveralScans
    from contourslam.matching.oriented import move, oriented_points
    from contourslam.scan import LaserScan, Odometry
    from contourslam.slam.wheels import Wheels

    settings = options.settings
    mount = np.array(settings.lidar.mount if recording.lidar_mount is None else recording.lidar_mount)
    detector = make_detector(settings.detector, adapted=settings.adapted)
    wheels, several = Wheels(settings.slam), SeveralScans(settings.lidar.max_range, mount)
    number, taken, first = -1, 0, 0.0
    for message in progress(recording.messages(), "message"):
        if isinstance(message, Odometry):
            wheels.push(message)
        if not isinstance(message, LaserScan):
            continue
        number += 1
        first = message.stamp if number == 0 else first
        if number < (options.scan or 0) or message.stamp - first < (options.at or 0.0):
            continue
        motion = wheels.during(message)
        contours = trace(message, settings, motion, mount)
        several.push(move(oriented_points(contours), mount), *wheels.step_or_guess(message.stamp, motion))
        taken += 1
        if taken == options.scans:
            found = find_landmarks(contours, detector, settings)
            return several.view(), constellation_of(found.corners, found.walls, mount), message.stamp
    wanted = f"at {options.at} s" if options.at is not None else f"of number {options.scan or 0}"
    if taken:
        raise RecordingError(
            f"{recording.path}: has {taken} scans from the one {wanted} on; ask for fewer with --scans"
        )
    raise RecordingError(f"{recording.path}: has {number + 1} scans, there is none {wanted}")


def _print(located: "Located", stamp: float) -> None:
    import numpy as np

    if located.method == "none":
        print(f"scan at {stamp:.3f} s: found nowhere in the map")
        return
    x, y, theta = located.pose
    sx, sy, st = np.sqrt(np.diag(located.covariance))
    print(f"scan at {stamp:.3f} s, by {located.method}{'' if located.confident else ': not sure'}")
    print(f"pose:         x {x:.3f} m, y {y:.3f} m, heading {np.degrees(theta):.2f}°")
    print(f"standard deviations: {sx:.3f} m, {sy:.3f} m, {np.degrees(st):.2f}°, if this is the place")
    print(f"probability:  {located.probability:.3f}")
    for other in located.runners_up:
        x, y, theta = other.pose
        print(f"runner-up:    x {x:.3f} m, y {y:.3f} m, heading {np.degrees(theta):.2f}°, ", end="")
        print(f"probability {other.probability:.3f}")
    rest = 1.0 - located.probability - sum(other.probability for other in located.runners_up)
    print(f"elsewhere:    probability {max(rest, 0.0):.3f}")


def _as_json(located: "Located", stamp: float) -> dict[str, Any]:
    found = located.method != "none"
    return {
        "stamp": stamp,
        "confident": located.confident,
        "method": located.method,
        "pose": located.pose if found else None,
        "covariance": located.covariance if found else None,
        "probability": located.probability,
        "runners_up": [{"pose": other.pose, "probability": other.probability} for other in located.runners_up],
    }
