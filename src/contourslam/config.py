"""Every setting of the core, a small frozen class per stage, in physical units, with defaults that work.

Pure data on purpose: the command line is generated from these classes, and asking it for help loads nothing else.
"""

import math
from dataclasses import dataclass, field
from typing import Literal

from contourslam.errors import ConfigError

BackEnd = Literal["ekf", "graph"]
Association = Literal["nearest", "mahalanobis", "mutual", "joint"]


def _check_positive(config: object, *names: str) -> None:
    for name in names:
        value = getattr(config, name)
        if not (isinstance(value, int | float) and math.isfinite(value) and value > 0):
            raise ConfigError(f"{type(config).__name__}.{name} must be a positive number, got {value!r}")


@dataclass(frozen=True, slots=True)
class LidarConfig:
    """The lidar and where it sits."""

    mount_x: float = 0.0
    """Lidar ahead of the middle of the axle, m (d of eq. 30); a transform in the recording wins over the three."""
    mount_y: float = 0.0
    """Lidar to the left of the middle of the axle, m."""
    mount_yaw: float = 0.0
    """Direction of the lidar's zero beam in the base frame, rad."""
    sigma_range: float = 0.01
    """Standard deviation of one range, m; where a wall's points scatter more, their own scatter is used."""
    max_range: float = 30.0
    """Ranges beyond this are ignored, m."""

    def __post_init__(self) -> None:
        _check_positive(self, "sigma_range", "max_range")

    @property
    def mount(self) -> tuple[float, float, float]:
        """``T_base_lidar``: m, m, rad."""
        return self.mount_x, self.mount_y, self.mount_yaw


@dataclass(frozen=True, slots=True)
class ContourConfig:
    """Cutting a scan into contours and equalizing them (eqs 1-11)."""

    breakpoint_angle_deg: float = 10.0
    """Shallowest angle between a beam and a surface still followed (lambda of Borges and Aldon 2004), degrees."""
    breakpoint_sigmas: float = 4.5
    """Range noise allowed for in the breakpoint distance, in standard deviations of one range."""
    max_gap: float = 1.0
    """Two neighbouring points farther apart than this, m, are never one contour."""
    max_missing: int = 2
    """A contour goes on over this many beams without a return, if the gap is short enough."""
    min_points: int = 4
    """A contour of fewer points is dropped, mixed pixels among them."""
    average_sigmas: float = 3.0
    """Points closer than this many standard deviations of the range are averaged before equalizing; 0 for none."""
    spacing: float = 0.05
    """Least length of the equalized contour's elementary vectors, m."""
    spacing_sigmas: float = 6.0
    """Least length of these vectors in standard deviations of the range."""

    def __post_init__(self) -> None:
        _check_positive(self, "breakpoint_angle_deg", "breakpoint_sigmas", "max_gap", "min_points")


@dataclass(frozen=True, slots=True)
class LandmarkConfig:
    """Refinement of corners and extraction of walls."""

    min_side: float = 0.25
    """Each side of a corner is at least this long, m."""
    max_side: float = 2.0
    """No more than this of each side is used for the refinement, m."""
    min_side_points: int = 5
    """Each side of a corner has at least this many beams."""
    max_opening_deg: float = 150.0
    """A corner opens by no more than this, degrees: beyond it its position is poorly known."""
    min_opening_deg: float = 20.0
    """A corner opens by at least this, degrees."""
    min_wall: float = 0.5
    """A wall segment is at least this long, m."""
    min_wall_points: int = 8
    """A wall segment has at least this many beams."""
    position_floor: float = 0.001
    """Standard deviation added to a corner's position and a wall's distance for what the noise does not explain, m."""
    angle_floor_deg: float = 0.05
    """Standard deviation added to a wall's direction for what the noise does not explain, degrees."""
    refined: bool = True
    """Refine each corner by intersecting the lines fitted to its sides; off, the raw contour vertex is used."""

    def __post_init__(self) -> None:
        _check_positive(self, "min_side", "max_side", "min_side_points", "min_wall", "min_wall_points")


@dataclass(frozen=True, slots=True)
class MotionConfig:
    """Noise of the wheel odometry (R of eq. 24), growing with the distance and angle driven."""

    forward_per_sqrt_m: float = 0.05
    """Standard deviation of the distance after one metre, m."""
    turn_per_sqrt_m_deg: float = 4.0
    """Standard deviation of the heading after one metre straight on, degrees."""
    turn_per_sqrt_rad_deg: float = 6.0
    """Standard deviation of the heading after turning by one radian, degrees."""
    lateral_per_sqrt_m: float = 0.03
    """Standard deviation of the sideways slip after one metre, m."""
    clock_sigma: float = 0.03
    """Standard deviation of the time by which the odometry's stamps may be off the scans', s."""

    def __post_init__(self) -> None:
        _check_positive(
            self,
            "forward_per_sqrt_m",
            "turn_per_sqrt_m_deg",
            "turn_per_sqrt_rad_deg",
            "lateral_per_sqrt_m",
            "clock_sigma",
        )


