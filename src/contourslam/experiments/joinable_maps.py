"""Maps to be joined or kept apart: look-alike buildings, parts of recordings, mirror images, and their truth."""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from contourslam.config import Config
from contourslam.experiments.relocalisation import MOUNT, drive_through, map_of
from contourslam.geometry.poses import interpolate
from contourslam.joining.chart import Chart
from contourslam.maps.file import load_map, save_map
from contourslam.maps.saved_map import SavedMap
from contourslam.scan import LaserScan, Odometry, TruePose
from contourslam.simulation.buildings import Building
from contourslam.simulation.long_drive import Message
from contourslam.simulation.pieces import Box, Piece, door, partition
from contourslam.simulation.room import Room
from contourslam.simulation.tour import tour

Floats = NDArray[np.float64]
Way = tuple[tuple[float, float], ...]

CONFIG = Config(back_end="graph")
DOORS, PITCH, WIDTH, DEPTH, GAP = 8, 3.6, 2.2, 4.0, 1.0  # of a corridor: doors a side, their distance, m, m, m
STOREY = 2.6  # m


@dataclass(frozen=True)
class Mapped:
    """A map by SLAM, in a frame of its own, and where it really was made.

    Attributes
    ----------
    name : str
    building : str
        Maps of one building, and no others, may overlap.
    saved : SavedMap
    truth : ndarray, shape (k, 3)
        Poses of its keyframes in a frame that all maps of the building share: m, m, rad.
    """

    name: str
    building: str
    saved: SavedMap
    truth: Floats

    @cached_property
    def chart(self) -> Chart:
        """The map made ready to be laid on others."""
        return Chart(self.saved)


@dataclass(frozen=True, slots=True)
class Drive:
    """A drive that is to be mapped.

    Attributes
    ----------
    name, building : str
    messages : callable
        Gives its messages, with true poses among them.
    mount : ndarray, shape (3,), or None
        ``T_base_lidar``; that of the configuration by default.
    """

    name: str
    building: str
    messages: Callable[[], Iterable[Message]]
    mount: Floats | None = None


def mapped(drive: Drive, cache: Path | None = None) -> Mapped:
    """Map a drive from the origin of a frame of its own, without its true poses.

    Parameters
    ----------
    drive : Drive
    cache : Path, optional
        Folder in which maps are kept; one that is there is not made again.

    Raises
    ------
    MissingExtraError
        If GTSAM is not installed.
    """
    kept, known = (None, None) if cache is None else (cache / f"{drive.name}.map", cache / f"{drive.name}.npy")
    if kept is not None and known is not None and kept.exists() and known.exists():
        return Mapped(drive.name, drive.building, load_map(kept), np.load(known))
    true: list[TruePose] = []

    def unknowing() -> Iterator[Message]:
        for message in drive.messages():
            if isinstance(message, TruePose):
                true.append(message)
            else:
                yield message

    saved = map_of(unknowing(), CONFIG, drive.mount)
    stamps, poses = np.array([t.stamp for t in true]), np.array([t.pose for t in true])
    order = np.argsort(stamps, kind="stable")
    assert saved.keyframes is not None
    truth = interpolate(stamps[order], poses[order], saved.keyframes.stamps)
    if kept is not None and known is not None:
        kept.parent.mkdir(parents=True, exist_ok=True)
        save_map(kept, saved)
        np.save(known, truth)
    return Mapped(drive.name, drive.building, saved, truth)


