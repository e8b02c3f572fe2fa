"""A map that was kept goes on where it ended: one frame, the same landmarks, as true as an uncut drive."""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from contourslam.config import Config
from contourslam.errors import MapError
from contourslam.geometry.poses import between, compose, interpolate
from contourslam.maps import SavedMap, load_map, save_map
from contourslam.scan import LaserScan, Odometry, TruePose

pytest.importorskip("gtsam", reason="needs the extra 'graph'")
pytest.importorskip("shapely", reason="needs the extra 'simulation'")

from contourslam.graph import GraphSlam, kept, resume
from contourslam.graph.start import find_start
from contourslam.simulation.long_drive import building_drive

Floats = NDArray[np.float64]
Message = LaserScan | Odometry | TruePose

CONFIG = Config(back_end="graph")
LENGTH, SEED = 120.0, 0
MOUNT = building_drive(LENGTH, SEED).lidar_mount
FOUND = np.diag([0.02**2, 0.02**2, 0.01**2])  # covariance of a pose that was found in the map


@cache
def drive() -> tuple[Message, ...]:
    return tuple(building_drive(LENGTH, SEED).messages())


@cache
def truth() -> Floats:
    """True poses at all scans."""
    rows = [(m.stamp, *m.pose) for m in drive() if isinstance(m, TruePose)]
    stamps, poses = np.array(rows)[:, 0], np.array(rows)[:, 1:]
    return interpolate(stamps, poses, np.array([m.stamp for m in drive() if isinstance(m, LaserScan)]))


@cache
def half() -> int:
    return len(truth()) // 2


def part(first: int, until: int) -> list[Message]:
    """The drive from one scan to another, with the odometry just before."""
    ends = [i for i, message in enumerate(drive()) if isinstance(message, LaserScan)]
    return list(drive()[ends[first - 1] + 1 if first else 0 : ends[until - 1] + 1])


def feed(slam: GraphSlam, messages: Iterable[Message]) -> None:
    for message in messages:
        if isinstance(message, Odometry):
            slam.push_odometry(message)
        elif isinstance(message, LaserScan):
            slam.push_scan(message)


def begin() -> GraphSlam:
    return GraphSlam(CONFIG, initial_pose=truth()[0], lidar_mount=MOUNT)


def go_on(saved: SavedMap, pose: Floats, covariance: Floats = FOUND) -> GraphSlam:
    return resume(CONFIG, saved, pose, covariance, lidar_mount=MOUNT)


def rmse(poses: Floats, truth: Floats) -> float:
    return float(np.sqrt(np.mean(np.sum((poses - truth)[:, :2] ** 2, axis=1))))


@cache
def uncut() -> Floats:
    slam = begin()
    feed(slam, drive())
    return slam.finish().poses


@cache
def first_half() -> tuple[Floats, SavedMap]:
    """Poses of the first half of the drive, and its map."""
    slam = begin()
    feed(slam, part(0, half()))
    poses = slam.finish().poses
    return poses, kept(slam, {"recording": "the first half"})


def first_map() -> SavedMap:
    return first_half()[1]


@cache
def continued() -> tuple[Floats, SavedMap]:
    """Poses of the second half in the map of the first, and the map of both."""
    slam = go_on(first_map(), truth()[half()])
    feed(slam, part(half(), len(truth())))
    poses = slam.finish().poses
    return poses, kept(slam, {"recording": "both halves"})


def same_ids(first: SavedMap, second: SavedMap) -> tuple[Floats, Floats, NDArray[np.int64], NDArray[np.int64]]:
    """Positions of the corners that are in both maps, and how often each was seen."""
    _, i, j = np.intersect1d(first.corners.ids, second.corners.ids, return_indices=True)
    return (
        first.corners.positions[i], second.corners.positions[j], first.corners.observed[i], second.corners.observed[j],
    )  # fmt: skip


def test_a_drive_cut_in_two_is_mapped_as_truly_as_an_uncut_one() -> None:
    poses, _ = continued()
    late = truth()[half() :]
    assert poses.shape == late.shape
    assert rmse(poses, late) < 1.2 * rmse(uncut()[half() :], late) + 0.01


def test_corners_and_walls_keep_their_ids_and_their_record() -> None:
    before, (_, after) = first_map(), continued()
    was, now, seen_before, seen_after = same_ids(before, after)
    assert len(was) >= 0.9 * len(before.corners.ids)
    assert np.linalg.norm(now - was, axis=1).max() < 0.15  # loops of the second half mend the first
    assert (seen_after >= seen_before).all()
    assert (seen_after > seen_before).any()
    assert len(np.intersect1d(before.walls.ids, after.walls.ids)) >= 0.9 * len(before.walls.ids)
    new = np.setdiff1d(after.corners.ids, before.corners.ids)
    assert before.seen is not None
    assert len(new) > 3
    assert new.min() >= len(before.seen.failures)  # an id is never given twice


