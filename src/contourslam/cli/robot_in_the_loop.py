"""``contourslam robot-in-the-loop``: the whole robot at real time, its devices simulated."""

from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path

from contourslam.cli.console import Bar, complain, make_way, prepare_folder, print_json
from contourslam.cli.interrupt import INTERRUPTED, Interrupt
from contourslam.cli.options import Flag, Json, Output, Overwrite, Settings
from contourslam.cli.run import DEFAULTS
from contourslam.cli.serving import Watched


@dataclass(frozen=True)
class RobotInTheLoop:
    """Let the robot drive at real time with its real drivers, firmware and mapping; the world around is simulated.

    A room in MuJoCo feeds a simulated YDLidar X4 and a simulated Arduino Mega that runs the real firmware, each on a
    serial port; `make firmware` builds the two programs. The folder gets a page, the run, and the recording. The exit
    code is 1 where the errors are larger than 3 cm and 0.01 rad. With --view the drive is watched in a browser.

    Example: contourslam robot-in-the-loop -o out/loop --fault damaged
    """

    output: Output
    overwrite: Overwrite = False
    room: str = "furnished_room"
    """One of the simulated rooms."""
    seed: int = 1
    """Of all that chance decides."""
    seconds: float = 100.0
    """How long it drives, s."""
    fault: str = "none"
    """What goes wrong: none, unplugged (the lidar, for 3 s) or damaged (5 % of all serial bytes)."""
    speed: float = 0.3
    """m/s."""
    pictures: float = 1.0
    """Pictures a second; 0 for no camera."""
    record: Flag = False
    """Also write the recording."""
    firmware: Path = Path("firmware/mega/build")
    """Folder that the firmware and the simulated board are built in."""
    watched: Watched = field(default_factory=Watched)
    json: Json = False
    settings: Settings = field(default_factory=lambda: DEFAULTS)

    def execute(self, command: str) -> int:
        """Drive, write the report and say how it went."""
        from contourslam.experiments.loop_values import Firmware, LoopConfig, fault_named
        from contourslam.experiments.robot_in_the_loop import robot_config, robot_in_the_loop
        from contourslam.report.loop_page import TARGET, kept, loop_metrics, write_loop_report
        from contourslam.robot.live_map import settings_of

        config = LoopConfig(
            self.seed, self.room, self.seconds, fault_named(self.fault), self.speed, self.pictures, self.settings
        )
        page, built = self.watched.page, Firmware.built_in(self.firmware)
        prepare_folder(self.output, overwrite=self.overwrite)
        recording = self.output / "recording" if self.record else None
        with Interrupt() as interrupt, ExitStack() as stack:
            witness = None
            if page is not None:
                settings = settings_of(robot_config(config, Path(), Path()), self.settings)
                witness = page.witness(stack, settings, self.room.replace("_", " "), driven=True)
            if recording is not None:
                make_way(recording, overwrite=self.overwrite)
            bar = stack.enter_context(Bar("driving"))
            result = robot_in_the_loop(
                config, built, recording=recording, progress=bar.to, stopped=lambda: interrupt.requested,
                witness=witness,
            )  # fmt: skip
        written = write_loop_report(self.output, result, command=command)
        if self.json:
            print_json(loop_metrics(result))
        else:
            online = result.online
            print(
                f"{written}: {len(result.run.stamps)} scans, {result.travelled:.1f} m, {result.picture_count} pictures"
            )
            print(
                f"RMSE as known at the time: x {online['x']:.4f} m, y {online['y']:.4f} m, "
                f"heading {online['theta']:.4f} rad"
            )
            print(f"late by more than 20 ms: {result.late:.2%} of the world's steps")
        if interrupt.requested:
            complain("interrupted; the page shows what was done")
            return INTERRUPTED
        if not kept(result):
            complain(f"the errors are larger than {TARGET['x']} m or {TARGET['theta']} rad")
            return 1
        return 0
