"""``contourslam view``: a recording mapped before one's eyes, in a browser."""

import time
import webbrowser
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from contourslam.cli.console import complain, note
from contourslam.cli.interrupt import Interrupt
from contourslam.cli.options import Flag, Settings
from contourslam.cli.run import DEFAULTS
from contourslam.errors import ConfigError, MissingExtraError, RecordingError

if TYPE_CHECKING:
    from contourslam.recordings import Message, Recording
    from contourslam.view.player import Player

_LOOK = 0.1  # s between two looks at Ctrl-C


@dataclass(frozen=True)
class View:
    """Map a recording in a browser: map, scan, detector responses, loops and uncertainty, at any speed.

    The page is served on this machine alone, until Ctrl-C. With --host others can open it too, by a link with a secret
    in it. It loads nothing from elsewhere. Pause, step and drag the time line back to any moment; click a corner to see
    its history. With --detectors up to four detectors map the recording side by side.

    Example: contourslam view intel.log.xz --speed 10 --detectors matched_filter,wu
    """

    recording: tyro.conf.Positional[Path]
    """Recording to map: a file, or the folder of a rosbag2."""
    detectors: Annotated[str, tyro.conf.arg(metavar="A,B,...")] = ""
    """Detectors side by side, up to four, by commas; --detector alone where left out."""
    speed: float = 1.0
    """Seconds of the recording per second; inf for as fast as possible. The page can change it."""
    paused: Flag = False
    """Wait until somebody presses play."""
    host: str = "127.0.0.1"
    """Address to serve the page at; 0.0.0.0 for the whole network."""
    port: int = 8642
    """Port to serve the page at; 0 for any that is free."""
    browser: Flag = False
    """Open the page in this machine's browser."""
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
        from contourslam.recordings import open_recording

        if not self.speed > 0.0:
            raise ConfigError(f"--speed must be above 0, got {self.speed}")
        if not 0 <= self.port < 65536:
            raise ConfigError(f"--port must lie between 0 and 65535, got {self.port}")
        try:
            from contourslam.view.access import is_loopback, new_token
            from contourslam.view.pace import Pace
            from contourslam.view.replayed import Replayed
            from contourslam.view.server import ViewServer
        except ModuleNotFoundError as error:
            if error.name is None or error.name.partition(".")[0] != "websockets":
                raise
            raise MissingExtraError(
                "websockets serves the page and is not installed: pip install 'contourslam[view]'"
            ) from error

        recording = open_recording(
            self.recording,
            scan_topic=self.scan_topic,
            odometry_topic=self.odometry_topic,
            truth_topic=self.truth_topic,
        )
        pace = Pace(self.speed, paused=self.paused)
        replayed = Replayed(
            self._messages(recording),
            self.settings,
            [name.strip() for name in self.detectors.split(",") if name.strip()],
            title=self.recording.name,
            duration=recording.duration,
            lidar_mount=recording.lidar_mount,
            pace=pace,
        )
        token = "" if is_loopback(self.host) else new_token()
        server = ViewServer(replayed.show, host=self.host, port=self.port, token=token, lag=replayed.lag)
        player = replayed.player
        with Interrupt() as interrupt, server:
            print(server.url, flush=True)
            note("open this page in a browser; Ctrl-C ends it" + (", others need the whole link" if token else ""))
            if self.browser:
                webbrowser.open(server.url)
            player.start()
            while not interrupt.requested and player.is_alive():
                player.join(_LOOK)
            _tell(player)
            while not interrupt.requested:  # all that was mapped can be looked at until somebody has seen enough
                time.sleep(_LOOK)
            pace.stop()
            player.join()
        return 1 if player.trouble else 0

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
