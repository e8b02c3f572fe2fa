"""The whole robot at real time, its devices simulated down to their bytes: a function from configuration to result."""

import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from contourslam.config import Config
from contourslam.errors import ContourslamError
from contourslam.experiments.loop_values import (
    KEPT,
    Counters,
    Firmware,
    LoopConfig,
    LoopResult,
)
from contourslam.geometry.poses import interpolate
from contourslam.live.warming import warm_up
from contourslam.recordings.picture import Picture
from contourslam.recordings.writer import RecordingWriter
from contourslam.robot.base.mega import MegaBase
from contourslam.robot.bring_up import Event, Openers, Robot, openers
from contourslam.robot.config import BaseConfig, CameraPart, LidarPart, RobotConfig
from contourslam.robot.journey import Journey, Sight, Twist
from contourslam.robot.lidar.ydlidar_x4 import YdlidarX4
from contourslam.robot.live_map import PATIENT, LiveMap, settings_of
from contourslam.robot.pilot import Pilot, PilotConfig
from contourslam.robot.route import sample_route
from contourslam.robot.witness import MakeWitness
from contourslam.simulation.config import YDLIDAR_X4, CameraModel, RobotModel
from contourslam.simulation.hardware.board import SimulatedBoard
from contourslam.simulation.hardware.line import Damage
from contourslam.simulation.hardware.live_world import WorldConfig
from contourslam.simulation.hardware.running_world import RunningWorld
from contourslam.simulation.hardware.simulated_camera import SimulatedCamera
from contourslam.simulation.room import Room
from contourslam.simulation.rooms import ROOMS

Floats = NDArray[np.float64]
UNPLUGGED = 3.0
"""s."""
DAMAGE = Damage(0.05)
"""Each byte on its own, which is harder on packets than bursts."""
STANDS = 2.0
"""The robot stands for this long at first, s: the gyroscope's bias is found, and the map begins."""


def robot_in_the_loop(
    config: LoopConfig,
    firmware: Firmware,
    *,
    recording: Path | None = None,
    progress: Callable[[float], None] = lambda share: None,
    stopped: Callable[[], bool] = lambda: False,
    witness: MakeWitness | None = None,
) -> LoopResult:
    """Let the robot drive: real drivers, real firmware, real mapping; the world and the wires are simulated.

    Parameters
    ----------
    config : LoopConfig
    firmware : Firmware
    recording : Path, optional
        Where all that the robot sensed is recorded, the true poses left out.
    progress : callable
        Called with the share done.
    stopped : callable
        Ends the drive early.
    witness : callable, optional
        Makes who watches the robot.

    Returns
    -------
    LoopResult

    Raises
    ------
    ContourslamError
        If the firmware is not built, an extra is missing, a part does not come up, or it is ended before it drives.
    """
    room = ROOMS[config.room]
    settings = settings_of(robot_config(config, Path(), Path()), config.settings)
    warm_up(settings)  # nothing may be compiled while scans wait
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="contourslam-")))
        camera = stack.enter_context(_camera(room, config)) if config.pictures else None
        world = stack.enter_context(
            RunningWorld(
                WorldConfig(room, config.seed),
                partial(SimulatedBoard, firmware.board, firmware.elf),
                folder,
                poses=None if camera is None else camera.poses,
                period=1.0 / config.pictures if config.pictures else 1.0,
            )
        )
        parts = robot_config(config, world.lidar_port, world.base_port)
        opened = openers(parts)
        if camera is not None:
            opened = replace(opened, camera=lambda: camera)
        return _drive(config, settings, parts, opened, world, recording, progress, stopped, stack, witness)


def robot_config(config: LoopConfig, lidar: Path, base: Path) -> RobotConfig:
    """Say how the robot takes itself to be built: radii and wheel base are up to 1 % wrong, by seed."""
    model, wrong = RobotModel(), 1.0 + np.random.default_rng([config.seed, 107]).uniform(-0.01, 0.01, 3)
    eye = CameraModel()
    camera = CameraPart(eye.model, "simulated").placed(eye.mount) if config.pictures else None
    return RobotConfig(
        BaseConfig(
            port=str(base),
            left_radius=model.wheel_radius * float(wrong[0]),
            right_radius=model.wheel_radius * float(wrong[1]),
            wheel_base=model.wheel_base * float(wrong[2]),
            ticks_per_turn=model.ticks_per_turn,
        ),
        LidarPart(port=str(lidar), x=YDLIDAR_X4.mount_x, height=YDLIDAR_X4.mount_height),
        camera,
    )