@dataclass(frozen=True, slots=True)
class SlamConfig:
    """The filter (eqs 23-31), its association, and the life of its landmarks."""

    contour_matching: bool = False
    """The filter predicts with the motion that contour matching measured; off, with the wheels alone (eq. 28)."""
    walls: bool = False
    """Walls are landmarks too; off, corners only as in the paper's Table I."""
    association: Association = "joint"
    """How an observation finds its landmark; "nearest" is the paper's."""
    nearest_threshold: float = 0.5
    """Threshold of the nearest-neighbour association, m."""
    gate_probability: float = 0.99
    """A true match passes the Mahalanobis gate with this probability."""
    first_estimates: bool = True
    """First-estimates Jacobians (Huang, Mourikis and Roumeliotis 2010) in place of the latest estimates'."""
    sightings_to_birth: int = 3
    """A landmark enters the map once it has been seen this often."""
    max_false_negative_rate: float = 0.7
    """A landmark whose false-negative rate f/(f+o) exceeds this is dropped ..."""
    min_chances: int = 20
    """... once it should have been seen this often."""
    odometry_lag: float = 0.0
    """The odometry that belongs to a scan is stamped this much earlier, s."""
    motion: MotionConfig = field(default_factory=MotionConfig)

    def __post_init__(self) -> None:
        _check_positive(self, "nearest_threshold", "sightings_to_birth", "min_chances")
        if not 0.0 < self.gate_probability < 1.0:
            raise ConfigError(f"SlamConfig.gate_probability must lie between 0 and 1, got {self.gate_probability!r}")
        if self.association not in ("nearest", "mahalanobis", "mutual", "joint"):
            raise ConfigError(
                f"SlamConfig.association must be nearest, mahalanobis, mutual or joint, got {self.association!r}"
            )


@dataclass(frozen=True, slots=True)
class GraphConfig:
    """The graph of keyframes, corners and walls."""

    loops: bool = True
    """Look for places seen before and close loops; off, what is left is contour odometry with landmarks."""
    refine: bool = True
    """At the end of a recording, solve the whole graph once more with every scan held against all its neighbours."""


@dataclass(frozen=True, slots=True)
class LiveConfig:
    """Live use on a robot: waiting for odometry, smoothing, saving by itself, and when something counts as a fault."""

    wait: float = 0.15
    """A scan waits at most this long for the odometry that covers its last beam, s."""
    odometry_slack: float = 0.0
    """Odometry that ends this much before a scan's last beam covers it all the same, s."""
    max_waiting: int = 5
    """No more scans than this wait for odometry, nor twice as many in all; then the oldest is dropped and counted."""
    silent_after: float = 1.0
    """A sensor that has said nothing for this long has stopped, s; scans then wait no longer for odometry."""
    jump_back: float = 1.0
    """Stamps that run back by this much, s, are a clock set back or a recording begun again; by less, disorder."""
    max_speed: float = 3.0
    """Odometry that moves faster than this, m/s, has leapt: its driver was started again."""
    max_turn_rate_deg: float = 360.0
    """Odometry that turns faster than this, degrees/s, has leapt."""
    smooth_speed: float = 0.5
    """A correction moves the published pose no faster than this, m/s; 0 publishes corrections as they are."""
    smooth_turn_rate_deg: float = 20.0
    """A correction turns the published pose no faster than this, degrees/s."""
    smooth_within: float = 1.0
    """A correction too large for the two rates above is made faster, so that it is over after this long, s ..."""
    large_correction: float = 1.0
    """... where it is larger than this, m ..."""
    large_correction_deg: float = 30.0
    """... or turns by more than this, degrees."""
    sure_way: float = 10.0
    """A map is continued once the robot has been followed in it for this way, m: one corridor looks like another ..."""
    sure_time: float = 15.0
    """... or for this time, s."""
    give_up_after: float = 20.0
    """A robot that is not found again in its own map within this time, s, begins a new one."""
    autosave_period: float = 60.0
    """A map is saved by itself this often while it changes, s; 0 for never."""
    late_after: float = 0.1
    """A pose later than this after its scan came is a fault, s."""
    poor_quality: float = 0.3
    """Contours that fit the map worse than this are a fault, 0 to 1."""
    remember: float = 10.0
    """Rates, latencies and faults are told of the last so many seconds."""

    def __post_init__(self) -> None:
        _check_positive(
            self, "wait", "max_waiting", "silent_after", "jump_back", "max_speed", "max_turn_rate_deg",
            "smooth_turn_rate_deg", "smooth_within", "large_correction", "large_correction_deg", "late_after",
            "sure_way", "sure_time", "give_up_after", "remember",
        )  # fmt: skip
        for name in ("odometry_slack", "smooth_speed", "autosave_period", "poor_quality"):
            value = getattr(self, name)
            if not (isinstance(value, int | float) and 0.0 <= value < math.inf):
                raise ConfigError(f"LiveConfig.{name} must be zero or more, got {value!r}")


@dataclass(frozen=True, slots=True)
class Config:
    """The whole pipeline from scan to map."""

    back_end: BackEnd = "ekf"
    """What binds the scans together: the paper's filter, or the graph, which closes loops (extra `graph`)."""

    detector: str = "matched_filter"
    """Landmark detector, a key of ``contourslam.detectors.DETECTORS``."""
    adapted: bool = True
    """Use the detector's adaptations to range noise; off, as its source has it."""
    lidar: LidarConfig = field(default_factory=LidarConfig)
    contour: ContourConfig = field(default_factory=ContourConfig)
    landmarks: LandmarkConfig = field(default_factory=LandmarkConfig)
    slam: SlamConfig = field(default_factory=SlamConfig)
    graph: GraphConfig = field(default_factory=GraphConfig)
