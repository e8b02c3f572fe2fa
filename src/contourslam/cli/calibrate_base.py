"""``contourslam calibrate base``: wheel radii and wheel base, from a drive."""

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from contourslam.cli.console import note, print_json, progress
from contourslam.cli.options import Json
from contourslam.errors import ConfigError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from contourslam.recordings import Recording
    from contourslam.robot.base.calibration import BaseCalibration


@dataclass(frozen=True)
class CalibrateBase:
    """Find the radii of both wheels and the wheel base from a recorded drive of a few minutes.

    The recording is mapped, and the wheels' angles (/joint_states, or else what /odom was made of) are held against the
    way that SLAM found. Drive through a room with walls on all sides, with curves to both sides.

    Example: contourslam calibrate base out/drive -o robot.yaml
    """

    recording: tyro.conf.Positional[Path]
    """Recording with scans, and wheel angles or wheel odometry."""
    robot: Annotated[Path | None, tyro.conf.arg(metavar="FILE")] = None
    """The robot.yaml that the drive was made with; by default what -o names where it is there, else the defaults."""
    output: Annotated[Path | None, tyro.conf.arg(aliases=["-o"], metavar="FILE")] = None
    """The robot.yaml to write radii and wheel base into; all else in it is kept. Nothing is written where left out."""
    trajectory: Annotated[Path | None, tyro.conf.arg(metavar="FILE")] = None
    """Poses of an earlier run on this recording, its trajectory.tum, in place of mapping it again."""
    json: Json = False

    def execute(self, command: str) -> int:
        """Calibrate, and say how well it went."""
        from contourslam.recordings import open_recording
        from contourslam.robot.base.calibration import calibrate
        from contourslam.robot.base.wheel_track import read_track
        from contourslam.robot.config import RobotConfig, load_robot, save_robot

        known = self.robot or (self.output if self.output is not None and self.output.exists() else None)
        robot = RobotConfig() if known is None else load_robot(known)
        recording = open_recording(self.recording)
        track = read_track(recording, robot.base)
        mount = recording.lidar_mount or robot.lidar.mount
        stamps, poses = self._way(recording, mount)
        found = calibrate(stamps, poses, track, robot.base, mount)
        if self.output is not None:
            header = f"{command}\nradii and wheel base from {found.distance:.0f} m, {found.pieces} pieces of way"
            save_robot(self.output, replace(robot, base=found.base), header=header)
        if self.json:
            print_json(_told(found, track.source, self.output))
        else:
            _print(found, track.source)
            if self.output is not None:
                print(f"{self.output}: written")
        for text in found.warnings:
            note(text)
        return 0

    def _way(
        self, recording: "Recording", mount: tuple[float, float, float]
    ) -> "tuple[NDArray[np.float64], NDArray[np.float64]]":
        """Stamps and poses as SLAM finds them, or found them before."""
        from contourslam.cli.run import DEFAULTS
        from contourslam.recordings import read_trajectory
        from contourslam.replay import replay
        from contourslam.scan import TruePose

        if self.trajectory is not None:
            return read_trajectory(self.trajectory)
        messages = (message for message in recording.messages() if not isinstance(message, TruePose))
        result = replay(progress(messages, "message"), DEFAULTS, lidar_mount=mount)
        if not result.complete:
            raise ConfigError(f"{self.recording}: was not mapped to its end ({', '.join(result.skipped)})")
        return result.stamps, result.poses


def _told(found: "BaseCalibration", source: str, output: Path | None) -> dict[str, Any]:
    return {
        "left_radius": found.base.left_radius,
        "right_radius": found.base.right_radius,
        "wheel_base": found.base.wheel_base,
        "sigmas": found.sigmas.tolist(),
        "covariance": found.covariance.tolist(),
        "lag": found.lag,
        "lidar_shift": found.lidar_shift.tolist(),
        "lidar_sigmas": found.lidar_sigmas.tolist(),
        "before": {"way": found.before.way, "turn": found.before.turn},
        "after": {"way": found.after.way, "turn": found.after.turn},
        "pieces": found.pieces,
        "distance": found.distance,
        "left_turn": found.left_turn,
        "right_turn": found.right_turn,
        "wheels_from": source,
        "warnings": list(found.warnings),
        "output": None if output is None else str(output),
    }


def _print(found: "BaseCalibration", source: str) -> None:
    base, sigmas = found.base, found.sigmas
    print(f"drive:         {found.distance:.1f} m, {math.degrees(found.left_turn):.0f} degrees to the left, ", end="")
    print(f"{math.degrees(found.right_turn):.0f} to the right; wheels from {source}")
    for name, value, sigma in zip(
        ("left radius", "right radius", "wheel base"),
        (base.left_radius, base.right_radius, base.wheel_base),
        sigmas.tolist(),
        strict=True,
    ):
        print(f"{name + ':':<14} {1000.0 * value:.2f} mm, known to {sigma:.2%}")
    before, after = found.before, found.after
    print(
        f"per piece:     {1000.0 * before.way:.1f} mm and {math.degrees(before.turn):.2f} degrees off SLAM before, ",
        end="",
    )
    print(f"{1000.0 * after.way:.1f} mm and {math.degrees(after.turn):.2f} degrees now ({found.pieces} pieces)")
    x, y, yaw = found.lidar_shift.tolist()
    sx, sy, syaw = found.lidar_sigmas.tolist()
    print(
        f"lidar:         {1000.0 * x:+.0f} mm ahead of where it was said to sit (known to {1000.0 * sx:.0f}), ", end=""
    )
    print(f"{1000.0 * y:+.0f} mm to the left ({1000.0 * sy:.0f}), ", end="")
    print(f"turned by {math.degrees(yaw):+.2f} degrees ({math.degrees(syaw):.2f})")