def test_the_second_drive_is_tied_to_places_of_the_first() -> None:
    _, after = continued()
    assert after.relations is not None
    assert after.keyframes is not None
    drives, relations = after.keyframes.drives, after.relations
    between_drives = (relations.first >= 0) & (drives[relations.first] != drives[relations.second])
    assert (between_drives & relations.ties).sum() > 5
    assert (between_drives & ~relations.ties).sum() == 1  # where it began
    assert set(drives.tolist()) == {0, 1}


def test_a_map_taken_up_and_kept_again_is_the_same_map(tmp_path: Path) -> None:
    before = first_map()
    save_map(tmp_path / "map.cmap", before)
    again = kept(go_on(load_map(tmp_path / "map.cmap"), truth()[3]), before.about)
    assert before.keyframes is not None
    assert again.keyframes is not None
    for name in ("stamps", "poses", "covariances", "blurs", "starts", "points", "drives"):
        np.testing.assert_array_equal(getattr(again.keyframes, name), getattr(before.keyframes, name), err_msg=name)
    for part_, names in (
        ("corners", ("ids", "positions", "covariances", "directions", "openings", "convex", "observed", "failed")),
        ("walls", ("ids", "end_points", "end_point_covariances", "normals", "line_covariances", "observed", "failed")),
        ("seen", ("keys", "ids", "rows", "failures")),
        ("stretches", ("anchors", "starts", "members", "seen")),
        ("relations", ("first", "second", "poses", "robust", "ties")),
    ):
        for name in names:
            now, was = getattr(getattr(again, part_), name), getattr(getattr(before, part_), name)
            np.testing.assert_allclose(now, was, rtol=1e-9, atol=1e-12, err_msg=f"{part_}.{name}")
    assert again.relations is not None
    assert before.relations is not None
    scale = np.abs(before.relations.information).max(axis=(1, 2), keepdims=True)
    np.testing.assert_allclose(again.relations.information / scale, before.relations.information / scale, atol=1e-9)


def test_all_landmarks_that_were_kept_have_a_name_that_stays() -> None:
    saved = first_map()
    assert saved.seen is not None
    ids = np.concatenate([saved.corners.ids, saved.walls.ids])
    assert len(np.unique(ids)) == len(ids)
    assert ids.max() < len(saved.seen.failures)
    assert set(ids.tolist()) <= set(saved.seen.ids.tolist())


