"""Corners and walls while the drive goes on, and the map at its end."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import chain

import numpy as np
import pytest
from numpy.typing import NDArray

from contourslam.config import Config, SlamConfig
from contourslam.detectors import make_detector
from contourslam.geometry.angles import wrap
from contourslam.geometry.poses import compose, compose_one
from contourslam.graph.doubt import DoubtTree
from contourslam.graph.landmarks import BATCH, Count, Landmarks
from contourslam.graph.pose_graph import PoseGraph
from contourslam.graph.sightings import DIRECTION
from contourslam.landmarks import trace
from contourslam.replay import replay
from contourslam.scan import LaserScan

Floats = NDArray[np.float64]
Scans = Callable[..., LaserScan]
Rooms = Callable[..., Floats]

MOUNT = np.array([0.1, 0.0, 0.2])
GRAPH = Config(back_end="graph")


class Drive:
    """A robot that knows where it is, in a room."""

    def __init__(self, segments: Floats, scan_of: Scans, config: Config = GRAPH) -> None:
        self.segments, self.scan_of, self.config = segments, scan_of, config
        self.graph, self.doubt, self.poses = PoseGraph(), DoubtTree(), list[Floats]()
        self.doubt.add(0, np.zeros(3), np.eye(3) * 1e-6)
        self.landmarks = Landmarks(config, make_detector("matched_filter"), MOUNT, self.doubt)

    def visit(self, pose: Sequence[float], node: int = 0, segments: Floats | None = None) -> Count:
        key, at = len(self.poses), np.array(pose)
        self.poses.append(at)
        self.graph.add(key, at)
        self.graph.fix(key, at, np.full(3, 1e-4))
        self.graph.update()
        room = self.segments if segments is None else segments
        scan = self.scan_of(room, compose_one(at, MOUNT), sigma=0.005, seed=key)
        contours = trace(scan, self.config, T_base_lidar=MOUNT)
        return self.landmarks.take(scan, contours, key, at, node, self.graph, lambda stage: None)


@pytest.fixture
def drive(room: Rooms, scan_of: Scans) -> Drive:
    return Drive(room([(-3, -2), (3, -2), (3, 2), (-3, 2)]), scan_of)


def places(count: int) -> list[tuple[float, float, float]]:
    return [(1.5 * math.cos(0.5 * k), 0.8 * math.sin(0.5 * k), 0.3 * k) for k in range(count)]


def test_a_room_of_four_corners_and_four_walls_is_mapped_as_such(drive: Drive) -> None:
    counts = [drive.visit(pose) for pose in places(25)]
    corners, walls = drive.landmarks.maps(np.array(drive.poses))
    assert (len(corners.ids), len(walls.ids)) == (4, 4)
    true = np.array([[3, 2], [-3, 2], [-3, -2], [3, -2]])
    apart = np.linalg.norm(corners.positions[:, None] - true, axis=2)
    assert sorted(apart.argmin(axis=1)) == [0, 1, 2, 3]
    assert apart.min(axis=1).max() < 0.01
    assert not corners.convex.any()
    np.testing.assert_allclose(np.cos(corners.directions - np.arctan2(*-corners.positions.T[::-1])), 1.0, atol=0.05)
    np.testing.assert_allclose(np.linalg.norm(np.diff(walls.end_points, axis=1), axis=2).sum(), 20.0, atol=0.8)
    # Seen from free space a wall runs from the right to the left; about a room that is counter-clockwise.
    first, last = walls.end_points[:, 0], walls.end_points[:, 1]
    assert (first[:, 0] * last[:, 1] - first[:, 1] * last[:, 0] > 0.0).all()
    born = list(chain.from_iterable(c.born for c in counts))
    assert sorted(born) == sorted([*corners.ids, *walls.ids]) == list(range(8))
    assert len(counts[-1].matched) >= 6
    assert max(corners.failed.max(), walls.failed.max()) <= 2


@pytest.mark.parametrize("sightings", [1, 2, 4])
def test_a_landmark_is_born_when_it_has_been_seen_often_enough(room: Rooms, scan_of: Scans, sightings: int) -> None:
    config = replace(GRAPH, slam=SlamConfig(sightings_to_birth=sightings))
    drive = Drive(room([(-3, -2), (3, -2), (3, 2), (-3, 2)]), scan_of, config)
    counts = [drive.visit((0.0, 0.0, 0.0)) for _ in range(sightings)]
    assert [len(c.born) > 0 for c in counts] == [False] * (sightings - 1) + [True]
    assert (drive.landmarks.sightings.ids[: drive.landmarks.sightings.count] >= 0).mean() > 0.9


def test_landmarks_enter_the_graph_in_batches_and_are_read_from_it(drive: Drive) -> None:
    for pose in places(BATCH + 1):
        drive.visit(pose)
    before = drive.landmarks.table.copy()
    drive.visit((0.0, 0.0, 0.0))
    drive.landmarks.refresh(np.zeros(3), np.array([0.1, 0.0, 0.0]))
    drive.visit((0.1, 0.0, 0.0))
    changed = drive.landmarks.table - before
    changed[:, DIRECTION] = wrap(changed[:, DIRECTION])
    changed = np.abs(changed).max(axis=1)
    assert (changed > 0.0).sum() >= 8
    assert changed.max() < 0.3  # extents may grow, but nothing jumps


def test_what_is_in_sight_and_not_found_counts_as_missed(drive: Drive) -> None:
    for pose in places(6):
        drive.visit(pose)
    known = drive.landmarks.failures.copy()
    empty = drive.segments * 4.0  # the walls have gone to four times the distance
    count = drive.visit((0.0, 0.0, 0.0), segments=empty)
    assert len(count.missed) >= 7
    assert sum(drive.landmarks.failures) == sum(known) + len(count.missed)


def test_landmarks_that_have_gone_are_dropped(drive: Drive) -> None:
    for pose in places(6):
        drive.visit(pose)
    dropped: list[int] = []
    for _ in range(30):
        dropped.extend(drive.visit((0.0, 0.0, 0.0), segments=drive.segments * 4.0).dropped)
    assert len(dropped) >= 7
    assert len(set(dropped)) == len(dropped)
    drive.visit((0.0, 0.0, 0.0))  # goes on with the rows that are free


def test_a_landmark_known_from_a_place_in_doubt_is_not_asked(drive: Drive) -> None:
    """What is seen after a long way is not tied to what was there before, for the pose may be off by a door's width."""
    for pose in places(6):
        drive.visit(pose)
    far = drive.doubt.add(0, np.zeros(3), np.diag([0.25, 0.25, 0.01]))
    count = drive.visit((0.0, 0.0, 0.0), node=far)
    assert count.matched == count.missed == ()
    again = [drive.visit((0.0, 0.0, 0.0), node=far) for _ in range(3)]
    assert len(again[1].born) >= 7
    # Once it is known where both were, the map holds each thing once, under its oldest name.
    corners, walls = drive.landmarks.maps(np.array(drive.poses))
    assert sorted([*corners.ids, *walls.ids]) == list(range(8))


