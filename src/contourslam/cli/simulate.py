"""``contourslam simulate``: robots drive through a room, and their recordings."""

import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from contourslam.cli.console import Bar, chosen, complain, make_way, note, print_json, unused_folder
from contourslam.cli.interrupt import INTERRUPTED, Interrupt
from contourslam.cli.options import Flag, Json, Overwrite
from contourslam.errors import ConfigError

if TYPE_CHECKING:
    from contourslam.simulation.buildings import Building
    from contourslam.simulation.config import SimulationConfig
    from contourslam.simulation.room import Room


@dataclass(frozen=True)
class Simulate:
    """Simulate robots in a room and record them: scans, wheel odometry and true poses.

    A recording is a rosbag2 folder with an MCAP file, which ROS 2 and Foxglove read. The same room, options and seed
    give the same recording. Several robots are recorded as DIR/robot1, DIR/robot2 and so on, with one clock and one
    world frame; they see each other, wait for each other, and never touch.

    Example: contourslam simulate --room furnished_room --seed 1 --camera -o out/room
    """

    output: Annotated[Path, tyro.conf.arg(aliases=["-o"], metavar="DIR")]
    """Folder of the recording to write, or of several."""
    overwrite: Overwrite = False
    room: str = "furnished_room"
    """Room to drive through: furnished_room, office_corridor, large_hall or office_building."""
    corridors: int | None = None
    """How many corridors office_building has in each direction, 2 to 40, drawn by seed: room for more robots."""
    robots: int = 1
    """How many robots drive at once."""
    gliding: Flag = False
    """Without physics: robots glide, touch nothing, and see the plane of their lidars; many times faster."""
    seed: int = 0
    """Seed of everything that chance decides: start, friction, odometry, noise."""
    duration: float | None = None
    """Length of the drive, s; where left out, two laps and 180 s at least, or 180 s for several robots."""
    speed: float = 0.4
    """Cruising speed, m/s; of several robots, all but the first are up to a fifth slower."""
    lidar: str = "paper"
    """Lidar: paper (500 beams at 10 Hz) or ydlidar_x4 (varying beams, drop-outs)."""
    noise: float | None = None
    """Standard deviation of every range, m, in place of the lidar's own noise."""
    camera: Flag = False
    """Also record pictures of a fisheye camera, 640 by 640 pixels, 220 degrees; the drive stays the same."""
    camera_rate: float = 2.0
    """Pictures per second; each takes about 0.1 s of computing and 70 kB."""
    picture: Path | None = None
    """Also render the room into this PNG file; with several robots, with all of them and their ways."""
    json: Json = False

    def execute(self, command: str) -> int:
        """Simulate, record and say what was written."""
        from contourslam.simulation.config import LIDARS, SimulationConfig
        from contourslam.simulation.room import Room

        place = self._place()
        room = place if isinstance(place, Room) else place.room
        config = SimulationConfig(
            duration=self.duration, speed=self.speed, noise=self.noise, lidar=chosen("lidar", self.lidar, LIDARS)
        )
        if self.robots == 1 and not self.gliding:
            return self._one(room, config)
        if self.camera:
            raise ConfigError("--camera takes its pictures with one robot only, and not with --gliding; leave one out")
        return self._several(place, room, config)

    def _place(self) -> "Room | Building":
        from contourslam.simulation.buildings import office_building
        from contourslam.simulation.rooms import BUILDINGS, ROOMS

        room = chosen("room", self.room, ROOMS)
        if self.corridors is None:
            return room
        if room.name not in BUILDINGS:
            raise ConfigError(f"--corridors says how large {', '.join(BUILDINGS)} is; {room.name} is as it is")
        return office_building(self.corridors, self.seed)

    def _one(self, room: "Room", config: "SimulationConfig") -> int:
        """One robot, as a whole: its pictures need the whole drive."""
        from contourslam.recordings import write_recording
        from contourslam.simulation.camera import FisheyeCamera
        from contourslam.simulation.config import CameraModel
        from contourslam.simulation.filming import film
        from contourslam.simulation.picture import render_room
        from contourslam.simulation.simulate import simulate

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
            _say_how_to_map([self.output])
        return 0

    def _several(self, place: "Room | Building", room: "Room", config: "SimulationConfig") -> int:
        """Several robots, or some that glide, recorded as they drive."""
        from contourslam.simulation.picture import render_room
        from contourslam.simulation.recorded import record, recording_paths
        from contourslam.simulation.several import SeveralRobots

        robots = SeveralRobots(place, config, self.seed, self.robots, contact_free=self.gliding)
        paths = recording_paths(self.output, self.robots)
        for path in [self.output] if self.robots == 1 else _recordings_in(self.output):
            make_way(path, overwrite=self.overwrite)
        with Interrupt() as interrupt, Bar("simulating") as bar:
            done = record(robots, paths, stopped=lambda: interrupt.requested, progress=bar.to)
        if self.picture is not None:
            render_room(room, self.picture, ways=done.ways)
        if self.json:
            print_json(
                {
                    "recordings": [str(path) for path in paths],
                    "room": room.name,
                    "scans": list(done.scans),
                    "seconds": done.seconds,
                    "complete": done.complete,
                }
            )
        else:
            for path, scans in zip(paths, done.scans, strict=True):
                print(f"{path}: {scans} scans, {done.seconds:.0f} s in {room.name}")
            _say_how_to_map(paths)
        if not done.complete:
            complain(f"interrupted; what is in {self.output} ends after {done.seconds:.1f} s")
            return INTERRUPTED
        return 0


def _say_how_to_map(paths: list[Path]) -> None:
    """Print a command that works as it stands."""
    every = shlex.join(str(path) for path in paths)
    if len(paths) == 1:
        note(f"map it with: contourslam run {every} -o {unused_folder(paths[0], 'map')}")
    else:
        note(f"map them together with: contourslam fleet {every} -o {unused_folder(paths[0].parent, 'fleet')}")


def _recordings_in(folder: Path) -> list[Path]:
    """What is in the way of the recordings of several robots: those of others, and one in the folder itself."""
    if not folder.is_dir() or (folder / "metadata.yaml").is_file():
        return [folder]
    return sorted(path for path in folder.glob("robot*") if path.name.removeprefix("robot").isdecimal())
