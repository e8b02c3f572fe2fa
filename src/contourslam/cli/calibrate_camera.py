"""``contourslam calibrate camera``: the lens of a fisheye camera, from pictures of a checkerboard."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from contourslam.cli.console import make_way, note, print_json, progress
from contourslam.cli.options import Json, Overwrite

if TYPE_CHECKING:
    from contourslam.robot.camera.from_pictures import PicturesCalibrated


@dataclass(frozen=True)
class CalibrateCamera:
    """Calibrate the lens of a fisheye camera from pictures of a checkerboard.

    20 to 40 sharp pictures, the whole board in sight, all over the picture out to its rim, and tilted; docs/camera.md
    tells more. Beside the file of the lens stands a picture of what is left over at each corner.

    Example: contourslam calibrate camera out/pictures --board 9x6 --square 0.025 -o camera.yaml
    """

    pictures: tyro.conf.Positional[Path]
    """Folder of JPEG and PNG files, or a recording that holds pictures."""
    output: Annotated[Path, tyro.conf.arg(aliases=["-o"], metavar="FILE")]
    """File of the lens to write."""
    overwrite: Overwrite = False
    board: str = "9x6"
    """Inner corners of the checkerboard, along and across."""
    square: float = 0.025
    """Side of one square, m."""
    field_of_view: float = 220.0
    """Full angle of the cone that the lens sees, degrees."""
    every: float = 1.0
    """Of a recording, one picture in so many seconds is used."""
    robot: Annotated[Path | None, tyro.conf.arg(metavar="FILE")] = None
    """A robot.yaml to write the lens into, too; made where it is missing."""
    json: Json = False

    def execute(self, command: str) -> int:
        """Calibrate, and say how well it went."""
        from dataclasses import replace

        from contourslam.atomic import write_bytes
        from contourslam.robot.camera.board import Board
        from contourslam.robot.camera.camera_file import save_lens
        from contourslam.robot.camera.from_pictures import calibrate_from_pictures
        from contourslam.robot.camera.opencv import opencv
        from contourslam.robot.camera.residual_picture import residual_picture
        from contourslam.robot.camera.stored import kept_pictures
        from contourslam.robot.config import CameraPart, RobotConfig, load_robot, save_robot

        board = Board.parse(self.board, self.square)
        opencv()
        robot = None  # read first, so that what is wrong with it is told before the work
        if self.robot is not None:
            robot = load_robot(self.robot) if self.robot.exists() else RobotConfig()
        make_way(self.output, overwrite=self.overwrite)
        pictures = progress(kept_pictures(self.pictures, every=self.every), "picture")
        done = calibrate_from_pictures(pictures, board, field_of_view_deg=self.field_of_view)
        found = done.calibration
        used = sum(view.used for view in found.views)
        save_lens(self.output, found.model, header=f"{command}\n{found.rms:.3f} pixels r.m.s. over {used} pictures")
        drawn = self.output.with_name(f"{self.output.stem}_residuals.png")
        write_bytes(drawn, residual_picture(found))
        if self.robot is not None and robot is not None:
            camera = CameraPart(model=found.model) if robot.camera is None else replace(robot.camera, model=found.model)
            save_robot(self.robot, replace(robot, camera=camera), header=command)
        if self.json:
            print_json(_told(done, self.output))
        else:
            _print(done)
            print(f"{self.output}: the lens; {drawn}: what is left over at each corner")
        for text in found.warnings:
            note(text)
        return 0


def _told(done: "PicturesCalibrated", output: Path) -> dict[str, Any]:
    from dataclasses import asdict

    found = done.calibration
    return {
        "lens": str(output),
        "model": asdict(found.model),
        "rms": found.rms,
        "pictures": [
            {"name": view.name, "used": view.used, "rms": view.rms, "angles_deg": view.angles_deg}
            for view in found.views
        ],
        "without_board": done.without_board,
        "damaged": done.damaged,
        "repeated": done.repeated,
        "ring_corners": found.ring_corners,
        "ring_sigma_deg": found.ring_sigma_deg,
        "warnings": found.warnings,
    }


def _print(done: "PicturesCalibrated") -> None:
    found = done.calibration
    width = max(len(view.name) for view in found.views)
    for view in found.views:
        low, high = view.angles_deg
        left_out = "" if view.used else "  left out"
        print(f"{view.name:<{width}}  {view.rms:6.3f} pixels, {low:3.0f} to {high:3.0f} degrees off the axis{left_out}")
    for what, names in (("no board", done.without_board), ("damaged", done.damaged), ("repeated", done.repeated)):
        if names:
            print(f"{what + ':':<14}{', '.join(names)}")
    print("degrees off the axis, corners seen there, and how well a ray is known:")
    for ring, (count, sigma) in enumerate(zip(found.ring_corners, found.ring_sigma_deg, strict=True)):
        print(f"  {ring * 10:3} to {ring * 10 + 10:3}  {count:6}  {sigma:.3f} degrees")
    used = sum(view.used for view in found.views)
    print(f"reprojection:  {found.rms:.3f} pixels r.m.s. over {used} pictures")
