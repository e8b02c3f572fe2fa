"""What the figures look at: shapes made by hand, and one scan and one lap of the furnished room."""

import math
from functools import cache

import numpy as np
from matplotlib.axes import Axes
from matplotlib.markers import MarkerStyle
from matplotlib.patches import Ellipse
from matplotlib.path import Path
from matplotlib.transforms import Affine2D
from numpy.typing import ArrayLike, NDArray

from contourslam.config import Config
from contourslam.contour import Contours
from contourslam.evaluation.visibility import cast_beams
from contourslam.experiments.known_room import told
from contourslam.scan import LaserScan
from contourslam.simulation.config import SimulationConfig
from contourslam.simulation.rooms import FURNISHED_ROOM
from contourslam.simulation.simulate import SimulatedRun, simulate

Floats = NDArray[np.float64]

LIDAR_HEIGHT = 0.2  # m
NO_CIRCLES = np.empty((0, 3))
INDOORS = (3.2, 1.4, 0.0)  # where the scans of the furnished room are taken: m, m, rad


def outline(*corners: tuple[float, float]) -> Floats:
    """Sides of a room, given counter-clockwise, shape (n, 2, 2), m."""
    ring = np.array(corners)
    return np.stack([ring, np.roll(ring, -1, axis=0)], axis=1)


def wedge(opening: float, side: float = 1.5) -> Floats:
    """Two walls that meet at the origin and open by so many radians towards +x, shape (2, 2, 2), m."""
    ends = side * np.array([[math.cos(0.5 * opening), s * math.sin(0.5 * opening)] for s in (1.0, -1.0)])
    return np.stack([np.zeros((2, 2)), ends], axis=1)


def scan_of(
    segments: Floats,
    pose: ArrayLike,
    *,
    sigma: float = 0.01,
    beams: int = 500,
    chance: int | np.random.Generator = 0,
    circles: Floats = NO_CIRCLES,
) -> LaserScan:
    """A lidar that stands still among walls."""
    angles = -math.pi + 2.0 * math.pi / beams * np.arange(beams)
    ranges, _ = cast_beams(np.asarray(pose, dtype=np.float64), angles, segments, circles, 30.0)
    noise = sigma * np.random.default_rng(chance).standard_normal(beams)
    return LaserScan(0.0, angles, ranges + noise, np.zeros(beams), 0.05, 30.0)


def indoor_scan(sigma: float = 0.01, chance: int = 0) -> LaserScan:
    """One scan in the furnished room."""
    segments, circles = FURNISHED_ROOM.segments(LIDAR_HEIGHT), FURNISHED_ROOM.circles(LIDAR_HEIGHT)
    return scan_of(segments, INDOORS, sigma=sigma, chance=chance, circles=circles)


@cache
def drive() -> SimulatedRun:
    """A lap of the furnished room."""
    return simulate(FURNISHED_ROOM, SimulationConfig(duration=54.0), seed=1)


def drive_config() -> Config:
    """What the data sheets of the simulated robot say."""
    return told(Config(), drive().lidar)


def contour_of(points: ArrayLike, *, spacing: float = 0.0) -> Contours:
    """One open contour."""
    rows = np.ascontiguousarray(points, dtype=np.float64).reshape(-1, 2)
    n = len(rows)
    return Contours(rows, np.array([0, n]), np.array([False]), spacing, np.arange(n, dtype=np.float64))


def corner_of(turn: float, side: int, spacing: float) -> Floats:
    """`side` steps straight on, a turn at the origin by so many radians, `side` steps; m."""
    steps = np.arange(1, side + 1)[:, None] * spacing
    before = np.stack([np.arange(-side, 1) * spacing, np.zeros(side + 1)], axis=1)
    return np.concatenate([before, steps * [[math.cos(turn), math.sin(turn)]]])


def arc_length(points: Floats) -> Floats:
    """Way along a chain of points, m."""
    return np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])


def draw_ellipse(axes: Axes, mean: ArrayLike, covariance: Floats, colour: str, *, sigmas: float = 2.0, **style: object):
    """Draw the points whose Mahalanobis distance from the mean is `sigmas`."""
    variances, directions = np.linalg.eigh(covariance)
    width, height = 2.0 * sigmas * np.sqrt(np.maximum(variances, 0.0))
    angle = math.degrees(math.atan2(directions[1, 0], directions[0, 0]))
    look = {"facecolor": "none", "edgecolor": colour, "linewidth": 1.4, "zorder": 4} | style
    return axes.add_patch(Ellipse(np.asarray(mean), width, height, angle=angle, **look))


def draw_walls(axes: Axes, segments: Floats, **style: object) -> None:
    """Draw walls as thin grey lines."""
    look = {"color": "#9a9a9a", "linewidth": 1.0, "zorder": 1} | style
    axes.plot(*np.insert(segments, 2, np.nan, axis=1).reshape(-1, 2).T, **look)


def draw_robot(axes: Axes, pose: ArrayLike, colour: str, **style: object) -> None:
    """Draw a triangle that points where the robot looks."""
    x, y, heading = np.asarray(pose, dtype=np.float64)
    wedge_ahead = Path([(1.0, 0.0), (-0.8, 0.6), (-0.4, 0.0), (-0.8, -0.6), (1.0, 0.0)])
    look = {"markersize": 11, "linestyle": "none", "zorder": 5} | style
    axes.plot(x, y, marker=MarkerStyle(wedge_ahead, transform=Affine2D().rotate(heading)), color=colour, **look)


def draw_room(axes: Axes) -> None:
    """Draw the furnished room at the height of the lidar."""
    draw_walls(axes, FURNISHED_ROOM.segments(LIDAR_HEIGHT))
    turn = np.linspace(0.0, 2.0 * math.pi, 40)
    for x, y, radius in FURNISHED_ROOM.circles(LIDAR_HEIGHT):
        axes.plot(x + radius * np.cos(turn), y + radius * np.sin(turn), color="#9a9a9a", linewidth=1.0)
    axes.set_aspect("equal")
    axes.grid(visible=False)
    axes.set(xlabel="x (m)", ylabel="y (m)")