def corridor(seed: int, *, opened: float = 0.5, doors: int = DOORS, storey: int | None = None) -> Room:
    """Draw a corridor like all others: width, doors and rooms are the same; what stands in them is not.

    Parameters
    ----------
    seed : int
        Of the furniture, and of which doors are open.
    opened : float
        Share of the doors that are open.
    doors : int
        On either side.
    storey : int, optional
        Of a tower: of one to the other only the furniture in the rooms differs, and `seed` says which doors are open,
        how far, and what stands in the corridor.
    """
    chance, length, half = np.random.default_rng([seed, 29]), doors * PITCH, 0.5 * WIDTH
    inside = chance if storey is None else np.random.default_rng([seed, 29, storey])
    pieces: list[Piece] = []
    middles = PITCH * (np.arange(doors) + 0.5)
    gaps = [(float(m), GAP) for m in middles]
    for side in (-1.0, 1.0):
        wall = side * (half + 0.06)
        pieces += partition((0.0, wall), (length, wall), STOREY, *gaps)
        for edge in PITCH * np.arange(1, doors):
            ends = sorted((side * (half + 0.12), side * (half + DEPTH)))
            pieces += partition((float(edge), ends[0]), (float(edge), ends[1]), STOREY)
        for middle in middles.tolist():
            if chance.random() >= opened:
                pieces.append(door((middle - 0.5 * GAP, wall), 0.0, GAP))
                continue
            swing = 90.0 + chance.uniform(-25.0, 25.0)
            pieces.append(door((middle - 0.5 * GAP - 0.03, side * (half + 0.1)), side * swing, 0.95))
            for _ in range(int(inside.integers(2, 5))):
                x = middle + inside.uniform(-1.3, 1.3)
                y = side * (half + inside.uniform(1.5, DEPTH - 0.4))
                long, wide, turn = inside.uniform((0.4, 0.3, -30.0), (1.4, 0.7, 30.0)).tolist()
                pieces.append(Box(x, y, long, wide, 1.2, turn))
        for spot in chance.uniform(0.5, length - 0.5, int(chance.integers(0, 4))).tolist():
            if np.abs(middles - spot).min() > 1.2:
                pieces.append(Box(spot, side * (half - 0.2), chance.uniform(0.6, 1.4), 0.4, 1.8))
    edge = half + DEPTH
    return Room(
        "corridor", "one of many corridors", ((0.0, -edge), (length, -edge), (length, edge), (0.0, edge)),
        tuple(pieces), ((1.0, 0.0), (length - 1.0, 0.1), (1.0, 0.1)), STOREY,
    )  # fmt: skip


def part_of(way: Iterable[tuple[float, float]], start: float, end: float) -> Way:
    """Waypoints (m) of a way from `start` to `end`, measured along it, m; the way may be endless."""
    points: list[tuple[float, float]] = []
    driven = 0.0
    for a, b in pairwise(way):
        step = math.dist(a, b)
        if step > 0.0 and driven + step > start:
            first, last = max((start - driven) / step, 0.0), min((end - driven) / step, 1.0)
            if not points:
                points.append((a[0] + first * (b[0] - a[0]), a[1] + first * (b[1] - a[1])))
            points.append((a[0] + last * (b[0] - a[0]), a[1] + last * (b[1] - a[1])))
        driven += step
        if driven >= end:
            break
    return tuple(points)


def touring(building: Building, seed: int) -> Iterator[tuple[float, float]]:
    """Waypoints of a tour without end."""
    return (point for leg in tour(building, seed) for point in leg.points)


def room_drive(name: str, building: str, room: Room, way: Sequence[tuple[float, float]], seed: int) -> Drive:
    """Describe a drive along a way through a room."""
    return Drive(name, building, lambda: drive_through(room, way, seed), MOUNT)


def mirrored(drive: Drive) -> Drive:
    """Describe the drive through the mirror image of a building: left is right there, and no two places are alike."""

    def flip(pose: Floats) -> Floats:
        return pose * (1.0, -1.0, -1.0)

    def messages() -> Iterator[Message]:
        for message in drive.messages():
            if isinstance(message, LaserScan):
                yield replace(
                    message, angles=-message.angles[::-1], ranges=message.ranges[::-1], offsets=message.offsets[::-1]
                )
            else:
                yield replace(message, pose=flip(message.pose))

    return Drive(f"{drive.name}_mirrored", f"{drive.building} mirrored", messages, drive.mount)


def parts_of_log(name: str, messages: Sequence[Message], stamps: Floats, poses: Floats, edges: Floats) -> list[Drive]:
    """Describe the parts of a log.

    Parameters
    ----------
    name : str
    messages : sequence
        In the order of the file.
    stamps, poses : ndarray, shape (s,) and (s, 3)
        Of the scans, as a run over the whole log has them: the truth.
    edges : ndarray, shape (parts + 1,)
        Where each begins and the last one ends, as parts of the whole duration, ascending from 0 to 1.
    """
    times = [message.stamp for message in messages]
    parts = len(edges) - 1
    edges = min(times) + (max(times) - min(times)) * edges
    true = [TruePose(float(stamp), pose) for stamp, pose in zip(stamps, poses, strict=True)]

    def part(number: int) -> Callable[[], Iterable[Message]]:
        low, high = edges[number], edges[number + 1]

        def chosen() -> Iterator[Message]:
            yield from (t for t in true if low - 1.0 <= t.stamp <= high + 1.0)
            yield from (m for m in messages if isinstance(m, LaserScan | Odometry) and low <= m.stamp <= high)

        return chosen

    return [Drive(f"{name}_{number + 1}_of_{parts}", name, part(number)) for number in range(parts)]
