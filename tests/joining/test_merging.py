"""Maps that were merged: one frame, nothing doubled, nothing lost, as true as if one robot had driven it all."""

from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from contourslam.config import Config
from contourslam.errors import MapError
from contourslam.geometry.poses import between, between_one, compose, compose_one, interpolate, inverse
from contourslam.maps import Contoured, SavedMap, Seen, load_map, save_map
from contourslam.maps.consistency import problems
from contourslam.scan import LaserScan, Odometry, TruePose

pytest.importorskip("gtsam", reason="needs the extra 'graph'")
pytest.importorskip("shapely", reason="needs the extra 'simulation'")

from contourslam.graph import GraphSlam, kept, resume
from contourslam.joining.joint import Evidence, Joint, Tie
from contourslam.joining.merging import Merged, merge_maps
from contourslam.localization.follow import Localizer
from contourslam.simulation.long_drive import building_drive

Floats = NDArray[np.float64]
Message = LaserScan | Odometry | TruePose
Pair = tuple[int, int]

CONFIG = Config(back_end="graph")
LENGTH, SEED = 70.0, 0
MOUNT = building_drive(LENGTH, SEED).lidar_mount
TIED = np.diag([0.02**2, 0.02**2, 0.005**2])
NEAR = 1.5  # m; keyframes this near see the same


@cache
def drive() -> tuple[Message, ...]:
    return tuple(building_drive(LENGTH, SEED).messages())


def true_at(stamps: Floats) -> Floats:
    rows = np.array([(m.stamp, *m.pose) for m in drive() if isinstance(m, TruePose)])
    return interpolate(rows[:, 0], rows[:, 1:], stamps)


def feed(slam: GraphSlam, first: float, until: float) -> None:
    """The scans between two parts of the way, with the odometry just before."""
    ends = [i for i, message in enumerate(drive()) if isinstance(message, LaserScan)]
    low, high = int(first * len(ends)), int(until * len(ends))
    for message in drive()[ends[low - 1] + 1 if low else 0 : ends[high - 1] + 1]:
        if isinstance(message, Odometry):
            slam.push_odometry(message)
        elif isinstance(message, LaserScan):
            slam.push_scan(message)


@cache
def mapped(first: float, until: float) -> SavedMap:
    """A part of the drive, from the origin of a frame of its own."""
    slam = GraphSlam(CONFIG, lidar_mount=MOUNT)
    feed(slam, first, until)
    slam.finish()
    return kept(slam, {"recordings": f"{first} to {until}", "detector": CONFIG.detector})


def gone_on(before: SavedMap, first: float, until: float) -> SavedMap:
    """A map with a further part of the drive in it, which begins where it truly does."""
    keyframes = frames(before)
    stamps = np.array([m.stamp for m in drive() if isinstance(m, LaserScan)])
    start = true_at(stamps[int(first * len(stamps)) :][:1])[0]
    begin = compose_one(keyframes.poses[0], between_one(true_at(keyframes.stamps[:1])[0], start))
    slam = resume(CONFIG, before, begin, TIED, lidar_mount=MOUNT)
    feed(slam, first, until)
    slam.finish()
    return kept(slam, before.about)


def frames(saved: SavedMap) -> Contoured:
    assert saved.keyframes is not None
    return saved.keyframes


def sightings(saved: SavedMap) -> Seen:
    assert saved.seen is not None
    return saved.seen


def joint(first: SavedMap, second: SavedMap, ties: int = 5) -> Joint:
    """The second laid on the first by some keyframes that truly lie side by side."""
    one, other = true_at(frames(first).stamps), true_at(frames(second).stamps)
    pairs = np.argwhere(np.hypot(*(one[:, None] - other[None])[..., :2].transpose(2, 0, 1)) < NEAR)
    assert len(pairs) > ties
    chosen = pairs[np.linspace(0, len(pairs) - 1, ties).astype(int)].tolist()
    found = tuple(Tie(a, b, between_one(one[a], other[b]), TIED) for a, b in chosen)
    a, b = chosen[0]
    pose = compose_one(compose_one(frames(first).poses[a], found[0].pose), inverse(frames(second).poses[b]))
    return Joint(pose, found, Evidence(10, 10, 20.0, 0.0, 10.0, 0.1), "constellation")


@cache
def halves() -> tuple[SavedMap, SavedMap]:
    """Two robots in one building; the first has seen a little more."""
    return mapped(0.0, 0.52), mapped(0.52, 1.0)


@cache
def merged() -> Merged:
    (out,) = merge_maps(halves(), {(0, 1): joint(*halves())})
    return out


def rmse(poses: Floats, truth: Floats) -> float:
    """After the rigid motion that fits them best."""
    own, true = poses[:, :2] - poses[:, :2].mean(axis=0), truth[:, :2] - truth[:, :2].mean(axis=0)
    u, _, v = np.linalg.svd(own.T @ true)
    turn = u @ np.diag([1.0, np.linalg.det(u @ v)]) @ v
    return float(np.sqrt(np.mean(np.sum((own @ turn - true) ** 2, axis=1))))


