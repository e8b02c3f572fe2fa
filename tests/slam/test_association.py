"""Which observation finds which landmark: the paper's rule, the gates, looks, ambiguity."""

import math
from collections.abc import Callable, Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from contourslam.config import SlamConfig
from contourslam.geometry.poses import between, compose, inverse, transform
from contourslam.landmarks import Corners, Walls
from contourslam.slam.association import associate
from contourslam.slam.gating import looks_alike
from contourslam.slam.landmark_filter import LandmarkFilter
from contourslam.slam.measurement import measure_corner, predict_measurements
from contourslam.slam.observation import Observations, to_world

Floats = NDArray[np.float64]
See = Callable[..., Observations]
MakeCorners = Callable[..., Corners]
MakeWalls = Callable[..., Walls]
MapOf = Callable[..., LandmarkFilter]
Match = Callable[..., list[int]]

MODES = ("nearest", "mahalanobis", "mutual", "joint")


@pytest.fixture(scope="module")
def match() -> Match:
    def run(
        filter_: LandmarkFilter, seen: Observations, association: str, mount: Sequence[float] = (0.0, 0.0, 0.0), **more
    ) -> list[int]:
        T_base_lidar = np.array(mount)
        pose = filter_.mean[:3]
        world = to_world(pose, T_base_lidar, seen.looks)
        model = predict_measurements(pose, T_base_lidar, filter_.mean, filter_.table, filter_.count, False)
        return associate(seen, world, filter_, model, SlamConfig(association=association, **more)).tolist()

    return run


@pytest.mark.parametrize("mode", MODES)
def test_each_observation_finds_its_own_landmark(
    match: Match, map_of: MapOf, see: See, corners_at: MakeCorners, mode: str
) -> None:
    positions = np.array([[3.0, 1.0], [2.0, -1.5], [-1.0, 2.0], [-2.5, -1.0]])
    filter_ = map_of(corners_at(positions))
    order = [2, 0, 3, 1]
    seen = see(corners_at(np.append(positions[order] + 0.005, [[6.0, 6.0]], axis=0)))
    assert match(filter_, seen, mode) == [*order, -1]


@pytest.mark.parametrize("mode", MODES)
def test_a_scan_without_corners_and_a_map_without_landmarks_match_nothing(
    match: Match, map_of: MapOf, see: See, corners_at: MakeCorners, mode: str
) -> None:
    assert match(map_of(corners_at([1.0, 1.0])), see(), mode) == []
    assert match(map_of(), see(corners_at([1.0, 1.0])), mode) == [-1]


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("heading", [0.0, math.pi / 2, math.pi, -3.1, 3.1])
def test_landmarks_behind_the_robot_associate(
    match: Match, map_of: MapOf, see: See, corners_at: MakeCorners, mode: str, heading: float
) -> None:
    # Seen from +pi - 0.002 while expected at -pi + 0.002: the classic wrap bug lets these never match.
    pose, mount = np.array([1.0, -2.0, heading]), np.array([0.1, 0.0, 0.0])
    filter_ = map_of(corners_at([[-2.0, 0.004], [-3.0, -0.006]]), pose=pose, mount=mount)
    seen = see(corners_at([[-2.0, -0.004], [-3.0, 0.006]]))
    assert match(filter_, seen, mode, mount) == [0, 1]


@given(
    x=st.floats(-9.0, 9.0),
    y=st.floats(-9.0, 9.0),
    heading=st.floats(-math.pi, math.pi),
    yaw=st.floats(-math.pi, math.pi),
    mode=st.sampled_from(MODES),
)
def test_association_does_not_depend_on_where_the_world_puts_its_origin(
    match: Match, map_of: MapOf, see: See, corners_at: MakeCorners, walls_at: MakeWalls, x: float, y: float,
    heading: float, yaw: float, mode: str,
) -> None:  # fmt: skip
    corners = corners_at([[2.0, 1.0], [-2.0, 0.0], [0.5, -2.0]], directions=[0.5, math.pi, -1.5])
    walls = walls_at([[[2.0, -1.0], [2.0, 1.0]], [[-2.0, 1.0], [-2.0, -1.0]]])
    mount = np.array([0.2, -0.1, yaw])
    filter_ = map_of(corners, walls, pose=(x, y, heading), mount=mount)
    assert match(filter_, see(corners, walls), mode, mount) == [0, 1, 2, 3, 4]


