"""The robot as it is built, and the file that says so: ``robot.yaml``, in SI units."""

import dataclasses
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import NDArray

from contourslam.errors import ConfigError
from contourslam.geometry.fisheye import FisheyeModel
from contourslam.geometry.rigid import from_planar
from contourslam.settings_file import read_settings, write_settings

Floats = NDArray[np.float64]

OPTICAL = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
"""Axes of a camera that looks ahead (x right, y down, z out of the lens), as columns in the base frame."""


def _check_positive(config: object, *names: str, zero: bool = False) -> None:
    for name in names:
        value = getattr(config, name)
        if not (value > 0 or (zero and value == 0)):
            wanted = "zero or more" if zero else "above 0"
            raise ConfigError(f"{type(config).__name__}.{name} must be {wanted}, got {value!r}")


@dataclass(frozen=True, slots=True)
class BaseConfig:
    """The base: two driven wheels, the Mega that turns them, and how well it knows what they did."""

    port: str | None = None
    """Serial port; found by itself where only one can be the base's."""
    left_radius: float = 0.05
    """Radius at which the left wheel rolls, m; calibrated it is a little less than the wheel's own."""
    right_radius: float = 0.05
    """Of the right wheel, m."""
    wheel_base: float = 0.26
    """Between the two wheels' points of contact, m."""
    ticks_per_turn: int = 2048
    """Encoder ticks per turn of a wheel, all four edges counted, gear included."""
    left_sign: int = 1
    """-1 where the left motor and its encoder are wired so that positive is backwards."""
    right_sign: int = 1
    """Of the right wheel."""
    max_speed: float = 0.5
    """m/s."""
    max_turn_rate: float = 2.0
    """rad/s."""
    max_wheel_speed: float = 0.7
    """No wheel rolls faster, m/s; a curve beyond that is driven slower, and keeps its radius."""
    max_acceleration: float = 1.0
    """m/s²."""
    max_turn_acceleration: float = 6.0
    """rad/s²."""
    wheel_sigma: float = 0.01
    """Standard deviation of the way a wheel rolled, after one metre of it, m; it grows with the root of the way."""
    lateral_sigma: float = 0.005
    """Standard deviation of the sideways slip, after one metre, m."""
    use_gyro: bool = True
    """The gyroscope measures the turns, where it answers; off, the wheels alone."""
    gyro_sigma: float = 0.0005
    """Noise of the gyroscope, rad/s per root Hz; an MPU-9250's data sheet says 0.01 degrees/s."""
    gyro_bias_walk: float = 0.0001
    """How fast the gyroscope's bias wanders, rad/s per root s."""
    gyro_scale_sigma: float = 0.005
    """Standard deviation of the gyroscope's scale, a fraction of each turn."""

    def __post_init__(self) -> None:
        _check_positive(
            self, "left_radius", "right_radius", "wheel_base", "ticks_per_turn", "max_speed", "max_turn_rate",
            "max_wheel_speed", "max_acceleration", "max_turn_acceleration", "wheel_sigma", "gyro_sigma",
        )  # fmt: skip
        _check_positive(self, "lateral_sigma", "gyro_bias_walk", "gyro_scale_sigma", zero=True)
        for name in ("left_sign", "right_sign"):
            if getattr(self, name) not in (-1, 1):
                raise ConfigError(f"BaseConfig.{name} must be 1 or -1, got {getattr(self, name)!r}")

    @property
    def metres_per_tick(self) -> Floats:
        """Way of the left and the right wheel for one tick, m, signed, shape (2,)."""
        turn = 2.0 * math.pi / self.ticks_per_turn
        return np.array([self.left_sign * self.left_radius * turn, self.right_sign * self.right_radius * turn])


@dataclass(frozen=True, slots=True)
class LidarPart:
    """The lidar: its port, and where it sits."""

    port: str | None = None
    """Serial port; found by itself where only one can be the lidar's."""
    baud: int = 128000
    """Bits a second."""
    x: float = 0.1
    """Ahead of the middle of the axle, m."""
    y: float = 0.0
    """To the left of it, m."""
    yaw_deg: float = 0.0
    """Direction of the lidar's zero beam, counter-clockwise from ahead, degrees."""
    height: float = 0.2
    """Of the plane it scans above the floor, m."""

    def __post_init__(self) -> None:
        _check_positive(self, "baud", "height")

    @property
    def mount(self) -> tuple[float, float, float]:
        """``T_base_lidar`` in the plane: x (m), y (m), yaw (rad)."""
        return self.x, self.y, math.radians(self.yaw_deg)

    @property
    def place(self) -> Floats:
        """``T_base_lidar`` with its height above the floor, shape (4, 4), m."""
        return from_planar(np.array(self.mount), self.height)


