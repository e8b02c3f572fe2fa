"""How well a robot is found in a known map without a first guess: maps by SLAM, scans from random places, a judge."""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from time import thread_time

import numpy as np
from numpy.typing import NDArray

from contourslam.config import Config
from contourslam.detectors import make_detector
from contourslam.geometry.angles import wrap_angle
from contourslam.geometry.poses import compose
from contourslam.landmarks import find_landmarks, trace
from contourslam.localization.locate import Locator
from contourslam.localization.looks import constellation_of
from contourslam.maps.saved_map import SavedMap
from contourslam.matching.oriented import move, oriented_points
from contourslam.scan import LaserScan, Odometry, TruePose
from contourslam.simulation.buildings import Building
from contourslam.simulation.follower import Habits
from contourslam.simulation.gliding import Tick, glide
from contourslam.simulation.long_drive import LongDrive, Message
from contourslam.simulation.pieces import Box
from contourslam.simulation.ray_casting import PlaneCaster, outlines
from contourslam.simulation.room import Room, free_space

Floats = NDArray[np.float64]

NEAR, NEAR_ANGLE = 0.1, math.radians(2.0)  # m, rad: found
MOUNT = np.array([0.1, 0.0, 0.0])  # T_base_lidar of the simulated robot
HEIGHT = 0.2  # of its lidar, m
RANGE = 30.0  # m
BODY = 0.2  # m that it keeps clear of matter

OFFICE_WAY = (
    *((1.2, 4.8), (3.1, 4.8), (3.1, 3.0), (3.2, 1.9), (4.8, 1.9), (4.6, 3.0), (3.2, 2.5), (3.1, 4.8), (7.9, 4.9)),
    *((7.9, 7.4), (7.2, 8.6), (8.2, 7.6), (10.0, 7.4), (8.0, 7.3), (7.9, 5.0), (15.0, 4.75), (15.5, 4.6), (15.5, 2.3)),
    *((16.4, 1.6), (20.5, 1.6), (21.5, 2.5), (21.5, 4.9), (22.4, 5.0), (22.4, 6.8), (21.0, 7.2), (19.0, 7.8)),
    *((20.8, 7.0), (22.4, 6.8), (22.5, 5.0), (23.6, 4.9), (23.8, 5.2), (1.3, 5.2)),
)
"""Through all open offices of the room ``office_corridor``, m."""


@dataclass(frozen=True, slots=True)
class Query:
    """A scan to be found.

    Attributes
    ----------
    scan : LaserScan
    pose : ndarray, shape (3,), or None
        True pose of the base in the map; None where the scan is from elsewhere.
    """

    scan: LaserScan
    pose: Floats | None


@dataclass(frozen=True, slots=True)
class Score:
    """What came of some queries.

    Attributes
    ----------
    queries, found, confident, wrong : int
        How many there were; were found within 0.1 m and 2 degrees; were said to be sure; were so, and not found.
    milliseconds : ndarray, shape (queries,)
        CPU time of each, from the scan's beams to the answer.
    """

    queries: int
    found: int
    confident: int
    wrong: int
    milliseconds: Floats


@dataclass(frozen=True)
class _RoomDrive(LongDrive):
    """A drive along a given way."""

    way: tuple[tuple[float, float], ...] = field(default=())

    def ticks(self) -> Iterator[Tick]:
        return glide(self.way, Habits(self.speed, 0.1, 20.0, 0.0))


def drive_through(room: Room, way: Sequence[tuple[float, float]], seed: int) -> Iterator[Message]:
    """Drive along waypoints (m) through a room, with 360 beams of 1 cm noise five times a second."""
    return _RoomDrive(Building(room, {}, {}), 1.0, seed, 0.5, way=tuple(way)).messages()


def map_of(messages: Iterable[Message], config: Config, mount: Floats | None) -> SavedMap:
    """Map a recording with the graph, in the frame of its true poses where it has them.

    Raises
    ------
    MissingExtraError
        If GTSAM is not installed.
    """
    from contourslam.graph import GraphSlam, kept

    slam: GraphSlam | None = None
    waiting: list[Odometry] = []
    start: Floats | None = None
    for message in messages:
        if isinstance(message, TruePose):
            start = message.pose if start is None else start
        elif isinstance(message, LaserScan):
            if slam is None:
                slam = GraphSlam(config, initial_pose=start, lidar_mount=mount)
                for reading in waiting:
                    slam.push_odometry(reading)
            slam.push_scan(message)
        elif slam is None:
            waiting.append(message)
        else:
            slam.push_odometry(message)
    if slam is None:
        raise ValueError("a map needs one scan or more")
    slam.finish()
    return kept(slam, {})


