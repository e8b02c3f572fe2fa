"""New landmarks and their Jacobians, the map handed out, and what stays of a landmark that goes."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from contourslam.geometry.angles import wrap
from contourslam.geometry.poses import compose, transform
from contourslam.landmarks import Corners, Walls
from contourslam.slam.ekf import augment
from contourslam.slam.landmark_filter import LandmarkFilter
from contourslam.slam.measurement import ANCHOR_X, ANCHOR_Y, END, START, measure_corner, measure_wall
from contourslam.slam.observation import Observations, to_world

Floats = NDArray[np.float64]
See = Callable[..., Observations]
MakeCorners = Callable[..., Corners]
MakeWalls = Callable[..., Walls]

angles = st.floats(-math.pi, math.pi)
poses = st.builds(lambda x, y, t: np.array([x, y, t]), st.floats(-9.0, 9.0), st.floats(-9.0, 9.0), angles)
mounts = st.builds(lambda x, y, t: np.array([x, y, t]), st.floats(-0.5, 0.5), st.floats(-0.5, 0.5), angles)
bearings = st.one_of(angles, st.sampled_from([math.pi, -math.pi + 1e-9]))


def place_corner(pose: Floats, mount: Floats, values: Floats) -> Floats:
    """Position of a corner seen at range and bearing, by plain composition of poses."""
    r, bearing = values
    return transform(compose(pose, mount), np.array([r * math.cos(bearing), r * math.sin(bearing)]))


def place_wall(pose: Floats, mount: Floats, values: Floats, anchor: Floats) -> Floats:
    """Normal direction and distance from the anchor of a wall seen at direction and distance."""
    lidar = compose(pose, mount)
    normal = values[0] + lidar[2]
    foot = lidar[:2] + values[1] * np.array([math.cos(normal), math.sin(normal)])
    return np.array([wrap(normal), math.cos(normal) * (foot - anchor)[0] + math.sin(normal) * (foot - anchor)[1]])


def differences(place: Callable[[Floats], Floats], at: Floats) -> Floats:
    step = 1e-6
    columns = []
    for k in range(at.size):
        difference = place(at + step * np.eye(at.size)[k]) - place(at - step * np.eye(at.size)[k])
        columns.append(np.array([math.remainder(difference[0], 2.0 * math.pi), difference[1]]) / (2.0 * step))
    return np.stack(columns, axis=1)


def check_new_landmark(
    full: Callable[..., Floats], covariance: Floats, pose: Floats, mount: Floats, seen: Observations,
    place: Callable[[LandmarkFilter], Callable[[Floats, Floats], Floats]],
) -> LandmarkFilter:  # fmt: skip
    """Add the only observation to a filter with this pose covariance; compare with numerical Jacobians."""
    filter_ = LandmarkFilter(pose)
    filter_.covariance[:3, :3] = np.tril(covariance)
    filter_.add(mount, seen, 0)
    where = place(filter_)
    np.testing.assert_allclose(
        np.cos(filter_.mean[3:5] - where(pose, seen.values[0])), 1.0, atol=1e-12
    )  # a cosine, for the angle of a wall wraps
    J = differences(lambda p: where(p, seen.values[0]), pose)
    Jz = differences(lambda z: where(pose, z), seen.values[0])
    P = full(filter_)
    np.testing.assert_allclose(P[3:, :3], J @ covariance, atol=1e-7)
    np.testing.assert_allclose(P[3:, 3:], J @ covariance @ J.T + Jz @ seen.noises[0] @ Jz.T, atol=1e-7)
    return filter_


@given(pose=poses, mount=mounts, r=st.floats(0.3, 12.0), bearing=bearings, seed=st.integers(0, 999))
def test_a_new_corner_has_the_covariance_of_pose_and_measurement(
    see: See, corners_at: MakeCorners, random_covariance: Callable[..., Floats], full: Callable[..., Floats],
    pose: Floats, mount: Floats, r: float, bearing: float, seed: int,
) -> None:  # fmt: skip
    rng = np.random.default_rng(seed)
    corners = corners_at([r * math.cos(bearing), r * math.sin(bearing)])
    corners.covariances[0] = random_covariance(2, rng)
    filter_ = check_new_landmark(
        full, random_covariance(3, rng), pose, mount, see(corners), lambda f: lambda p, z: place_corner(p, mount, z)
    )
    seen = measure_corner(pose, mount, *filter_.mean[3:5])
    np.testing.assert_allclose(seen[0], r, atol=1e-9)
    assert math.cos(seen[1] - bearing) == pytest.approx(1.0)


@given(pose=poses, mount=mounts, way=angles, distance=st.floats(0.3, 9.0), shift=st.floats(-4.0, 4.0),
       seed=st.integers(0, 999))  # fmt: skip
def test_a_new_wall_has_the_covariance_of_pose_and_measurement(
    see: See, walls_at: MakeWalls, random_covariance: Callable[..., Floats], full: Callable[..., Floats],
    pose: Floats, mount: Floats, way: float, distance: float, shift: float, seed: int,
) -> None:  # fmt: skip
    rng = np.random.default_rng(seed)
    normal, along = np.array([math.cos(way), math.sin(way)]), np.array([-math.sin(way), math.cos(way)])
    walls = walls_at([[distance * normal + (shift - 1.0) * along, distance * normal + (shift + 1.0) * along]])
    walls.covariances[0] = random_covariance(2, rng)

    def place(filter_: LandmarkFilter) -> Callable[[Floats, Floats], Floats]:
        anchor = filter_.table[0, ANCHOR_X : ANCHOR_Y + 1].copy()
        return lambda p, z: place_wall(p, mount, z, anchor)

    filter_ = check_new_landmark(full, random_covariance(3, rng), pose, mount, see(walls=walls), place)
    seen = measure_wall(pose, mount, *filter_.mean[3:5], *filter_.table[0, ANCHOR_X : ANCHOR_Y + 1])
    assert math.cos(seen[0] - walls.lines[0, 0]) == pytest.approx(1.0)
    assert seen[1] == pytest.approx(walls.lines[0, 1], abs=1e-9)


@pytest.mark.parametrize("what", ["corner", "wall"])
def test_the_covariance_of_a_new_landmark_is_that_of_sampled_ones(
    see: See, corners_at: MakeCorners, walls_at: MakeWalls, full: Callable[..., Floats], what: str
) -> None:
    rng = np.random.default_rng(11)
    pose, mount = np.array([2.0, -1.0, 2.5]), np.array([0.2, -0.1, 0.3])
    root = np.array([[0.02, 0.0, 0.0], [0.01, 0.02, 0.0], [0.003, -0.002, 0.004]])
    if what == "corner":
        seen = see(corners_at([3.0, 1.0], sigma=0.02))
    else:
        seen = see(walls=walls_at([[[3.0, -1.0], [3.5, 2.0]]]))
    filter_ = LandmarkFilter(pose)
    filter_.covariance[:3, :3] = root @ root.T
    filter_.add(mount, seen, 0)
    anchor = filter_.table[0, ANCHOR_X : ANCHOR_Y + 1]
    n = 20_000
    starts = pose + rng.normal(size=(n, 3)) @ root.T
    values = rng.multivariate_normal(seen.values[0], seen.noises[0], n)
    samples = np.empty((n, 5))
    for i in range(n):
        placed = (
            place_corner(starts[i], mount, values[i])
            if what == "corner"
            else place_wall(starts[i], mount, values[i], anchor)
        )
        samples[i] = [*starts[i], *placed]
    sampled = np.cov(samples.T)
    scale = np.sqrt(np.outer(np.diag(sampled), np.diag(sampled)))
    np.testing.assert_allclose(full(filter_) / scale, sampled / scale, atol=0.03)


def test_the_state_grows_past_its_room_and_loses_nothing(
    see: See, corners_at: MakeCorners, full: Callable[..., Floats]
) -> None:
    rng = np.random.default_rng(4)
    positions = rng.uniform(-5.0, 5.0, (70, 2))
    directions = rng.uniform(-3.0, 3.0, 70)
    filter_ = LandmarkFilter(np.zeros(3))
    filter_.covariance[:3, :3] = np.diag([1e-4, 1e-4, 1e-5])
    dense = filter_.covariance[:3, :3].copy()
    seen = see(corners_at(positions, directions=directions))
    for i in range(70):
        assert filter_.add(np.zeros(3), seen, i) == i
        one = np.zeros((len(dense) + 2, len(dense) + 2))
        one[: len(dense), : len(dense)] = dense
        x, y = positions[i]
        J = np.array([[1.0, 0.0, -y], [0.0, 1.0, x]])
        state = np.zeros(len(one))
        Jz = np.array([[x, -y], [y, x]]) / [np.hypot(x, y), 1.0]
        augment(state, one, len(dense), x, y, J, Jz, seen.noises[i])
        dense = np.tril(one) + np.tril(one, -1).T
    np.testing.assert_allclose(full(filter_), dense, atol=1e-12)
    landmarks = filter_.corner_map()
    np.testing.assert_allclose(landmarks.positions, positions, atol=1e-9)
    np.testing.assert_allclose(landmarks.directions, directions, atol=1e-9)
    np.testing.assert_array_equal(landmarks.ids, np.arange(70))


def test_an_id_is_never_used_again(see: See, corners_at: MakeCorners) -> None:
    seen = see(corners_at([[1.0, 0.0], [2.0, 0.0], [3.0, 0.0]]))
    filter_ = LandmarkFilter(np.zeros(3))
    for i in range(3):
        filter_.add(np.zeros(3), seen, i)
    assert filter_.drop(2) == 2
    assert filter_.drop(0) == 0
    assert [filter_.add(np.zeros(3), seen, i) for i in (0, 2)] == [3, 4]
    np.testing.assert_array_equal(filter_.corner_map().ids, [1, 3, 4])
    np.testing.assert_allclose(filter_.corner_map().positions[:, 0], [2.0, 1.0, 3.0])


def test_dropping_a_landmark_takes_its_whole_story_and_no_other(
    map_of: Callable[..., LandmarkFilter], corners_at: MakeCorners, full: Callable[..., Floats]
) -> None:
    filter_ = map_of(corners_at([[1.0, 0.0], [2.0, 0.5], [3.0, 0.0]], directions=[0.1, 0.2, 0.3]))
    filter_.observed[:3], filter_.failed[:3] = [7, 8, 9], [1, 2, 3]
    before = full(filter_)
    filter_.drop(1)
    left = filter_.corner_map()
    np.testing.assert_array_equal(left.ids, [0, 2])
    np.testing.assert_array_equal(left.observed, [7, 9])
    np.testing.assert_array_equal(left.failed, [1, 3])
    np.testing.assert_allclose(left.directions, [0.1, 0.3])
    np.testing.assert_array_equal(full(filter_), np.delete(np.delete(before, [5, 6], 0), [5, 6], 1))


def test_the_map_handed_out_does_not_change_with_the_filter(
    map_of: Callable[..., LandmarkFilter], corners_at: MakeCorners, walls_at: MakeWalls
) -> None:
    filter_ = map_of(corners_at([1.0, 0.5]), walls_at([[[2.0, -1.0], [2.0, 1.0]]]))
    corners, walls = filter_.corner_map(), filter_.wall_map()
    filter_.mean[:] += 1.0
    filter_.covariance[:] = 9.0
    filter_.table[:] = 9.0
    filter_.ids[:] = filter_.observed[:] = filter_.failed[:] = 9
    np.testing.assert_allclose(corners.positions, [[1.0, 0.5]])
    np.testing.assert_allclose(walls.end_points, [[[2.0, -1.0], [2.0, 1.0]]], atol=1e-12)
    for snapshot in (corners, walls):
        assert snapshot.observed.tolist() == snapshot.failed.tolist() == [0]
        assert 9 not in snapshot.ids
    assert corners.covariances.max() < 1.0


@given(pose=poses)
def test_a_wall_of_the_map_ends_where_it_was_seen_to_end(
    map_of: Callable[..., LandmarkFilter], walls_at: MakeWalls, pose: Floats
) -> None:
    ends = np.array([[2.0, -1.0], [2.5, 1.5]])  # counter-clockwise: from the right to the left of whoever looks at it
    walls = map_of(walls=walls_at([ends]), pose=pose).wall_map()
    np.testing.assert_allclose(walls.end_points[0], transform(pose, ends), atol=1e-9)
    into_wall = transform(pose, ends.mean(axis=0)) - pose[:2]
    assert into_wall @ [math.cos(walls.normals[0]), math.sin(walls.normals[0])] > 0.0


def test_end_points_and_line_of_a_wall_carry_the_covariance_of_sampled_walls(
    map_of: Callable[..., LandmarkFilter], walls_at: MakeWalls
) -> None:
    rng = np.random.default_rng(3)
    filter_ = map_of(walls=walls_at([[[2.0, -1.0], [2.0, 3.0]]]))
    filter_.covariance[3:5, 3:5] = [[1e-4, 0.0], [4e-5, 9e-5]]
    # The extent grew since birth, so the middle of the wall no longer is its anchor.
    filter_.table[0, END] += 2.0
    walls = filter_.wall_map()
    anchor, start, end = filter_.table[0, ANCHOR_X : ANCHOR_Y + 1], filter_.table[0, START], filter_.table[0, END]
    lines = rng.multivariate_normal(filter_.mean[3:5], filter_.block(0), 100_000)
    normals = np.stack([np.cos(lines[:, 0]), np.sin(lines[:, 0])], axis=1)
    tangents = np.stack([-normals[:, 1], normals[:, 0]], axis=1)
    for e, along in enumerate((start, end)):
        samples = anchor + lines[:, 1:] * normals + along * tangents
        across = np.array([math.cos(walls.normals[0]), math.sin(walls.normals[0])])
        assert across @ walls.end_point_covariances[0, e] @ across == pytest.approx((samples @ across).var(), rel=0.03)
    middle = 0.5 * (start + end)
    fixed = anchor + middle * np.array([-math.sin(walls.normals[0]), math.cos(walls.normals[0])])
    distance = np.sum(normals * (anchor - fixed), axis=1) + lines[:, 1]
    np.testing.assert_allclose(walls.line_covariances[0], np.cov(lines[:, 0], distance), rtol=0.05)


def test_the_direction_of_a_corner_is_averaged_across_the_half_turn(
    map_of: Callable[..., LandmarkFilter], see: See, corners_at: MakeCorners
) -> None:
    filter_ = map_of(corners_at([2.0, 0.0], directions=math.pi - 0.1, openings=1.4, sides=(0.5, 1.0)))
    filter_.observed[0] = 1  # so the second sighting counts half
    looks = see(corners_at([2.0, 0.0], directions=-math.pi + 0.2, openings=1.6, sides=(0.8, 0.6))).looks
    filter_.refresh(np.array([0]), to_world(np.zeros(3), np.zeros(3), looks))
    landmark = filter_.corner_map()
    assert landmark.directions[0] == pytest.approx(-math.pi + 0.05)
    assert landmark.openings[0] == pytest.approx(1.5)
    assert (filter_.table[0, START], filter_.table[0, END]) == (0.8, 1.0)  # the longest seen of each side


def test_a_wall_grows_by_what_is_seen_of_it_and_never_shrinks(
    map_of: Callable[..., LandmarkFilter], see: See, walls_at: MakeWalls
) -> None:
    filter_ = map_of(walls=walls_at([[[2.0, -1.0], [2.0, 1.0]]]))
    for ends in ([[2.0, 0.0], [2.0, 3.0]], [[2.0, 0.2], [2.0, 0.9]]):
        filter_.refresh(np.array([0]), to_world(np.zeros(3), np.zeros(3), see(walls=walls_at([ends])).looks))
    np.testing.assert_allclose(filter_.wall_map().end_points[0], [[2.0, -1.0], [2.0, 3.0]], atol=1e-9)


@pytest.mark.parametrize("convex", [True, False])
def test_each_side_of_a_corner_keeps_its_own_length(
    map_of: Callable[..., LandmarkFilter], corners_at: MakeCorners, convex: bool
) -> None:
    # The contour comes counter-clockwise. At the edge of a box it comes up the side on the right hand ...
    filter_ = map_of(corners_at([2.0, 0.0], directions=0.0 if convex else math.pi, convex=convex, sides=(0.4, 2.0)))
    direction, opening = filter_.table[0, 5], filter_.table[0, 6]
    ends = {}
    for way, column in ((-1.0, START), (1.0, END)):
        side = direction + way * opening / 2
        length = filter_.table[0, column]
        ends[length] = filter_.mean[4] + length * math.sin(side)
    assert ends[0.4] < 0.0 < ends[2.0]  # ... so the short first side lies to the right, the second to the left