@dataclass(frozen=True, slots=True)
class CameraPart:
    """The camera: where its pictures come from, its lens, and where it sits.

    With all angles zero it looks ahead, the picture upright; it is then rolled about the axis ahead, pitched about the
    axis to the left (positive looks down, -90 straight up) and turned about the upright axis, in this order.
    """

    model: FisheyeModel
    """What the calibration of the lens found."""
    source: str = "0"
    """``picamera2``, the number or name of a video device, or a film's file."""
    x: float = 0.0
    """Ahead of the middle of the axle, m."""
    y: float = 0.0
    """To the left of it, m."""
    z: float = 0.3
    """Above the floor, m."""
    roll_deg: float = 0.0
    """Degrees."""
    pitch_deg: float = 0.0
    """Degrees."""
    yaw_deg: float = 0.0
    """Degrees."""

    @property
    def T_base_camera(self) -> Floats:  # noqa: N802, frames are named so throughout
        """Camera frame (x right, y down, z out of the lens) in the base frame, shape (4, 4), m."""
        (cr, sr), (cp, sp), (cy, sy) = (
            (math.cos(math.radians(angle)), math.sin(math.radians(angle)))
            for angle in (self.roll_deg, self.pitch_deg, self.yaw_deg)
        )
        roll = np.array([[1.0, 0.0, 0.0], [0.0, cr, -sr], [0.0, sr, cr]])
        pitch = np.array([[cp, 0.0, sp], [0.0, 1.0, 0.0], [-sp, 0.0, cp]])
        yaw = np.array([[cy, -sy, 0.0], [sy, cy, 0.0], [0.0, 0.0, 1.0]])
        out = np.eye(4)
        out[:3, :3] = yaw @ pitch @ roll @ OPTICAL
        out[:3, 3] = self.x, self.y, self.z
        return out

    def placed(self, T_base_camera: Floats) -> Self:
        """Return the same camera in another place.

        Parameters
        ----------
        T_base_camera : ndarray, shape (4, 4)
            As :attr:`T_base_camera` gives it. Where the camera looks straight up or down, all of the turn about the
            upright axis is told as yaw.
        """
        turn = T_base_camera[:3, :3] @ OPTICAL.T
        pitch = math.atan2(-turn[2, 0], math.hypot(turn[0, 0], turn[1, 0]))
        if math.cos(pitch) > 1e-6:
            roll, yaw = math.atan2(turn[2, 1], turn[2, 2]), math.atan2(turn[1, 0], turn[0, 0])
        else:
            roll, yaw = 0.0, math.atan2(-turn[0, 1], turn[1, 1])
        x, y, z = T_base_camera[:3, 3].tolist()
        roll, pitch, yaw = (math.degrees(angle) for angle in (roll, pitch, yaw))
        return dataclasses.replace(self, x=x, y=y, z=z, roll_deg=roll, pitch_deg=pitch, yaw_deg=yaw)


@dataclass(frozen=True, slots=True)
class RobotConfig:
    """The whole robot; the defaults are those of the simulated one."""

    base: BaseConfig = field(default_factory=BaseConfig)
    lidar: LidarPart = field(default_factory=LidarPart)
    camera: CameraPart | None = None
    """None where the robot has no camera, or an uncalibrated one."""


def load_robot(path: Path) -> RobotConfig:
    """Read a ``robot.yaml``; what the file leaves out keeps its default.

    Raises
    ------
    ConfigError
        As :func:`contourslam.settings_file.read_settings`.
    """
    return read_settings(path, RobotConfig)


def save_robot(path: Path, config: RobotConfig, *, header: str = "") -> None:
    """Write a ``robot.yaml``, whole or not at all.

    Parameters
    ----------
    path : Path
    config : RobotConfig
    header : str
        Lines that go above it as comments, such as the command that made it.

    Raises
    ------
    ResultError
        If the file cannot be written.
    """
    write_settings(path, config, header=header)
