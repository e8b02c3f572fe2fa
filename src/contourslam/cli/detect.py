"""``contourslam detect``: a picture of what a detector sees in one scan."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from contourslam.cli.console import make_way, print_json
from contourslam.cli.options import Json, Overwrite, Settings
from contourslam.config import Config
from contourslam.errors import ConfigError, RecordingError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from contourslam.landmarks import Detection
    from contourslam.recordings import Recording
    from contourslam.scan import LaserScan

    Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Detect:
    """Draw one scan: its contours, the detector's response along them, corners and walls.

    Example: contourslam detect out/room --scan 120 --detector wu -o scan.png
    """

    recording: tyro.conf.Positional[Path]
    """Recording to look into: a file, or the folder of a rosbag2."""
    output: Annotated[Path, tyro.conf.arg(aliases=["-o"], metavar="FILE.png")]
    """Picture to write, .png or .svg."""
    overwrite: Overwrite = False
    scan: int = 0
    """Which scan, counted from 0."""
    scan_topic: str | None = None
    """Topic of the scans; found by itself where there is only one."""
    json: Json = False
    settings: Settings = field(default_factory=Config)

    def execute(self, command: str) -> int:
        """Detect, draw, and say what was found."""
        import numpy as np

        from contourslam.detectors import make_detector
        from contourslam.landmarks import find_landmarks, trace
        from contourslam.recordings import open_recording
        from contourslam.report.figures.save import save_figure
        from contourslam.report.figures.scan import scan_figure

        if self.output.suffix not in (".png", ".svg"):
            raise ConfigError(f"{self.output}: a picture is a .png or .svg file")
        if self.scan < 0:
            raise ConfigError("--scan counts from 0")
        make_way(self.output, overwrite=self.overwrite)
        detector = make_detector(self.settings.detector, adapted=self.settings.adapted)
        recording = open_recording(self.recording, scan_topic=self.scan_topic)
        scan, motion = _pick(recording, self.scan)
        mount = None if recording.lidar_mount is None else np.array(recording.lidar_mount)
        detection = find_landmarks(trace(scan, self.settings, motion, mount), detector, self.settings)
        figure = scan_figure(
            detection,
            self.settings.detector,
            threshold=detector.threshold,
            title=f"scan {self.scan} at {scan.stamp:.2f} s",
        )
        save_figure(figure, self.output)
        if self.json:
            print_json(_as_json(self, scan, detection))
        else:
            print(
                f"{self.output}: {len(scan.ranges)} beams, {len(detection.contours)} contours, "
                f"{len(detection.candidates)} candidates, {len(detection.corners.positions)} corners, "
                f"{len(detection.walls.end_points)} walls"
            )
        return 0


def _pick(recording: "Recording", number: int) -> "tuple[LaserScan, tuple[Floats, Floats]]":
    """Find the scan of that number, with the odometry around it: times after its stamp, and poses."""
    import numpy as np

    from contourslam.scan import LaserScan, Odometry

    scans = 0
    odometry: list[Odometry] = []
    for message in recording.messages():
        if isinstance(message, Odometry):
            odometry = [*odometry[-200:], message]
        if isinstance(message, LaserScan):
            scans += 1
            if scans <= number:
                continue
            near = [o for o in odometry if abs(o.stamp - message.stamp) < 1.0 and o.stamp >= message.stamp - 0.2]
            near.sort(key=lambda o: o.stamp)
            times = np.array([o.stamp - message.stamp for o in near])
            return message, (times, np.array([o.pose for o in near]).reshape(-1, 3))
    raise RecordingError(f"{recording.path}: has {scans} scans, there is none of number {number}; they count from 0")


def _as_json(options: Detect, scan: "LaserScan", detection: "Detection") -> dict[str, Any]:
    corners, walls = detection.corners, detection.walls
    return {
        "picture": str(options.output),
        "stamp": scan.stamp,
        "beams": len(scan.ranges),
        "contours": len(detection.contours),
        "candidates": detection.curve.points[detection.candidates],
        "corners": {
            "positions": corners.positions,
            "covariances": corners.covariances,
            "directions": corners.directions,
            "openings": corners.openings,
            "convex": corners.convex,
        },
        "walls": {"end_points": walls.end_points},
    }
