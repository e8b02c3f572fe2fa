"""``contourslam view``: a recording mapped before one's eyes, in a browser, or a robot while it maps."""

import time
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from contourslam.cli.console import complain
from contourslam.cli.interrupt import Interrupt
from contourslam.cli.options import Flag, Settings
from contourslam.cli.run import DEFAULTS
from contourslam.cli.serving import Page, print_link
from contourslam.errors import ConfigError, RecordingError

if TYPE_CHECKING:
    from contourslam.recordings import Message, Recording
    from contourslam.view.player import Player
    from contourslam.view.rerun_watch import Logged

_LOOK = 0.1  # s between two looks at Ctrl-C


@dataclass(frozen=True)
class View:
    """Map a recording or a robot's surroundings in a browser: map, scan, detector responses, loops and uncertainty.

    The page is served on this machine alone, until Ctrl-C. With --host others can open it too, by a link with a secret
    in it. It loads nothing from elsewhere. A recording is mapped at any speed: pause, step and drag the time line back
    to any moment; click a corner to see its history. With --detectors up to four detectors map it side by side.

    With --live the robot's lidar and base are brought up instead, and what they see is mapped while somebody pushes the
    robot or carries the lidar (--ignore-odometry). Nothing drives and nothing is kept: `contourslam drive --view` does
    both, and with neither --route nor --keys it only keeps.

    Example: contourslam view intel.log.xz --speed 10 --detectors matched_filter,wu
    """

    recording: tyro.conf.Positional[Path | None] = None
    """Recording to map: a file, or the folder of a rosbag2."""
    live: Flag = False
    """Map what the robot sees now, instead of a recording."""
    robot: Path | None = None
    """With --live, how the robot is built: a robot.yaml; the defaults where left out, ports found by themselves."""
    detectors: Annotated[str, tyro.conf.arg(metavar="A,B,...")] = ""
    """Detectors side by side, up to four, by commas; --detector alone where left out."""
    speed: float = 1.0
    """Seconds of the recording per second; inf for as fast as possible. The page can change it."""
    paused: Flag = False
    """Wait until somebody presses play."""
    rerun: Annotated[Path | None, tyro.conf.arg(metavar="FILE.rrd")] = None
    """Log the mapping scan by scan into this file too, for the Rerun viewer."""
    overwrite: Flag = False
    """With --rerun, replace a file that is there."""
    page: Page = field(default_factory=Page)
    scan_topic: str | None = None
    """Topic of the scans; found by itself where there is only one."""
    odometry_topic: str | None = None
    """Topic of the wheel odometry; found by itself where there is only one."""
    truth_topic: str | None = None
    """Topic of the true poses."""
    ignore_odometry: Flag = False
    """Go by the scans alone, as if the robot had no wheel odometry."""
    settings: Settings = field(default_factory=lambda: DEFAULTS)

    def execute(self, command: str) -> int:
        """Serve the page until Ctrl-C."""
        self._check()
        if self.live:
            from contourslam.cli.watching import watch_robot

            return watch_robot(self.robot, self.settings, self.page, with_base=not self.ignore_odometry)
        assert self.recording is not None
        return self._replay(self.recording)

    def _check(self) -> None:
        if (self.recording is None) is not self.live:
            wrong = "a recording and --live do not go together" if self.live else "there is nothing to map"
            raise ConfigError(f"{wrong}; name a recording, or --live for the robot")
        if self.robot is not None and not self.live:
            raise ConfigError("--robot says how the robot of --live is built; leave it out for a recording")
        topics = {
            "--scan-topic": self.scan_topic,
            "--odometry-topic": self.odometry_topic,
            "--truth-topic": self.truth_topic,
        }
        of_recordings = {
            "--detectors": self.detectors, "--paused": self.paused, "--speed": self.speed != 1.0,
            "--rerun": self.rerun, "--overwrite": self.overwrite, **topics
        }  # fmt: skip
        if self.live and (given := [name for name, value in of_recordings.items() if value]):
            raise ConfigError(f"{' and '.join(given)} are for recordings; leave them out with --live")
        if self.overwrite and self.rerun is None:
            raise ConfigError("--overwrite replaces the file of --rerun; leave it out without one")
        if not self.speed > 0.0:
            raise ConfigError(f"--speed must be above 0, got {self.speed}")
        self.page.check()

    def _replay(self, path: Path) -> int:
        from contourslam.recordings import open_recording
        from contourslam.view.pace import Pace
        from contourslam.view.replayed import Replayed

        recording = open_recording(
            path,
            scan_topic=self.scan_topic,
            odometry_topic=self.odometry_topic,
            truth_topic=self.truth_topic,
        )
        pace = Pace(self.speed, paused=self.paused)
        names = [name.strip() for name in self.detectors.split(",") if name.strip()]
        replayed = Replayed(
            self._messages(recording),
            self.settings,
            names,
            title=path.name,
            duration=recording.duration,
            lidar_mount=recording.lidar_mount,
            pace=pace,
        )
        player = replayed.player
        if self.rerun is not None:
            self._check_rerun(self.rerun)
        with ExitStack() as stack:
            interrupt = stack.enter_context(Interrupt())
            stack.enter_context(self.page.served(replayed.show, replayed.lag, print_link))
            logged = None
            if self.rerun is not None:  # now that all else is known to work: it takes an earlier file away
                logged = self._logged(self.rerun, path.name, names)
                player.on_moment = logged.take
            player.start()
            while not interrupt.requested and player.is_alive():
                player.join(_LOOK)
            if interrupt.requested:
                pace.stop()
                player.join()
            unlogged = "" if logged is None else logged.finish(recording.skipped, trouble=player.trouble)
            if unlogged:
                complain(unlogged)
            _tell(player)
            while not interrupt.requested:  # all that was mapped can be looked at until somebody has seen enough
                time.sleep(_LOOK)
            pace.stop()
            player.join()
        return 1 if player.trouble or unlogged else 0

    def _check_rerun(self, file: Path) -> None:
        from contourslam.view.rerun_file import check_writable

        check_writable(file, overwrite=self.overwrite)

    def _logged(self, file: Path, title: str, names: list[str]) -> "Logged":
        from contourslam.view.rerun_watch import Logged, open_log

        lanes = names or [self.settings.detector]
        return Logged(open_log(file, title, self.settings, lanes, overwrite=self.overwrite))

    def _messages(self, recording: "Recording") -> "Iterator[Message]":
        from contourslam.scan import Odometry

        for message in recording.messages():
            if not (self.ignore_odometry and isinstance(message, Odometry)):
                yield message


def _tell(player: "Player") -> None:
    """Say what ended the player early, if anything did."""
    if player.error is not None:
        raise player.error
    if player.trouble and not player.lanes:
        raise RecordingError(player.trouble)
    if player.trouble:
        complain(f"{player.trouble}; what came before it can still be looked at")
