"""``contourslam simulate``: a robot drives through a room, and its recording."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from contourslam.cli.console import Bar, chosen, make_way, note, print_json
from contourslam.cli.options import Flag, Json, Overwrite


@dataclass(frozen=True)
class Simulate:
    """Simulate a robot in a room and record it: scans, wheel odometry and true poses.

    The recording is a rosbag2 folder with an MCAP file, which ROS 2 and Foxglove read. The same room, options and seed
    give the same recording.

    Example: contourslam simulate --room furnished_room --seed 1 --camera -o out/room
    """

    output: Annotated[Path, tyro.conf.arg(aliases=["-o"], metavar="DIR")]
    """Folder of the recording to write."""
    overwrite: Overwrite = False
    room: str = "furnished_room"
    """Room to drive through: furnished_room, office_corridor, large_hall or office_building."""
    seed: int = 0
    """Seed of everything that chance decides: start, friction, odometry, noise."""
    duration: float | None = None
    """Length of the drive, s; two laps where left out, 180 s at least."""
    speed: float = 0.4
    """Cruising speed, m/s."""
    lidar: str = "paper"
    """Lidar: paper (500 beams at 10 Hz) or ydlidar_x4 (varying beams, drop-outs)."""
    noise: float | None = None
    """Standard deviation of every range, m, in place of the lidar's own noise."""
    camera: Flag = False
    """Also record pictures of a fisheye camera, 640 by 640 pixels, 220 degrees; the drive stays the same."""
    camera_rate: float = 2.0
    """Pictures per second; each takes about 0.1 s of computing and 70 kB."""
    picture: Path | None = None
    """Also render the room into this PNG file."""
    json: Json = False

    def execute(self, command: str) -> int:
        """Simulate, record and say what was written."""
        from contourslam.recordings import write_recording
        from contourslam.simulation.camera import FisheyeCamera
        from contourslam.simulation.config import LIDARS, CameraModel, SimulationConfig
        from contourslam.simulation.filming import film
        from contourslam.simulation.picture import render_room
        from contourslam.simulation.rooms import ROOMS
        from contourslam.simulation.simulate import simulate

        room = chosen("room", self.room, ROOMS)
        config = SimulationConfig(
            duration=self.duration, speed=self.speed, noise=self.noise, lidar=chosen("lidar", self.lidar, LIDARS)
        )
        pictures = 0
        if self.camera:
            if not self.overwrite:
                make_way(self.output, overwrite=False)
            with FisheyeCamera(room, CameraModel(rate=self.camera_rate), robot=config.robot, seed=self.seed) as camera:
                camera.open()  # what is missing is told before the drive, and before a recording is replaced
                make_way(self.output, overwrite=self.overwrite)
                with Bar("simulating") as bar:
                    run = simulate(room, config, self.seed, progress=bar.to)
                with Bar("taking pictures") as bar:
                    filmed = film(run, camera, progress=bar.to)
                    seen = camera.model, camera.T_base_camera
                    write_recording(self.output, filmed, lidar_mount=run.lidar_place, camera=seen)
                pictures = camera.taken
        else:
            make_way(self.output, overwrite=self.overwrite)
            with Bar("simulating") as bar:
                run = simulate(room, config, self.seed, progress=bar.to)
            write_recording(self.output, run.messages(), lidar_mount=run.lidar_place)
        if self.picture is not None:
            render_room(room, self.picture)
        seconds = float(run.odometry.stamps[-1])
        if self.json:
            said = {"recording": str(self.output), "room": room.name, "scans": len(run.scans), "seconds": seconds}
            print_json({**said, "pictures": pictures} if self.camera else said)
        else:
            shown = f", {pictures} pictures" if self.camera else ""
            print(f"{self.output}: {len(run.scans)} scans{shown}, {seconds:.0f} s in {room.name}")
            note(f"map it with: contourslam run {self.output} -o out")
        return 0
