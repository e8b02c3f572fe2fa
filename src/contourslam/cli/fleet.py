"""``contourslam fleet``: several robots' recordings played side by side to one server."""

import math
import re
import shlex
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import tyro

from contourslam.cli.console import complain, keep_apart, note, prepare_folder, print_json, progress
from contourslam.cli.interrupt import INTERRUPTED, Interrupt, UntilStopped
from contourslam.cli.locate import UNSURE
from contourslam.cli.options import Json, Output, Overwrite, Settings
from contourslam.cli.reading import Opening
from contourslam.cli.run import DEFAULTS
from contourslam.errors import ConfigError, RecordingError

if TYPE_CHECKING:
    from contourslam.fleet.play_robot import Message, Player
    from contourslam.recordings import Recording


@dataclass(frozen=True)
class Fleet:
    """Play the recordings of several robots side by side, each mapping for itself, to a server that joins them.

    Each recording begins at the same time, whatever its stamps. Each robot tells the server what it learned, in the
    bytes that it would send over the air, and is told where it is in the common map once the server has found that its
    map and another one overlap. --loss, --delay and --repeat make the air bad; --restart-robot and --restart-server let
    a program die and begin anew: the robot's without its map and what it had not sent, the server's with what it kept.

    The folder gets index.html (a page about the fleet), metrics.json, each common map (common1.cmap) with a picture,
    and of each robot its trajectory in the common map, as it is known at the end and as it was known at the time.

    Where common maps stay apart the reason is told and the exit code is 3. A robot whose recording is damaged stops
    there and the others go on; the exit code is 1 then, and 130 after Ctrl-C, which keeps what was played.

    Example: contourslam fleet out/office/robot1 out/office/robot2 out/office/robot3 -o out/fleet
    """

    recordings: tyro.conf.Positional[tuple[Path, ...]]
    """Recordings to play, one of each robot: files, or folders of a rosbag2."""
    output: Output
    overwrite: Overwrite = False
    loss: float = 0.0
    """Part of the messages that is lost, both ways."""
    delay: float = 0.0
    """Seconds that a message takes at most; each takes its own time."""
    repeat: float = 0.0
    """Part of the messages that arrives twice."""
    seed: int = 0
    """Seed of everything that chance decides."""
    restart_robot: float | None = None
    """Seconds after which the first robot's program begins anew, knowing nothing."""
    restart_server: float | None = None
    """Seconds after which the server's program begins anew, from what it has kept."""
    json: Json = False
    settings: Settings = field(default_factory=lambda: DEFAULTS)

    def execute(self, command: str) -> int:
        """Play the recordings, write the folder and say how it went."""
        from contourslam.fleet.channel import Air
        from contourslam.fleet.play import play
        from contourslam.fleet.play_apart import why_apart
        from contourslam.recordings import open_recording
        from contourslam.report.fleet_folder import write_fleet_folder

        self._check()
        names = _names(self.recordings)
        air = Air(self.loss, self.delay, self.repeat)
        recordings = [open_recording(path) for path in self.recordings]
        server_restarts = () if self.restart_server is None else (self.restart_server,)
        with Interrupt() as interrupt, TemporaryDirectory() as kept:
            sources = [UntilStopped(recording.messages(), interrupt) for recording in recordings]
            openings = [Opening(iter(source)) for source in sources]
            if interrupt.requested:
                raise KeyboardInterrupt
            _refuse_empty(self.recordings, openings, sources)
            prepare_folder(self.output, overwrite=self.overwrite)
            for name, recording in zip(names, recordings, strict=True):
                for text in recording.notes:
                    note(f"{name}: {text}")
            fleet = play(
                self._players(names, recordings, openings),
                self.settings,
                air,
                seed=self.seed,
                folder=Path(kept) if server_restarts else None,
                server_restarts=server_restarts,
            )
            fleet = replace(fleet, complete=fleet.complete and not interrupt.requested)
            apart = list(UntilStopped(progress(why_apart(fleet.maps), "pair of maps"), interrupt))
        if interrupt.requested and not any(robot.told for robot in fleet.robots):
            raise KeyboardInterrupt
        if self.restart_robot is not None and not fleet.robots[0].restarts:
            note(f"--restart-robot {self.restart_robot:g}: the first robot's recording had ended by then")
        if self.restart_server is not None and not fleet.restarts:
            note(f"--restart-server {self.restart_server:g}: the fleet had ended by then")
        metrics = write_fleet_folder(self.output, fleet, apart, command=command)
        if self.json:
            print_json(metrics)
        else:
            _tell(metrics, self.output)
        damaged = [robot for robot in fleet.robots if robot.damage]
        for robot in damaged:
            complain(f"{robot.name}: {robot.damage}; the {len(robot.told)} scans before it are in {self.output}")
        if damaged:
            return 1
        if interrupt.requested:
            complain(f"interrupted; what was played until then is in {self.output}")
            return INTERRUPTED
        return UNSURE if len(fleet.maps) > 1 else 0

    def _check(self) -> None:
        """Refuse what cannot be meant."""
        for path in self.recordings:
            inside = sorted(each.parent for each in path.glob("*/metadata.yaml"))
            if inside and not (path / "metadata.yaml").is_file():
                every = shlex.join(map(str, inside))
                raise ConfigError(
                    f"{path} is no recording but a folder of {len(inside)}; name them: contourslam fleet {every} "
                    f"-o {shlex.quote(str(self.output))}"
                )
        if len(self.recordings) < 2:
            raise ConfigError("a fleet is two robots or more: name two recordings or more")
        if self.settings.back_end != "graph":
            raise ConfigError(
                "robots of a fleet map with the graph: leave --back-end away, and install contourslam[graph]"
            )
        for option, after in (("--restart-robot", self.restart_robot), ("--restart-server", self.restart_server)):
            if after is not None and not 0.0 < after < math.inf:
                raise ConfigError(f"{option} {after:g}: a program begins anew some seconds after the begin, above 0")
        keep_apart(self.output, self.recordings)

    def _players(self, names: list[str], recordings: "list[Recording]", openings: list[Opening]) -> "list[Player]":
        import numpy as np

        from contourslam.fleet.play_robot import Player

        players = []
        for number, (name, recording, opening) in enumerate(zip(names, recordings, openings, strict=True)):
            mount = None if recording.lidar_mount is None else np.array(recording.lidar_mount, np.float64)
            restarts = () if self.restart_robot is None or number else (self.restart_robot,)
            # One bar is enough: the others are played beside the first.
            shown = opening.whole() if number else progress(opening.whole(), "message of the first robot")
            players.append(Player(name, shown, mount, restarts))
        return players


