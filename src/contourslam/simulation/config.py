"""Every setting of a simulated run; pure data, so that asking the command line for help loads nothing else."""

import math
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from contourslam.errors import ConfigError
from contourslam.geometry.fisheye import FisheyeModel
from contourslam.geometry.rigid import rigid


@dataclass(frozen=True, slots=True)
class RobotModel:
    """A two-wheeled robot with a caster behind; base frame in the middle of the axle, x ahead."""

    wheel_radius: float = 0.05
    """m."""
    wheel_base: float = 0.26
    """Between the two wheels' points of contact, m."""
    body_radius: float = 0.17
    """Of the round body, m."""
    mass: float = 4.0
    """Of the body, kg."""
    ticks_per_turn: int = 2048
    """Encoder ticks per turn of a wheel."""

    def __post_init__(self) -> None:
        for name in ("wheel_radius", "wheel_base", "body_radius", "mass", "ticks_per_turn"):
            value = getattr(self, name)
            if not 0 < value < math.inf:
                raise ConfigError(f"RobotModel.{name} must be a positive number, got {value!r}")


@dataclass(frozen=True, slots=True)
class LidarModel:
    """A spinning lidar that samples at a fixed rate; where its turn rate wobbles, the number of beams varies."""

    samples_per_second: float = 5000.0
    """Beams per second, whatever the turn rate."""
    turn_rate: float = 10.0
    """Nominal turns per second."""
    turn_rate_wobble: float = 0.0
    """Standard deviation of the turn rate, which wanders from turn to turn, 1/s."""
    turn_rate_limits: tuple[float, float] = (6.03, 11.9)
    """The wobbling turn rate stays inside these, 1/s."""
    clockwise: bool = False
    """The lidar spins clockwise: angles fall from beam to beam."""
    range_min: float = 0.1
    """m."""
    range_max: float = 30.0
    """m."""
    sigma_range: float = 0.01
    """Standard deviation of one range near by, m."""
    sigma_relative: float = 0.0
    """Standard deviation as a fraction of the range, where that is more than `sigma_range`."""
    drop_rate: float = 0.0
    """Fraction of beams lost at random."""
    grazing_deg: float = 0.0
    """A beam that strikes a surface at a shallower angle than this is lost, the likelier the shallower, degrees."""
    no_return: float = math.inf
    """Range reported where nothing comes back."""
    mount_x: float = 0.1
    """Ahead of the axle (d of eq. 30), m."""
    mount_height: float = 0.2
    """Above the floor, m."""

    def __post_init__(self) -> None:
        if not (self.samples_per_second >= 3 * self.turn_rate > 0):
            raise ConfigError(
                f"LidarModel needs at least 3 samples a turn, got samples_per_second {self.samples_per_second!r} "
                f"at turn_rate {self.turn_rate!r}"
            )
        if not 0 <= self.range_min < self.range_max:
            raise ConfigError(f"LidarModel: [{self.range_min!r}, {self.range_max!r}] m is not a range")
        for name in ("turn_rate_wobble", "sigma_range", "sigma_relative", "drop_rate", "grazing_deg"):
            value = getattr(self, name)
            if not 0 <= value < math.inf:
                raise ConfigError(f"LidarModel.{name} must be zero or more, got {value!r}")

    def with_noise(self, sigma: float | None) -> "LidarModel":
        """The same lidar with this standard deviation (m) of every range, near or far; None leaves its own noise."""
        return self if sigma is None else replace(self, sigma_range=sigma, sigma_relative=0.0)


PAPER_LIDAR = LidarModel()
"""500 beams over 360 degrees at 10 Hz, counter-clockwise from -pi, 1 cm of noise, ahead of the axle as in eq. 30."""

YDLIDAR_X4 = LidarModel(
    turn_rate=7.0,
    turn_rate_wobble=0.8,
    clockwise=True,
    range_min=0.12,
    range_max=10.0,
    sigma_relative=0.005,
    drop_rate=0.01,
    grazing_deg=8.0,
    no_return=0.0,
)
"""YDLidar X4: 5,000 samples/s at about 7 turns/s, so 420 to 830 beams; noise 1 cm, 0.5 % beyond 2 m; drop-outs."""