@pytest.mark.parametrize("off", [(0.25, 0.1, 0.03), (-0.1, 0.3, -0.05)])
def test_a_start_that_is_some_way_off_is_put_right_by_the_first_places(off: tuple[float, float, float]) -> None:
    poses, saved = first_half()
    poses = poses[half() // 2 : half() // 2 + 120]  # the same scans once more
    slam = go_on(saved, compose(poses[0], np.array(off)), np.diag([0.2**2, 0.2**2, 0.04**2]))
    feed(slam, part(half() // 2, half() // 2 + 120))
    assert rmse(slam.finish().poses, poses) < 0.03
    was, now, _, _ = same_ids(saved, kept(slam, {}))
    assert np.linalg.norm(now - was, axis=1).max() < 0.05


def test_a_third_drive_goes_on_from_a_map_that_was_not_refined() -> None:
    slam = go_on(continued()[1], truth()[10])
    feed(slam, part(10, 60))
    saved = kept(slam, {})  # before finish
    assert saved.keyframes is not None
    assert set(saved.keyframes.drives.tolist()) == {0, 1, 2}
    slam = go_on(saved, truth()[60])
    feed(slam, part(60, 160))
    assert rmse(slam.finish().poses, truth()[60:160]) < 0.05
    last = kept(slam, {}).keyframes
    assert last is not None
    assert last.drives[-1] == 3


def test_to_keep_a_map_midway_leaves_the_drive_as_it_is() -> None:
    slam, undisturbed = begin(), begin()
    feed(undisturbed, part(0, 160))
    for first in range(0, 160, 40):
        feed(slam, part(first, first + 40))
        saved = kept(slam, {})
    assert saved.keyframes is not None
    assert (np.linalg.eigvalsh(saved.keyframes.covariances) > 0.0).all()
    assert np.abs(between(undisturbed.finish().poses, slam.finish().poses)).max() < 0.05


def test_what_the_robot_saw_last_is_a_place_to_the_next_drive() -> None:
    slam = begin()
    feed(slam, part(0, 30))  # no local map is finished by then
    saved = kept(slam, {})
    assert saved.stretches is not None
    assert saved.keyframes is not None
    assert saved.stretches.members.tolist() == list(range(len(saved.keyframes)))
    slam = go_on(saved, truth()[0])
    feed(slam, part(0, 60))
    assert len(slam.finish().loops) > 0


def test_a_map_of_nothing_is_kept_and_cannot_be_continued(tmp_path: Path) -> None:
    save_map(tmp_path / "map.cmap", kept(GraphSlam(CONFIG), {}))
    with pytest.raises(MapError, match="it holds no keyframes"):
        go_on(load_map(tmp_path / "map.cmap"), np.zeros(3))


@pytest.mark.parametrize("lacking", ["keyframes", "relations", "seen", "stretches"])
def test_a_map_that_lacks_what_is_needed_says_so(lacking: str) -> None:
    saved = replace(first_map(), **{lacking: None})  # type: ignore[arg-type] # all four may be None
    with pytest.raises(MapError, match=r"cannot be continued: it holds no keyframes, or .*; map anew"):
        go_on(saved, np.zeros(3))


def test_old_places_are_as_unsure_as_they_were() -> None:
    slam = begin()
    feed(slam, part(0, half()))
    doubt = slam.memory.doubt
    saved = kept(slam, {})
    again = go_on(saved, truth()[0]).memory
    assert saved.keyframes is not None
    ratios = []
    anchors = [place.anchor for place in slam.memory.places.list]
    for i in range(1, len(anchors)):
        pose = saved.keyframes.poses[anchors[i]]
        was = doubt.between(slam.memory.nodes[anchors[i]], np.array([slam.memory.nodes[a] for a in anchors[:i]]), pose)
        now = again.doubt.between(again.nodes[anchors[i]], np.array([again.nodes[a] for a in anchors[:i]]), pose)
        ratios += np.sqrt(
            np.trace(now[:, :2, :2], axis1=1, axis2=2) / np.trace(was[:, :2, :2], axis1=1, axis2=2)
        ).tolist()
    assert 0.8 < np.median(ratios) < 1.5
    assert np.quantile(ratios, 0.05) > 0.5


@pytest.mark.parametrize("guess", [None, (0.4, -0.3, 0.15)], ids=["anywhere", "about_here"])
@pytest.mark.parametrize("where", [0.1, 0.5])
def test_the_start_of_a_further_drive_is_found_by_its_first_scans(
    where: float, guess: tuple[float, float, float] | None
) -> None:
    poses, saved = first_half()
    first = int(where * len(poses))
    scans = 0

    def messages() -> Iterator[LaserScan | Odometry]:
        nonlocal scans
        for message in part(first, min(first + 150, len(poses))):
            scans += isinstance(message, LaserScan)
            if not isinstance(message, TruePose):
                yield message

    about = None if guess is None else compose(poses[first], np.array(guess))
    found = find_start(saved, CONFIG, messages(), guess=about, lidar_mount=np.array(MOUNT))
    assert found is not None
    pose, covariance = found
    off = between(poses[first], pose)
    assert np.hypot(off[0], off[1]) < 0.03
    assert abs(off[2]) < 0.01
    np.testing.assert_allclose(covariance, covariance.T, rtol=1e-9)
    assert np.linalg.eigvalsh(covariance).min() > 0.0
    assert np.sqrt(np.diag(covariance)).max() < 0.2
    assert scans < 120  # no more of the drive is read than it takes


@pytest.mark.parametrize("building", [1, 6])
def test_a_building_that_begins_like_this_one_is_told_apart(building: int) -> None:
    elsewhere = [m for m in building_drive(20.0, building).messages() if not isinstance(m, TruePose)]
    assert find_start(first_map(), CONFIG, elsewhere, lidar_mount=np.array(MOUNT)) is None


def test_nothing_shows_no_start() -> None:
    assert find_start(first_map(), CONFIG, [], lidar_mount=np.array(MOUNT)) is None


def test_the_old_map_stands_as_it_was_kept_until_the_new_drive_moves_it() -> None:
    saved = first_map()
    assert saved.keyframes is not None
    slam = go_on(saved, truth()[half()])
    keys = range(len(saved.keyframes))
    np.testing.assert_allclose(slam.memory.graph.poses(keys), saved.keyframes.poses, atol=1e-9)
    feed(slam, part(half(), half() + 2))
    moved = between(saved.keyframes.poses, slam.memory.graph.poses(keys))
    assert np.abs(moved).max() < 0.02  # by the first tie