def test_the_paper_takes_the_nearest_within_its_threshold(
    match: Match, map_of: MapOf, see: See, corners_at: MakeCorners
) -> None:
    filter_ = map_of(corners_at([[2.0, 0.0], [2.0, 1.0]]))
    seen = see(corners_at([[2.0, 0.45], [2.0, 1.3], [2.0, -0.31]]))
    assert match(filter_, seen, "nearest", nearest_threshold=0.5) == [-1, 1, 0]  # the first loses to the third
    assert match(filter_, seen, "nearest", nearest_threshold=0.305) == [-1, 1, -1]


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 1, 0), (1, 0, 2), (1, 2, 0)])
def test_where_several_observations_want_one_landmark_the_nearest_gets_it(
    match: Match, map_of: MapOf, see: See, corners_at: MakeCorners, order: tuple[int, ...]
) -> None:
    filter_ = map_of(corners_at([2.0, 0.0]))
    offsets = np.array([0.2, 0.1, 0.15])[list(order)]
    seen = see(corners_at([[2.0, offset] for offset in offsets]))
    assert match(filter_, seen, "nearest") == [0 if offset == 0.1 else -1 for offset in offsets]


def test_the_papers_rule_knows_no_looks_and_no_covariance(
    match: Match, map_of: MapOf, see: See, corners_at: MakeCorners
) -> None:
    filter_ = map_of(corners_at([2.0, 0.0], directions=0.0, convex=True))
    seen = see(corners_at([2.0, 0.3], directions=math.pi, convex=False))
    assert match(filter_, seen, "nearest") == [0]
    for mode in ("mahalanobis", "mutual", "joint"):
        assert match(filter_, seen, mode) == [-1]


def test_mahalanobis_takes_the_likelier_landmark_and_mutual_leaves_the_ambiguous_open(
    match: Match, map_of: MapOf, see: See, corners_at: MakeCorners
) -> None:
    # Two corners 6 cm apart, a doubt of about 3 cm: both explain what is seen between them.
    filter_ = map_of(corners_at([[2.0, -0.03], [2.0, 0.03], [-2.0, 0.0]], sigma=0.02))
    seen = see(corners_at([[2.0, 0.01], [-2.0, 0.0]], sigma=0.02))
    assert match(filter_, seen, "mahalanobis") == [1, 2]
    assert match(filter_, seen, "mutual") == [-1, 2]


def test_two_observations_of_one_landmark_leave_it_open_or_go_to_the_likelier(
    match: Match, map_of: MapOf, see: See, corners_at: MakeCorners
) -> None:
    filter_ = map_of(corners_at([2.0, 0.0], sigma=0.02))
    seen = see(corners_at([[2.0, -0.03], [2.0, 0.02]], sigma=0.02))
    assert match(filter_, seen, "mahalanobis") == [-1, 0]
    assert match(filter_, seen, "mutual") == [-1, -1]


@pytest.mark.parametrize("probability", [0.8, 0.95, 0.99])
def test_a_true_match_passes_the_gate_with_the_configured_probability(
    match: Match, map_of: MapOf, see: See, corners_at: MakeCorners, random_covariance: Callable[..., Floats],
    probability: float,
) -> None:  # fmt: skip
    rng = np.random.default_rng(17)
    filter_ = map_of(corners_at([-3.0, 0.5]), pose=(1.0, 2.0, 0.7))
    covariance = random_covariance(5, rng, 0.01)  # small, so that the measurement is linear over it
    filter_.covariance[:5, :5] = np.tril(covariance)
    n, passed, mount = 2000, 0, np.zeros(3)
    truths = rng.multivariate_normal(filter_.mean[:5], covariance, n)
    for truth in truths:
        r, bearing = measure_corner(truth[:3], mount, truth[3], truth[4])
        position = np.array([r * math.cos(bearing), r * math.sin(bearing)]) + rng.normal(size=2) * 0.01
        passed += match(filter_, see(corners_at(position)), "mahalanobis", gate_probability=probability) == [0]
    assert passed / n == pytest.approx(probability, abs=4.0 * math.sqrt(probability * (1.0 - probability) / n))


LOOKS = {
    "direction": ({"directions": math.radians(39.0)}, {"directions": math.radians(41.0)}),
    "opening": ({"openings": math.radians(124.0)}, {"openings": math.radians(126.0)}),
    "convexity": ({"convex": True}, {"convex": False}),
}