def assert_same(first: SavedMap, second: SavedMap) -> None:
    for part in ("corners", "walls", "keyframes", "relations", "seen", "stretches"):
        one, other = getattr(first, part), getattr(second, part)
        for name in type(one).__slots__:
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name), err_msg=f"{part}.{name}")


def test_two_halves_of_a_drive_merged_are_as_true_as_the_drive() -> None:
    keyframes, whole = frames(merged().saved), frames(mapped(0.0, 1.0))
    error = rmse(keyframes.poses, true_at(keyframes.stamps))
    assert error < 1.2 * rmse(whole.poses, true_at(whole.stamps)) + 0.005
    assert error < 0.02


def test_every_keyframe_and_sighting_is_there_once() -> None:
    out = merged()
    np.testing.assert_array_equal(np.sort(np.concatenate(out.keys)), np.arange(len(frames(out.saved))))
    rows = sightings(out.saved)
    assert len(rows.keys) == sum(len(sightings(half).keys) for half in halves())
    for member, keys in zip(out.members, out.keys, strict=True):
        old = halves()[member]
        for mine, new in ((0, keys[0]), (len(keys) - 1, keys[-1]), (7, keys[7])):
            np.testing.assert_array_equal(frames(out.saved).contour(new), frames(old).contour(mine))
            assert frames(out.saved).stamps[new] == frames(old).stamps[mine]
            np.testing.assert_array_equal(rows.rows[rows.keys == new], sightings(old).rows[sightings(old).keys == mine])
    assert frames(out.saved).drives.tolist() == [0] * len(out.keys[0]) + [1] * len(out.keys[1])


def test_the_frame_and_the_landmarks_of_the_map_with_the_most_keyframes_stay() -> None:
    out = merged()
    assert out.members == (0, 1)
    first = halves()[0]
    moved = between(frames(first).poses, frames(out.saved).poses[out.keys[0]])
    assert np.abs(moved).max() < 0.03
    np.testing.assert_allclose(moved[0], 0.0, atol=1e-3)
    assert len(np.intersect1d(out.saved.corners.ids, first.corners.ids)) >= 0.9 * len(first.corners.ids)
    assert len(np.intersect1d(out.saved.walls.ids, first.walls.ids)) >= 0.9 * len(first.walls.ids)


def test_landmarks_that_both_saw_become_one_and_their_records_add_up() -> None:
    out, whole = merged().saved, mapped(0.0, 1.0)
    assert abs(len(out.corners.ids) - len(whole.corners.ids)) <= 2
    assert abs(len(out.walls.ids) - len(whole.walls.ids)) <= 3
    assert len(out.corners.ids) < sum(len(half.corners.ids) for half in halves())
    near = np.hypot(*(out.corners.positions[:, None] - out.corners.positions[None]).transpose(2, 0, 1))
    turned = np.abs(out.corners.directions[:, None] - out.corners.directions[None]) > 0.5
    assert (near + np.eye(len(near)) > 0.1).all() or turned[near < 0.1].any()
    _, i, j = np.intersect1d(out.corners.ids, halves()[0].corners.ids, return_indices=True)
    more = out.corners.observed[i] - halves()[0].corners.observed[j]
    assert (more >= -2).all()  # one sighting or another may be taken for a neighbour's now
    assert (more > 5).any()


def test_a_merged_map_is_sound_and_is_kept_to_the_bit(tmp_path: Path) -> None:
    assert list(problems(merged().saved)) == []
    save_map(tmp_path / "merged.cmap", merged().saved)
    assert_same(load_map(tmp_path / "merged.cmap"), merged().saved)
    assert merged().saved.about["recordings"] == "0.0 to 0.52\n0.52 to 1.0"


def test_poses_are_as_surely_known_as_in_one_drive_and_not_more() -> None:
    out, whole = frames(merged().saved), frames(mapped(0.0, 1.0))
    _, i, j = np.intersect1d(out.stamps, whole.stamps, return_indices=True)
    late = whole.stamps[j] > np.median(whole.stamps)
    sigma, known = (
        np.sqrt(np.trace(c[:, :2, :2], axis1=1, axis2=2)) for c in (out.covariances[i], whole.covariances[j])
    )
    ratio = float(np.median(sigma[late] / known[late]))
    assert 0.5 < ratio < 2.0
    assert (np.linalg.eigvalsh(out.covariances) > 0.0).all()


def test_the_order_of_the_maps_does_not_matter_but_for_ids() -> None:
    first, second = halves()
    (other,) = merge_maps((second, first), {(1, 0): joint(first, second)})
    assert other.members == (1, 0)
    np.testing.assert_allclose(frames(other.saved).poses, frames(merged().saved).poses, atol=1e-6)
    (turned,) = merge_maps((second, first), {(0, 1): joint(second, first)})  # as seen from the other map
    assert np.abs(between(frames(turned.saved).poses, frames(merged().saved).poses)).max() < 0.02


