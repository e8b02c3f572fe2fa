"""``contourslam drive``: the whole robot, mapping while it drives, without ROS."""

import math
import sys
import time
from collections import Counter
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from contourslam.cli.console import complain, make_way, note, prepare_folder, print_json
from contourslam.cli.interrupt import INTERRUPTED, Interrupt
from contourslam.cli.options import Flag, Json, Output, Overwrite, Patience, Settings
from contourslam.cli.run import DEFAULTS
from contourslam.cli.serving import Watched
from contourslam.cli.watching import tell_trouble
from contourslam.config import Config
from contourslam.errors import ConfigError, RecordingError

if TYPE_CHECKING:
    from contourslam.robot.bring_up import Event, Robot
    from contourslam.robot.journey import Journey, Sight, Steer
    from contourslam.robot.live_map import LiveMap

_REDRAW = 0.25  # s
_STANDS = 2.0  # s at first, in which the gyroscope's bias is found and the map begins


@dataclass(frozen=True)
class Drive:
    """Drive the robot, map live and record: a YDLidar X4, the Mega's base, and a camera where robot.yaml has one.

    The robot follows a route, or the keys: arrows or w a s d drive, q and e in a curve, space stops, x ends. It stops
    0.7 s after the last key. With neither it only maps, while somebody pushes it. It stands still for the first two
    seconds. A route is YAML (waypoints: [[0, 0], [2, 0]], closed: true) or CSV (x, y), in m, from where the robot
    starts, x ahead; it is followed by the pose in the map, and the robot stops where its lidar falls silent.

    The folder gets what `contourslam run` writes, and the recording. The motors are off whenever the command ends. With
    --view the drive is watched in a browser.

    Example: contourslam drive -o out/room --robot robot.yaml --keys
    """

    output: Output
    overwrite: Overwrite = False
    robot: Path | None = None
    """How the robot is built: a robot.yaml; the defaults where left out, ports found by themselves."""
    route: Path | None = None
    """Waypoints to drive along, YAML or CSV."""
    keys: Flag = False
    """Drive by the keys of this terminal."""
    speed: float = 0.25
    """m/s."""
    turn_rate_deg: float = 45.0
    """No faster turn, degrees/s."""
    seconds: float | None = None
    """How long, s; until Ctrl-C, x or the end of the route where left out."""
    picture_rate: float = 2.0
    """Pictures a second, where there is a camera."""
    patience: Patience = 30.0
    watched: Watched = field(default_factory=Watched)
    json: Json = False
    settings: Settings = field(default_factory=lambda: DEFAULTS)

    def execute(self, command: str) -> int:
        """Drive, map, record, and say how it went."""
        from contourslam.live.warming import warm_up
        from contourslam.recordings import RecordingWriter
        from contourslam.robot.bring_up import Robot, Trouble, openers
        from contourslam.robot.config import RobotConfig, load_robot
        from contourslam.robot.journey import Journey
        from contourslam.robot.live_map import PATIENT, LiveMap, settings_of

        self._check()
        page = self.watched.page
        config = RobotConfig() if self.robot is None else load_robot(self.robot)
        settings = settings_of(config, self.settings)
        with ExitStack() as stack:
            steer, ended = self._steering(stack)
            prepare_folder(self.output, overwrite=self.overwrite)
            make = None if page is None else page.witness(stack, settings, self.output.name, driven=True)
            make_way(self.output / "recording", overwrite=self.overwrite)
            note("making ready; the robot must stand still until it drives")
            warm_up(settings)
            interrupt = stack.enter_context(Interrupt())
            robot = Robot(openers(config, patience=self.patience, rate=self.picture_rate))
            witness = None if make is None else make(robot)
            stack.enter_context(robot)
            events = robot.wait_until_ready(interrupt.or_after(None))
            live_map = LiveMap(
                settings, PATIENT, lidar_mount=config.lidar.mount, autosave=self.output / "map.cmap",
                onlooker=None if witness is None else witness.follow,
            )  # fmt: skip
            stack.callback(live_map.close)
            camera = None if config.camera is None else (config.camera.model, config.camera.T_base_camera)
            writer = stack.enter_context(
                RecordingWriter(self.output / "recording", lidar_mount=config.lidar.place, camera=camera)
            )
            status = _Status(robot, live_map)

            def watch(event: "Event") -> None:
                status.show(event)
                if witness is not None:
                    witness.watch(event)

            journey = Journey(robot, live_map, writer, watch=watch)
            for event in events:
                journey.take(event)
            until = interrupt.or_after(self.seconds)
            journey.go(steer, lambda: until() or ended())
            robot.close()
            status.clear()
            live_map.close()
            try:
                writer.close()
            except RecordingError as error:  # what was mapped is written all the same
                journey.troubles.append(Trouble(time.time(), "recording", str(error)))
        if not journey.scans:
            note("no turn of the lidar was completed; there is no map")
            return INTERRUPTED if interrupt.requested else 1
        return self._write(live_map, journey, settings, command)

    def _check(self) -> None:
        if self.route is not None and self.keys:
            raise ConfigError("--route and --keys do not go together; choose one")
        if self.seconds is not None and not self.seconds > 0.0:
            raise ConfigError(f"--seconds must be above 0, got {self.seconds}")
        for name in ("speed", "turn_rate_deg", "picture_rate"):
            if not getattr(self, name) > 0.0:
                raise ConfigError(f"--{name.replace('_', '-')} must be above 0, got {getattr(self, name)}")

    def _steering(self, stack: ExitStack) -> "tuple[Steer, Any]":
        """Give what decides on the twist, and what says that it is over."""
        turn_rate = math.radians(self.turn_rate_deg)
        if self.keys:
            from contourslam.robot.keys import HELP, Keyboard, KeyDriver

            keyboard, driver = stack.enter_context(Keyboard()), KeyDriver(self.speed, turn_rate)
            note(HELP)

            def by_keys(sight: "Sight", dt: float) -> tuple[float, float]:
                driver.press(keyboard.pressed())
                return driver.twist()

            return by_keys, lambda: driver.ended
        if self.route is None:
            return lambda sight, dt: (0.0, 0.0), lambda: False
        from contourslam.robot.pilot import Pilot, PilotConfig
        from contourslam.robot.route import load_route, sample_route

        route = load_route(self.route)
        habits = PilotConfig(speed=self.speed, turn_limit=turn_rate)
        pilot = Pilot(sample_route(route.waypoints, closed=route.closed), closed=route.closed, config=habits)
        stood = 0.0

        def along(sight: "Sight", dt: float) -> tuple[float, float]:
            nonlocal stood
            stood += dt
            if stood < _STANDS:
                return 0.0, 0.0
            return pilot.steer(sight.pose, dt, blind=sight.blind, sigma=sight.sigma)

        return along, lambda: pilot.arrived

    def _write(self, live_map: "LiveMap", journey: "Journey", settings: Config, command: str) -> int:
        from contourslam.evaluation.metrics import run_metrics
        from contourslam.report.result_folder import write_result_folder
        from contourslam.report.run_page import write_run_page

        told = Counter(f"{trouble.part}: {trouble.message}" for trouble in journey.troubles if trouble.message)
        result = live_map.result(dict(told))
        metrics = run_metrics(result)
        write_result_folder(self.output, result, settings, metrics, command=command)
        write_run_page(self.output, result, settings, metrics, command=command, name=self.output.resolve().name)
        live_map.session.save(self.output / "map.cmap")
        unrecorded = [trouble.message for trouble in journey.troubles if trouble.part == "recording"]
        if self.json:
            print_json(metrics)
        else:
            size = metrics["landmarks"]
            recorded = "" if unrecorded else f"; the recording is in {self.output / 'recording'}"
            print(
                f"{self.output}: {journey.scans} scans, {journey.pictures} pictures, {size['corners']} corners, "
                f"{size['walls']} walls, {metrics['loops']} loops{recorded}"
            )
        for message in unrecorded:
            complain(message)
        return 1 if unrecorded else 0