@pytest.mark.parametrize("what", LOOKS)
@pytest.mark.parametrize("mode", ["mahalanobis", "mutual", "joint"])
def test_a_corner_that_looks_otherwise_is_another_corner(
    match: Match, map_of: MapOf, see: See, corners_at: MakeCorners, what: str, mode: str
) -> None:
    filter_ = map_of(corners_at([2.0, 0.0]))
    like, unlike = LOOKS[what]
    assert match(filter_, see(corners_at([2.0, 0.0], **like)), mode) == [0]
    assert match(filter_, see(corners_at([2.0, 0.0], **unlike)), mode) == [-1]


@pytest.mark.parametrize("mode", ["mahalanobis", "mutual", "joint"])
def test_directions_are_compared_across_the_half_turn(
    match: Match, map_of: MapOf, see: See, corners_at: MakeCorners, mode: str
) -> None:
    filter_ = map_of(corners_at([2.0, 0.0], directions=math.pi - 0.2))
    assert match(filter_, see(corners_at([2.0, 0.0], directions=-math.pi + 0.2)), mode) == [0]
    assert match(filter_, see(corners_at([2.0, 0.0], directions=0.0)), mode) == [-1]


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("thickness", [0.0, 0.05, 0.12])
def test_the_two_faces_of_a_thin_partition_are_told_apart(
    match: Match, map_of: MapOf, see: See, walls_at: MakeWalls, mode: str, thickness: float
) -> None:
    # The map holds the face that is seen from the origin; the robot now stands on the other side and looks back.
    filter_ = map_of(walls=walls_at([[[2.0, -1.0], [2.0, 1.0]]]))
    filter_.mean[:3] = [4.0, 0.0, math.pi]
    near = see(walls=walls_at([[[2.0 - thickness, -1.0], [2.0 - thickness, 1.0]]]))
    assert match(filter_, near, mode) == [-1]
    filter_.mean[:3] = [0.5, 0.2, 0.3]
    face = transform(between(filter_.mean[:3], np.zeros(3)), np.array([[2.0, -1.0], [2.0, 1.0]]))
    assert match(filter_, see(walls=walls_at([face])), mode) == [0]


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize(("gap", "same"), [(-0.5, True), (0.0, True), (0.49, True), (0.51, False), (3.0, False)])
@pytest.mark.parametrize("left", [True, False])
def test_pieces_of_a_line_are_one_wall_up_to_a_gap_of_half_a_metre(
    match: Match, map_of: MapOf, see: See, walls_at: MakeWalls, mode: str, gap: float, same: bool, left: bool
) -> None:
    filter_ = map_of(walls=walls_at([[[2.0, -1.0], [2.0, 1.0]]]))
    piece = [[2.0, 1.0 + gap], [2.0, 2.2 + gap]] if left else [[2.0, -2.2 - gap], [2.0, -1.0 - gap]]
    assert match(filter_, see(walls=walls_at([piece])), mode) == ([0] if same else [-1])


@pytest.mark.parametrize("mode", MODES)
def test_a_corner_never_matches_a_wall(
    match: Match, map_of: MapOf, see: See, corners_at: MakeCorners, walls_at: MakeWalls, mode: str
) -> None:
    corner, wall = corners_at([2.0, 0.0]), walls_at([[[2.0, -1.0], [2.0, 1.0]]])
    assert match(map_of(corner), see(walls=wall), mode) == [-1]
    assert match(map_of(walls=wall), see(corner), mode) == [-1]


@pytest.mark.parametrize("mode", MODES)
def test_a_parallel_wall_a_metre_behind_is_another_wall(
    match: Match, map_of: MapOf, see: See, walls_at: MakeWalls, mode: str
) -> None:
    filter_ = map_of(walls=walls_at([[[2.0, -1.0], [2.0, 1.0]]]))
    assert match(filter_, see(walls=walls_at([[[3.0, -1.0], [3.0, 1.0]]])), mode) == [-1]


@given(x=st.floats(-9.0, 9.0), y=st.floats(-9.0, 9.0), heading=st.floats(-math.pi, math.pi))
def test_looks_are_alike_whatever_frame_they_are_seen_from(
    map_of: MapOf, see: See, walls_at: MakeWalls, x: float, y: float, heading: float
) -> None:
    ends = np.array([[2.0, -1.0], [2.5, 1.0]])
    filter_ = map_of(walls=walls_at([ends]))
    pose = np.array([x, y, heading])
    seen = see(walls=walls_at([transform(inverse(compose(pose, np.zeros(3))), ends)]))
    assert looks_alike(to_world(pose, np.zeros(3), seen.looks)[0], filter_.table[0], filter_.mean[3])