def test_a_merged_map_goes_on() -> None:
    out = merged()
    saved = gone_on(out.saved, 0.7, 0.85)  # where only the second of them was
    assert list(problems(saved)) == []
    assert frames(saved).drives[-1] == 2
    new = frames(saved).drives == 2
    assert rmse(frames(saved).poses, true_at(frames(saved).stamps)) < 0.02
    moved = between(frames(out.saved).poses, frames(saved).poses[~new])
    assert np.abs(moved[:, :2]).max() < 0.03
    assert len(np.intersect1d(saved.corners.ids, out.saved.corners.ids)) >= 0.9 * len(out.saved.corners.ids)


@pytest.mark.parametrize("where", [0.2, 0.8])
def test_a_robot_is_found_in_either_part_of_a_merged_map(where: float) -> None:
    out = frames(merged().saved)
    robot = Localizer(merged().saved, CONFIG, lidar_mount=np.array(MOUNT))
    scans = [m for m in drive() if isinstance(m, LaserScan)]
    for scan in scans[int(where * len(scans)) :][:40]:
        robot.push_scan(scan)
        if robot.localized:
            break
    assert robot.localized
    here = robot.push_scan(scan).pose
    nearest = int(np.abs(out.stamps - scan.stamp).argmin())
    expected = compose_one(
        out.poses[nearest],
        between_one(true_at(out.stamps[nearest : nearest + 1])[0], true_at(np.array([scan.stamp]))[0]),
    )
    assert np.hypot(*between_one(expected, here)[:2]) < 0.1


def test_maps_without_a_joint_are_unchanged_to_the_bit() -> None:
    first, second = merge_maps(halves(), {})
    assert (first.members, second.members) == ((0,), (1,))
    assert first.saved is halves()[0]
    assert second.saved is halves()[1]


def test_a_map_merged_with_itself_is_that_map(tmp_path: Path) -> None:
    save_map(tmp_path / "map.cmap", halves()[0])
    again = load_map(tmp_path / "map.cmap")
    (out,) = merge_maps([halves()[0], again], {(0, 1): joint(halves()[0], again)})
    assert_same(out.saved, halves()[0])
    assert out.members == (0, 1)


def test_a_map_merged_with_what_became_of_it_is_the_later_one() -> None:
    first, later = halves()[0], gone_on(halves()[0], 0.6, 0.7)
    (out,) = merge_maps([first, later], {})
    assert_same(out.saved, later)
    assert out.members == (1, 0)
    np.testing.assert_array_equal(frames(out.saved).stamps[out.keys[1]], frames(first).stamps)


def test_a_drive_that_two_maps_went_on_from_is_taken_once() -> None:
    first = mapped(0.0, 0.4)
    ways = [gone_on(first, 0.4, 0.7), gone_on(first, 0.3, 0.6)]
    (out,) = merge_maps(ways, {})  # what they share binds them
    keyframes, count = frames(out.saved), [len(frames(way)) for way in ways]
    assert len(keyframes) == sum(count) - len(frames(first))
    assert keyframes.drives[-1] == 2
    assert list(problems(out.saved)) == []
    seen = [len(sightings(saved).keys) for saved in (*ways, first)]
    assert len(sightings(out.saved).keys) == seen[0] + seen[1] - seen[2]
    assert rmse(keyframes.poses, true_at(keyframes.stamps)) < 0.02
    assert len(np.intersect1d(out.saved.corners.ids, first.corners.ids)) >= 0.9 * len(first.corners.ids)
    relations = out.saved.relations
    assert relations is not None
    plain = ~relations.ties
    rows = set(zip(relations.first[plain], relations.second[plain], map(bytes, relations.poses[plain]), strict=True))
    assert len(rows) == plain.sum()


def lacking(parts: Sequence[str]) -> Iterator[SavedMap]:
    whole = halves()[0]
    for part in parts:
        values = {name: getattr(whole, name) for name in SavedMap.__slots__ if name not in (part, "about")}
        yield SavedMap(**values)


def test_a_map_that_lacks_what_is_needed_says_so() -> None:
    for poor in lacking(("keyframes", "relations", "seen", "stretches")):
        with pytest.raises(MapError, match="it holds no keyframes, or not what binds them"):
            merge_maps([halves()[1], poor], {})


def test_three_maps_become_one_by_two_joints() -> None:
    maps = [mapped(0.0, 0.35), mapped(0.35, 0.7), mapped(0.7, 1.0)]
    (out,) = merge_maps(maps, {(0, 1): joint(maps[0], maps[1]), (2, 1): joint(maps[2], maps[1])})
    keyframes = frames(out.saved)
    assert len(keyframes) == sum(len(frames(saved)) for saved in maps)
    assert rmse(keyframes.poses, true_at(keyframes.stamps)) < 0.02
    lead = maps[out.members[0]]
    start = compose(frames(lead).poses[:1], between(true_at(frames(lead).stamps[:1]), true_at(keyframes.stamps)))
    assert np.hypot(*(start - keyframes.poses)[:, :2].T).max() < 0.15  # in its frame