class _Status:
    """A line on a terminal about the robot; elsewhere only what goes wrong is said."""

    def __init__(self, robot: "Robot", live_map: "LiveMap") -> None:
        self._robot, self._map = robot, live_map
        self._live, self._drawn, self._begun = sys.stderr.isatty(), 0.0, time.monotonic()

    def show(self, event: "Event") -> None:
        """Say what is new."""
        from contourslam.robot.bring_up import Trouble

        if isinstance(event, Trouble):
            self.clear()
            tell_trouble(event)
        elif self._live and time.monotonic() - self._drawn > _REDRAW:
            self._drawn = time.monotonic()
            print(f"\r{self._line()}\x1b[K", end="", file=sys.stderr, flush=True)

    def clear(self) -> None:
        """Take the line away."""
        if self._live:
            print("\r\x1b[K", end="", file=sys.stderr, flush=True)

    def _line(self) -> str:
        pose, last, state = self._map.pose(), self._map.last, self._robot.state
        parts = [f"{time.monotonic() - self._begun:5.0f} s"]
        if pose is not None and last is not None:
            sigma = 100.0 * math.sqrt(max(float(last.covariance[0, 0] + last.covariance[1, 1]), 0.0))
            parts.append(f"x {pose[0]:6.2f} m  y {pose[1]:6.2f} m  {math.degrees(pose[2]):4.0f}°  ±{sigma:.1f} cm")
        if state is not None and state.battery is not None:
            parts.append(f"{state.battery:.1f} V{' LOW' if state.battery_low else ''}")
        if state is not None and state.watchdog:
            parts.append("stopped by its watchdog")
        if state is not None and state.stalled:
            parts.append("stopped: a motor does not turn, or its encoder does not count")
        return "  ".join([*parts, *(f"no {name}" for name in self._robot.troubles)])
