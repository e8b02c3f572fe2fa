"""The room, the robot and its devices stepped together at the pace of the wall clock."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from contourslam.simulation.config import YDLIDAR_X4, LidarModel, RobotModel
from contourslam.simulation.hardware.body import Body, Motor
from contourslam.simulation.hardware.imu import Imu
from contourslam.simulation.hardware.line import Damage, Line
from contourslam.simulation.hardware.sight import Sight
from contourslam.simulation.hardware.x4 import SAMPLES_PER_SECOND, X4
from contourslam.simulation.room import Room
from contourslam.simulation.world import TIMESTEP

Floats = NDArray[np.float64]
LATE = 0.02
"""A step that is done this much after its time is late, s."""
_BATTERY, _SAG = 7400, 400  # mV: two cells, and what both motors at full duty take of them
_TRUTH_EVERY = 5  # steps


class BoardStep(Protocol):
    """What the board did in a step: duty per mille, bytes it sent."""

    @property
    def duty(self) -> tuple[int, int]:
        """Of the left and the right motor, per mille."""

    @property
    def sent(self) -> bytes:
        """By its first serial port."""


class Board(Protocol):
    """The Mega with its firmware, stepped: :class:`contourslam.simulation.hardware.board.SimulatedBoard`."""

    def step(
        self, seconds: float, *, ticks: tuple[int, int], imu: tuple[int, ...], battery_mv: int, received: bytes
    ) -> BoardStep:
        """Run the firmware for a while, in which the encoders get to `ticks`."""


@dataclass(frozen=True, slots=True)
class WorldConfig:
    """What is simulated.

    Attributes
    ----------
    room : Room
    seed : int
        Of all that chance decides.
    robot : RobotModel
    motor : Motor
    lidar : LidarModel
    sample_clock, board_clock : float
        By how much the lidar's sampling and the Mega's resonator may be off, at the most; drawn by seed.
    """

    room: Room
    seed: int
    robot: RobotModel = field(default_factory=RobotModel)
    motor: Motor = field(default_factory=Motor)
    lidar: LidarModel = YDLIDAR_X4
    sample_clock: float = 0.002
    board_clock: float = 0.003


@dataclass(frozen=True, slots=True)
class Record:
    """What really happened.

    Attributes
    ----------
    stamps : ndarray, shape (n,)
        Wall clock, s.
    poses : ndarray, shape (n, 3)
        True poses of the base: m, m, rad.
    steps, late : int
        Steps of the physics, and how many were done more than :data:`LATE` after their time.
    latest : float
        The most that one was late, s.
    busy : float
        CPU seconds of this process for a second of the wall clock.
    bytes_sent, bytes_hit : int
        On both lines both ways, and how many of them were damaged.
    overrun : int
        Bytes that nobody fetched.
    """

    stamps: Floats
    poses: Floats
    steps: int
    late: int
    latest: float
    busy: float
    bytes_sent: int
    bytes_hit: int
    overrun: int


class LiveWorld:
    """The world and the devices in it; changed by every step.

    Parameters
    ----------
    config : WorldConfig
    board : Board
    folder : Path
        Where the links ``lidar`` and ``base`` to the two ports are made.
    """

    def __init__(self, config: WorldConfig, board: Board, folder: Path) -> None:
        seed = config.seed
        chance = np.random.default_rng([seed, 104])
        self._config, self._board = config, board
        self.body = Body(config.room, config.robot, config.motor, seed)
        self._imu = Imu(seed)
        sight = Sight(config.room, config.lidar, self.body, seed)
        rate = SAMPLES_PER_SECOND * (1.0 + chance.uniform(-1.0, 1.0) * config.sample_clock)
        self._pace = 1.0 + chance.uniform(-1.0, 1.0) * config.board_clock
        self.lidar = X4(sight.measure, sight.samples, rate)
        self.lidar_line = Line(folder / "lidar", np.random.default_rng([seed, 105]))
        self.base_line = Line(folder / "base", np.random.default_rng([seed, 106]))
        self._duty = (0, 0)
        self._truth: list[tuple[float, float, float, float]] = []
        self._steps = self._late = 0
        self._latest = 0.0
        self._began, self._cpu = 0.0, 0.0

    def unplug_lidar(self) -> None:
        """Pull the lidar's cable."""
        self.lidar_line.unplug()

    def plug_lidar(self) -> None:
        """Plug it in again; the lidar has lost its power meanwhile, and is idle."""
        self.lidar.scanning = False
        self.lidar_line.plug()

    def damage(self, damage: Damage) -> None:
        """Damage bytes on both lines, both ways, from now on."""
        self.lidar_line.damage(damage)
        self.base_line.damage(damage)

    def run(self, stopped: Callable[[], bool], every_step: Callable[[float], None] = lambda time: None) -> None:
        """Step at the pace of the wall clock until told to stop.

        Parameters
        ----------
        stopped : callable
            Asked before each wait.
        every_step : callable
            Called with the time on the world's clock (s) after each step.
        """
        self._began, self._cpu = time.time(), time.process_time()
        while not stopped():
            now = time.time() - self._began
            while (late := now - self.body.time - TIMESTEP) >= 0.0:
                self._note(late)
                self.step()
                every_step(self.body.time)
            time.sleep(max(self.body.time + TIMESTEP - (time.time() - self._began), 0.0))

    def step(self) -> None:
        """Move on by one step of the physics."""
        self.body.step((self._duty[0] / 1000.0, self._duty[1] / 1000.0))
        now = self.body.now
        sag = _SAG * (abs(self._duty[0]) + abs(self._duty[1])) // 2000
        done = self._board.step(
            TIMESTEP * self._pace, ticks=self.body.ticks(), imu=self._imu.read(*self.body.felt(), now.axes),
            battery_mv=_BATTERY - sag, received=self.base_line.receive(),
        )  # fmt: skip
        self._duty = done.duty
        self.base_line.send(done.sent)
        self.lidar_line.send(self.lidar.receive(self.lidar_line.receive(), now.time))
        self.lidar_line.send(self.lidar.advance(now.time))
        if self._steps % _TRUTH_EVERY == 0:
            self._truth.append((now.time, *now.pose))
        self._steps += 1

    def _note(self, late: float) -> None:
        self._late += late > LATE
        self._latest = max(self._latest, late)

    def record(self) -> Record:
        """Tell what really happened until now; stamps on the wall clock."""
        rows = np.array(self._truth).reshape(-1, 4)
        noises = [way for line in (self.lidar_line, self.base_line) for way in (line.outward, line.inward)]
        elapsed = max(time.time() - self._began, 1e-9)
        return Record(
            rows[:, 0] + self._began, rows[:, 1:], self._steps, self._late, self._latest,
            (time.process_time() - self._cpu) / elapsed,
            sum(noise.passed for noise in noises), sum(noise.hit for noise in noises),
            self.lidar_line.overrun + self.base_line.overrun,
        )  # fmt: skip

    @property
    def began(self) -> float:
        """Wall clock at the world's time 0, s."""
        return self._began