def _refuse_empty(paths: tuple[Path, ...], openings: list[Opening], sources: "list[UntilStopped[Message]]") -> None:
    """Refuse recordings of which nothing can be mapped, before anything is played."""
    for path, opening, source in zip(paths, openings, sources, strict=True):
        if not opening.scans:
            why = str(source.error) if source.error is not None else f"{path}: holds no scan"
            raise RecordingError(f"{why}; nothing of it can be mapped: leave this recording away")


def _names(paths: tuple[Path, ...]) -> list[str]:
    """Give short names that tell the recordings apart and may travel."""
    from contourslam.report.runs_reading import distinct_names

    names = [re.sub(r"[^A-Za-z0-9_.-]+", "-", name).strip("-.") or "robot" for name in distinct_names(list(paths))]
    return [name if names.count(name) == 1 else f"{name}-{number}" for number, name in enumerate(names, 1)]


def _tell(metrics: dict[str, Any], folder: Path) -> None:
    """Print what came out."""
    from contourslam.report.joints import apart_in_words, evidence_in_words

    for event in metrics["joined"]:
        print(
            f"{event['time']:.1f} s: {', '.join(event['members'])} joined with {', '.join(event['joining'])} by "
            f"{event['method']}: {evidence_in_words(event)}"
        )
    for one in metrics["maps"]:
        print(
            f"{folder}/common{one['common']}.cmap: {', '.join(one['members'])}; {one['keyframes']} keyframes, "
            f"{one['corners']} corners, {one['walls']} walls"
        )
    members = {one["common"]: ", ".join(one["members"]) for one in metrics["maps"]}
    for each in metrics["apart"]:
        who = " and ".join(f"common{number} ({members[number]})" for number in each["maps"])
        print(f"{who} stay apart, {apart_in_words(each)}")
        if each["reason"] == "enough to merge":
            files = shlex.join(f"{folder}/common{number}.cmap" for number in each["maps"])
            note(f"merge them with: contourslam merge {files} -o {folder}/merged.cmap")
    for robot in metrics["robots"]:
        print(f"{robot['name']}: {robot['messages']} messages, {robot['bytes_per_second']:.0f} bytes/s", end="")
        if robot["rmse"] is None:
            print()
            continue
        online = "-" if robot["online_rmse"] is None else f"{robot['online_rmse']:.4f} m"
        print(
            f"; RMSE in the common frame {robot['rmse']:.4f} m, as known at the time (online) {online}, raw odometry "
            f"{robot['odometry_rmse']:.3f} m"
        )
    for fault in metrics["faults"]:
        note(f"{fault['robot'] or 'server'}: {fault['text']}")
