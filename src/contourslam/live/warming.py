"""Everything compiled once before the first real scan: a drive made up for it, through the whole pipeline.

A kernel is compiled, or read from Numba's cache, at its first call. On a robot that must not happen while scans wait.
"""

import math
from collections.abc import Iterator

import numpy as np

from contourslam.config import Config
from contourslam.contour.contours import Floats
from contourslam.geometry.poses import compose
from contourslam.replay import make_mapper
from contourslam.scan import LaserScan, Odometry
from contourslam.slam.mapper import Mapper

BEAMS = 360
# A ring of corridors without symmetry, m: who is lost in it can find himself by its corners, or else by its contours.
OUTER = ((0, 0), (9, 0), (9, 1), (10, 1), (10, 7), (6, 7), (6, 8), (0, 8))
INNER = ((2.5, 2.5), (7, 2.5), (7, 4.5), (5, 4.5), (5, 5.5), (2.5, 5.5))
WAY = ((1.2, 1.2), (8.5, 1.2), (8.5, 6.2), (1.2, 6.6))
STEP = 0.25  # m between two scans
SLIP = 0.03  # of the way, by which the wheels err, so that there is something to correct
BLIND = (1.25, 2.25)  # laps between which the lidar sees nothing: the robot is unsure then, and looks for itself


def warm_up(config: Config, mapper: Mapper | None = None, *, laps: float = 3.25) -> None:
    """Take a mapper through a drive that closes loops.

    Parameters
    ----------
    config : Config
    mapper : Mapper, optional
        What is taken; by default one of its own, as the configuration has it. It is of no use afterwards.
    laps : float
        How far.
    """
    mapper = mapper or make_mapper(config)
    for odometry, scan, _ in made_up_drive(laps):
        mapper.push_odometry(odometry)
        mapper.push_scan(scan)
    mapper.corner_map()
    mapper.wall_map()
    mapper.finish()


def made_up_drive(laps: float) -> Iterator[tuple[Odometry, LaserScan, Floats]]:
    """Make up a drive through the ring of corridors.

    Parameters
    ----------
    laps : float
        How far; between `BLIND` the lidar sees nothing.

    Yields
    ------
    tuple of (Odometry, LaserScan, ndarray)
        The wheels, which slip, and a scan, both of one moment; the true pose, shape (3,), m and rad.
    """
    walls = np.concatenate([_sides(OUTER), _sides(INNER)])
    last: Floats | None = None
    odometry = np.zeros(3)
    drive = _drive(laps)
    for number, pose in enumerate(drive):
        stamp = 0.1 * number
        sees = not BLIND[0] < laps * number / len(drive) < BLIND[1]
        if last is not None:
            cos, sin = math.cos(last[2]), math.sin(last[2])
            dx, dy = pose[0] - last[0], pose[1] - last[1]
            ahead, aside = (cos * dx + sin * dy) * (1.0 + SLIP), -sin * dx + cos * dy
            odometry = compose(odometry, np.array([ahead, aside, (pose[2] - last[2]) * (1.0 + SLIP)]))
        yield Odometry(stamp, odometry), _scan(stamp, pose, walls if sees else walls[:0]), pose
        last = pose


def _sides(corners: tuple[tuple[float, float], ...]) -> Floats:
    points = np.array(corners, dtype=np.float64)
    return np.stack([points, np.roll(points, -1, axis=0)], axis=1)


def _drive(laps: float) -> list[Floats]:
    """Poses along the way, turning on the spot at its corners."""
    poses: list[Floats] = []
    here, heading = np.array(WAY[0]), 0.0
    for leg in range(round(laps * len(WAY))):
        there = np.array(WAY[(leg + 1) % len(WAY)])
        way = there - here
        wanted = math.atan2(way[1], way[0])
        turn = (wanted - heading + math.pi) % (2.0 * math.pi) - math.pi
        poses += [np.array([*here, heading + part * turn]) for part in np.linspace(0.0, 1.0, 6)[1:]]
        heading += turn
        steps = np.linspace(0.0, 1.0, math.ceil(float(np.hypot(*way)) / STEP) + 1)[1:]
        poses += [np.array([*(here + part * way), heading]) for part in steps]
        here = there
    return poses


def _scan(stamp: float, pose: Floats, walls: Floats) -> LaserScan:
    """Cast the beams of one scan, with a hundredth of a metre of noise that is the same every time."""
    number = np.arange(BEAMS, dtype=np.float64)
    angles, offsets = 2.0 * math.pi / BEAMS * number - math.pi, 1e-4 * number
    directions = np.stack([np.cos(angles + pose[2]), np.sin(angles + pose[2])], axis=1)
    if not len(walls):
        return LaserScan(stamp, angles, np.full(BEAMS, np.inf), offsets, 0.05, 30.0)
    to, along = walls[:, 0] - pose[:2], walls[:, 1] - walls[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        turned = directions[:, :1] * along[:, 1] - directions[:, 1:] * along[:, 0]
        far = (to[:, 0] * along[:, 1] - to[:, 1] * along[:, 0]) / turned
        where = (to[:, 0] * directions[:, 1:] - to[:, 1] * directions[:, :1]) / turned
    ranges = np.where((far > 0.0) & (where >= 0.0) & (where <= 1.0), far, np.inf).min(axis=1)
    noise = np.random.default_rng(round(stamp * 10)).normal(0.0, 0.01, BEAMS)
    return LaserScan(stamp, angles, ranges + noise, offsets, 0.05, 30.0)