LIDARS: dict[str, LidarModel] = {"paper": PAPER_LIDAR, "ydlidar_x4": YDLIDAR_X4}


RASPBERRY_PI_FISHEYE = FisheyeModel(640, 640, 1.6, 422.0, 421.4, 0.2, 321.3, 318.2, -0.012, 0.002, 0.0004, -0.0003)
"""A 220 degree lens on a Raspberry Pi's 5 megapixel sensor, of which the middle is read out four pixels into one."""


@dataclass(frozen=True, slots=True)
class CameraModel:
    """A fisheye camera on the robot."""

    model: FisheyeModel = RASPBERRY_PI_FISHEYE
    """Which pixel sees which ray."""
    x: float = 0.14
    """Ahead of the axle, m."""
    y: float = 0.0
    """To the left, m."""
    height: float = 0.30
    """Above the floor, m."""
    tilt_deg: float = 10.0
    """Of the lens above the horizon, degrees."""
    rate: float = 2.0
    """Pictures per second."""
    noise: float = 2.0
    """Standard deviation of a pixel's noise, of 255."""
    vignetting: float = 0.25
    """How much darker the picture is at the edge of the view, as a fraction."""
    exposure_wander: float = 0.12
    """How far the automatic exposure wanders, as a fraction."""
    jpeg_quality: int = 90
    """1 to 95."""

    def __post_init__(self) -> None:
        for name, low, high in (
            ("rate", 1e-3, 60.0), ("noise", 0.0, 255.0), ("vignetting", 0.0, 1.0), ("exposure_wander", 0.0, 1.0),
            ("jpeg_quality", 1, 95), ("tilt_deg", -90.0, 90.0), ("height", 0.0, 10.0), ("x", -1.0, 1.0),
            ("y", -1.0, 1.0),
        ):  # fmt: skip
            value = getattr(self, name)
            if not low <= value <= high:
                raise ConfigError(f"CameraModel.{name} must lie between {low:g} and {high:g}, got {value!r}")

    @property
    def mount(self) -> NDArray[np.float64]:
        """T_base_camera: pose of the lens in the base frame, whose origin is on the floor, shape (4, 4)."""
        tilt = math.radians(self.tilt_deg)
        cos, sin = math.cos(tilt), math.sin(tilt)
        right, down, ahead = (0.0, -1.0, 0.0), (sin, 0.0, -cos), (cos, 0.0, sin)
        return rigid(np.array([right, down, ahead]).T, (self.x, self.y, self.height))

    @property
    def face_pixels(self) -> int:
        """Pixels along a whole face of the cube that is drawn: a little more than the picture's middle shows."""
        return 2 * math.ceil(1.25 * max(self.model.fx, self.model.fy) / (1.0 + self.model.xi))


@dataclass(frozen=True, slots=True)
class SimulationConfig:
    """How long, how fast and with which sensors the robot drives."""

    duration: float | None = None
    """Length of the drive, s; by default at least 180 s and at least two laps."""
    speed: float = 0.4
    """Cruising speed, m/s."""
    noise: float | None = None
    """Standard deviation of every range, m, in place of the lidar's own noise."""
    lidar: LidarModel = PAPER_LIDAR
    """The lidar, by default the paper's."""
    robot: RobotModel = field(default_factory=RobotModel)
    """The robot's measures."""

    @property
    def measuring_lidar(self) -> LidarModel:
        """The lidar with the noise that is asked for in place of its own."""
        return self.lidar.with_noise(self.noise)

    def __post_init__(self) -> None:
        if self.duration is not None and not 0.1 <= self.duration < math.inf:
            raise ConfigError(f"SimulationConfig.duration must be at least 0.1 s, got {self.duration!r}")
        if not 0.0 < self.speed <= 1.5:
            raise ConfigError(f"SimulationConfig.speed must lie above 0 and up to 1.5 m/s, got {self.speed!r}")
        if self.noise is not None and not 0.0 <= self.noise < math.inf:
            raise ConfigError(f"SimulationConfig.noise must be zero or more, got {self.noise!r}")