@contextmanager
def _camera(room: Room, config: LoopConfig) -> Iterator[SimulatedCamera]:
    camera = SimulatedCamera(room, CameraModel(rate=config.pictures), config.seed)
    try:
        camera.wait_until_ready()
        yield camera
    finally:
        camera.end()


def _drive(
    config: LoopConfig,
    settings: Config,
    parts: RobotConfig,
    opened: Openers,
    world: RunningWorld,
    recording: Path | None,
    progress: Callable[[float], None],
    stopped: Callable[[], bool],
    stack: ExitStack,
    witness: MakeWitness | None = None,
) -> LoopResult:
    pictures: list[Picture] = []
    robot = Robot(opened)
    watched = None if witness is None else witness(robot)

    def watch(event: Event) -> None:
        if isinstance(event, Picture):
            pictures.append(event)
        if watched is not None:
            watched.watch(event)

    live_map = LiveMap(
        settings, PATIENT, lidar_mount=parts.lidar.mount, initial_pose=np.array(world.start),
        onlooker=None if watched is None else watched.follow,
    )  # fmt: skip
    stack.callback(live_map.close)
    pilot = Pilot(
        sample_route(ROOMS[config.room].route), closed=True, config=PilotConfig(speed=config.speed, blind_time=4.0)
    )
    writer = None
    if recording is not None:
        camera = parts.camera
        seen = None if camera is None else (camera.model, camera.T_base_camera)
        writer = stack.enter_context(RecordingWriter(recording, lidar_mount=parts.lidar.place, camera=seen))
    stack.enter_context(robot)
    journey = Journey(robot, live_map, writer, watch=watch)
    for event in robot.wait_until_ready(stopped):
        journey.take(event)
    if stopped():
        raise ContourslamError("the robot in the loop was ended before it drove")
    fault = _FaultAtItsTime(config, world)
    begun, busy = time.monotonic(), time.process_time()

    def steer(sight: Sight, dt: float) -> Twist:
        gone = time.monotonic() - begun
        fault.at(gone)
        progress(min(gone / config.seconds, 1.0))
        return (0.0, 0.0) if gone < STANDS else pilot.steer(sight.pose, dt, blind=sight.blind, sigma=sight.sigma)

    journey.go(steer, lambda: stopped() or time.monotonic() - begun > config.seconds)
    busy = (time.process_time() - busy) / (time.monotonic() - begun)
    counters = _counters(robot, journey)
    robot.close()
    live_map.close()
    record = world.finish()
    run = live_map.result()
    run = replace(run, truth=interpolate(record.stamps, record.poses, run.stamps))
    every = max(len(pictures) // KEPT, 1)
    return LoopResult(
        config, settings, run, record, counters, live_map.latencies, busy, pilot.travelled, tuple(journey.troubles),
        tuple(pictures[every // 2 :: every][:KEPT]), len(pictures),
    )  # fmt: skip


class _FaultAtItsTime:
    """Does to the world what the configuration wants, once."""

    def __init__(self, config: LoopConfig, world: RunningWorld) -> None:
        self._fault, self._world, self._done = config.fault, world, config.fault == "none"
        self._when = STANDS if config.fault == "damaged" else 0.5 * config.seconds

    def at(self, gone: float) -> None:
        if self._done or gone < self._when:
            return
        self._done = True
        if self._fault == "damaged":
            self._world.damage(DAMAGE)
        else:
            self._world.unplug_lidar(UNPLUGGED)


def _counters(robot: Robot, journey: Journey) -> Counters:
    lidar, base = robot.lidar, robot.base
    assert isinstance(lidar, YdlidarX4) and isinstance(base, MegaBase)
    parser = lidar.turns.parser
    return Counters(
        parser.good, parser.bad, lidar.reconnections, journey.states, base.refused, base.watchdog_stops, base.resets
    )