def scans_at_random(
    room: Room,
    count: int,
    seed: int,
    *,
    mapped: Room | None = None,
    field_of_view_deg: float = 360.0,
    beams: int = 500,
    sigma: float = 0.01,
) -> list[Query]:
    """Scans at random free poses of a room.

    Parameters
    ----------
    room : Room
    count : int
    seed : int
    mapped : Room, optional
        The room as it was mapped: poses are free in it too.
    field_of_view_deg : float
    beams : int
        Over a whole turn.
    sigma : float
        Noise of a range, m.

    Raises
    ------
    MissingExtraError
        If shapely is not installed.
    """
    import shapely

    chance, free = np.random.default_rng(seed), free_space(room, HEIGHT).buffer(-BODY)
    if mapped is not None:
        free = free.intersection(free_space(mapped, HEIGHT).buffer(-BODY))
    caster = PlaneCaster(*outlines(room, HEIGHT))
    x0, y0, x1, y1 = free.bounds
    seen = round(beams * field_of_view_deg / 360.0)
    angles = math.radians(field_of_view_deg) * (np.arange(seen) / seen - 0.5)
    out: list[Query] = []
    while len(out) < count:
        pose = chance.uniform((x0, y0, -math.pi), (x1, y1, math.pi))
        if free.contains(shapely.Point(pose[:2])):
            lidar = compose(pose, MOUNT)
            ranges, _ = caster.cast(np.tile(lidar[:2], (seen, 1)), lidar[2] + angles, RANGE)
            ranges = ranges + sigma * chance.standard_normal(seen)
            out.append(Query(LaserScan(0.0, angles, ranges, np.zeros(seen), 0.1, RANGE), pose))
    return out


def refurnished(room: Room, seed: int) -> Room:
    """The same room with one piece of furniture in seven gone, and 40 % of the others moved by up to 1 m and 40°."""
    from dataclasses import replace

    from contourslam.errors import ConfigError

    chance = np.random.default_rng(seed)
    while True:
        pieces = []
        for piece in room.pieces:
            if isinstance(piece, Box) and piece.top < 2.3:
                if chance.random() < 1.0 / 7.0:
                    continue
                if chance.random() < 0.4:
                    dx, dy, turn = chance.uniform((-1.0, -1.0, -40.0), (1.0, 1.0, 40.0)).tolist()
                    piece = replace(piece, x=piece.x + dx, y=piece.y + dy, yaw_deg=piece.yaw_deg + turn)
            pieces.append(piece)
        changed = replace(room, pieces=tuple(pieces))
        try:
            free_space(changed, HEIGHT)
        except ConfigError:  # it was moved onto the robot's start or against a column
            continue
        return changed


def judge(locator: Locator, queries: Iterable[Query], config: Config, mount: Floats) -> Score:
    """Look for all queries and say how many were found.

    Parameters
    ----------
    locator : Locator
    queries : iterable of Query
    config : Config
    mount : ndarray, shape (3,)
        ``T_base_lidar`` of the scans.
    """
    detector = make_detector(config.detector, adapted=config.adapted)
    found = confident = wrong = 0
    times = []
    for query in queries:
        begin = thread_time()
        contours = trace(query.scan, config, T_base_lidar=mount)
        seen = find_landmarks(contours, detector, config)
        landmarks = constellation_of(seen.corners, seen.walls, mount)
        located = locator.locate(move(oriented_points(contours), mount), landmarks, lidar=mount)
        times.append(1e3 * (thread_time() - begin))
        right = query.pose is not None and is_near(located.pose, query.pose)
        found, confident = found + right, confident + located.confident
        wrong += located.confident and not right
    return Score(len(times), found, confident, wrong, np.array(times))


def is_near(pose: Floats, truth: Floats) -> bool:
    """Whether a pose is right to 0.1 m and 2 degrees; never where it is NaN."""
    if not np.isfinite(pose).all():
        return False
    return math.hypot(*(pose[:2] - truth[:2])) < NEAR and abs(wrap_angle(pose[2] - truth[2])) < NEAR_ANGLE