def test_an_empty_scan_changes_nothing(drive: Drive) -> None:
    count = drive.visit((0.0, 0.0, 0.0), segments=np.array([[[90.0, 0.0], [90.0, 1.0]]]))
    assert count == Count(0, 0, (), (), (), ())
    corners, walls = drive.landmarks.maps(np.array(drive.poses))
    assert len(corners.ids) == len(walls.ids) == 0


def test_the_corners_of_a_simulated_rooms_map_are_true() -> None:
    pytest.importorskip("mujoco", reason="needs the extra 'simulation'")
    from contourslam.simulation.config import SimulationConfig
    from contourslam.simulation.rooms import ROOMS
    from contourslam.simulation.simulate import simulate

    run = simulate(ROOMS["furnished_room"], SimulationConfig(duration=20.0), 2)
    result = replay(run.messages(), GRAPH, lidar_mount=run.lidar_mount)
    corners, true = result.corner_map, run.room.corners(run.lidar.mount_height)
    apart = np.linalg.norm(corners.positions[:, None] - true.positions, axis=2)
    nearest = apart.argmin(axis=1)
    assert len(corners.ids) >= 10
    assert apart.min(axis=1).max() < 0.03
    np.testing.assert_array_equal(corners.convex, true.convex[nearest])
    assert np.cos(corners.directions - true.directions[nearest]).min() > 0.98
    assert result.matched_count.sum() > 50


def test_the_corners_of_a_simulated_buildings_map_are_true_but_for_the_drift() -> None:
    pytest.importorskip("shapely", reason="needs the extra 'simulation'")
    from contourslam.simulation.long_drive import building_drive

    run = building_drive(40.0, 1)
    result = replay(run.messages(), GRAPH, lidar_mount=run.lidar_mount)
    assert result.truth is not None
    # A landmark lies where the pose that saw it had it: the best turn and shift of the whole takes the drift away.
    middle, known = result.poses[:, :2].mean(axis=0), result.truth[:, :2].mean(axis=0)
    turn = float(np.mean(result.truth[:, 2] - result.poses[:, 2] + math.pi) % (2.0 * math.pi) - math.pi)
    there = compose(np.array([*known, turn]), np.pad(result.corner_map.positions - middle, ((0, 0), (0, 1))))[:, :2]
    true = run.building.room.corners(run.lidar.mount_height)
    apart = np.linalg.norm(there[:, None] - true.positions, axis=2)
    assert len(there) >= 10
    assert np.median(apart.min(axis=1)) < 0.015
    assert (apart.min(axis=1) < 0.03).mean() > 0.9
