"""``contourslam calibrate extrinsics``: where the camera sits beside the lidar."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from contourslam.cli.console import note, print_json, progress
from contourslam.cli.options import Json
from contourslam.errors import ConfigError

if TYPE_CHECKING:
    from contourslam.robot.camera.extrinsics import Extrinsics
    from contourslam.robot.config import CameraPart


@dataclass(frozen=True)
class CalibrateExtrinsics:
    """Find where the camera sits beside the lidar, from a recording in which a checkerboard stands in several places.

    The robot stands still; the board stands or is held before it 15 times or more, some seconds each, tilted
    differently every time, where the lidar's plane cuts it. The camera's place is written into the robot.yaml.

    Example: contourslam calibrate extrinsics out/board --robot robot.yaml --board 9x6 --square 0.05
    """

    recording: tyro.conf.Positional[Path]
    """Recording with scans and pictures."""
    robot: Annotated[Path, tyro.conf.arg(metavar="FILE")]
    """The robot.yaml: lidar's place and camera's lens are read from it, the camera's place is written into it."""
    lens: Annotated[Path | None, tyro.conf.arg(metavar="FILE")] = None
    """File of the lens, where the robot.yaml has none or another."""
    board: str = "9x6"
    """Inner corners of the checkerboard, along and across."""
    square: float = 0.05
    """Side of one square, m."""
    margin: float = 0.0
    """Width of the board around its squares, m; what the lidar sees there counts, too."""
    every: float = 0.5
    """One picture in so many seconds is searched."""
    json: Json = False

    def execute(self, command: str) -> int:
        """Calibrate, and say how well it went."""
        from dataclasses import replace

        from contourslam.recordings import open_recording
        from contourslam.robot.camera.board import Board
        from contourslam.robot.camera.camera_file import load_lens
        from contourslam.robot.camera.extrinsics import find_extrinsics
        from contourslam.robot.camera.opencv import opencv
        from contourslam.robot.camera.stands import find_sights, find_stands
        from contourslam.robot.camera.stored import kept_pictures
        from contourslam.robot.config import CameraPart, load_robot, save_robot

        board = Board.parse(self.board, self.square)
        opencv()
        robot = load_robot(self.robot)
        part = robot.camera
        if self.lens is not None:
            model = load_lens(self.lens)
            part = CameraPart(model=model) if part is None else replace(part, model=model)
        if part is None:
            raise ConfigError(
                f"{self.robot}: holds no lens of the camera; make one with `contourslam calibrate camera`, or name its "
                "file with --lens"
            )
        recording = open_recording(self.recording)
        stamps: list[float] = []

        def noted() -> Any:
            for _, picture in kept_pictures(self.recording, every=self.every):
                stamps.append(picture.stamp)
                yield picture

        sights = list(find_sights(progress(noted(), "picture"), board, part.model))
        stands = find_stands(sights, stamps, recording.messages(), board, part.model)
        found = find_extrinsics(stands, board, margin=self.margin)
        part = part.placed(robot.lidar.place @ found.T_lidar_camera)
        save_robot(self.robot, replace(robot, camera=part), header=command)
        if self.json:
            print_json(_told(found, part) | {"pictures": len(stamps), "with_board": len(sights)})
        else:
            _print(found, part)
            print(f"{self.robot}: the camera's place is written")
        for text in found.warnings:
            note(text)
        return 0


def _told(found: "Extrinsics", part: "CameraPart") -> dict[str, Any]:
    names = ("x", "y", "z", "roll_deg", "pitch_deg", "yaw_deg")
    return {
        "T_lidar_camera": found.T_lidar_camera.tolist(),
        "covariance": found.covariance.tolist(),
        "camera": {name: getattr(part, name) for name in names},
        "rms": found.rms,
        "sigma_position": found.sigma_position,
        "sigma_turn_deg": found.sigma_turn_deg,
        "stands": [{"name": stand.name, "points": stand.points, "rms": stand.rms} for stand in found.stands],
        "warnings": found.warnings,
    }


def _print(found: "Extrinsics", part: "CameraPart") -> None:
    for stand in found.stands:
        text = f"{stand.points:5} points, {1000.0 * stand.rms:5.1f} mm off" if stand.points else "left out"
        print(f"board {stand.name:<16} {text}")
    print(f"camera on the robot:  x {part.x:.3f} m, y {part.y:.3f} m, z {part.z:.3f} m")
    print(f"                      roll {part.roll_deg:.2f}, pitch {part.pitch_deg:.2f}, yaw {part.yaw_deg:.2f} degrees")
    print(f"known to:             {1000.0 * found.sigma_position:.1f} mm and {found.sigma_turn_deg:.2f} degrees, "
          "beside the lidar")  # fmt: skip
    print(f"points off boards:    {1000.0 * found.rms:.1f} mm r.m.s.")
