"""A robot found in a known map without a first guess: surely where the place is like no other, in doubt elsewhere."""

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from contourslam.config import Config
from contourslam.detectors import make_detector
from contourslam.errors import MapError
from contourslam.geometry.angles import wrap_angle
from contourslam.geometry.poses import between_one
from contourslam.landmarks import find_landmarks, trace
from contourslam.localization.known_map import KnownMap
from contourslam.localization.locate import NOT_FOUND, Locator
from contourslam.localization.looks import constellation_of
from contourslam.localization.posterior import CONFIDENT, Located, probabilities, unseen_log_odds
from contourslam.localization.several import SeveralScans
from contourslam.maps.saved_map import SavedMap
from contourslam.matching.oriented import move, oriented_points
from contourslam.recordings import open_recording
from contourslam.scan import LaserScan, Odometry

Floats = NDArray[np.float64]
Rooms = Callable[..., Floats]
Scans = Callable[..., LaserScan]
Points = Callable[[LaserScan], Floats]
Maps = Callable[..., SavedMap]

INTEL = Path(__file__).parents[2].parent / "shared" / "data" / "intel" / "intel.log.xz"

# No two places of it are alike: an L with a slanting wall, a crate at an angle and a column.
LOPSIDED = (
    ((0, 0), (8, 0), (8, 3.5), (5, 3.5), (5, 6), (1.2, 6), (0, 4.6)),
    ((2, 2), (1.8, 2.6), (2.6, 2.9), (2.8, 2.3)),
    ((6.5, 1.4), (6.5, 1.9), (7.0, 1.9), (7.0, 1.4)),
)
WAY = np.array([(1.2, 1.2, 0.3), (3.8, 1.0, 1.2), (5.8, 2.7, 2.5), (3.6, 4.6, -2.0), (1.2, 4.0, -0.6), (7.4, 0.7, 2.0)])
# Each place in it looks like the one across its middle.
PLAIN = ((0, 0), (7, 0), (7, 4), (0, 4))
PLAIN_WAY = np.array([(1.0, 1.0, 0.0), (3.5, 2.0, 1.0), (6.0, 3.0, 3.0), (6.0, 1.0, -1.0)])
SLIP = np.array([0.01, 0.0, 0.01])  # of the wheels at each step: m, m, rad
# Another building.
HALL = (((0, 0), (9, -2), (13, 3), (12, 8), (6, 7), (2, 10), (-3, 6)), ((5, 3), (5, 4.5), (6.2, 4.9), (6.5, 3.3)))


@pytest.fixture(scope="module")
def lopsided(room: Rooms, saved_at: Maps) -> Locator:
    return Locator(KnownMap(saved_at(room(*LOPSIDED), WAY)))


@pytest.fixture(scope="module")
def plain(room: Rooms, saved_at: Maps) -> Locator:
    return Locator(KnownMap(saved_at(room(PLAIN), PLAIN_WAY)))


def off(located: Located, truth: Floats) -> tuple[float, float]:
    """Distance, m, and turn, rad, from the truth."""
    away = math.hypot(*(located.pose[:2] - truth[:2]))
    return away, abs(wrap_angle(float(located.pose[2] - truth[2])))


@settings(max_examples=25)
@given(at=st.integers(0, 5), dx=st.floats(-0.4, 0.4), dy=st.floats(-0.4, 0.4), heading=st.floats(-math.pi, math.pi))
def test_a_robot_is_found_at_any_heading_where_it_has_not_been_exactly(
    lopsided: Locator, room: Rooms, scan_of: Scans, points_of: Points, at: int, dx: float, dy: float, heading: float
) -> None:
    truth = np.array([WAY[at, 0] + dx, WAY[at, 1] + dy, heading])
    located = lopsided.locate(points_of(scan_of(room(*LOPSIDED), truth, sigma=0.01, seed=3)))
    away, turn = off(located, truth)
    assert away < 0.05
    assert turn < math.radians(1.0)
    assert located.confident
    sigmas = np.sqrt(np.diag(located.covariance))
    assert np.linalg.eigvalsh(located.covariance).min() > 0.0
    assert away < 5.0 * math.hypot(sigmas[0], sigmas[1]) + 0.01


def test_the_lidar_may_sit_anywhere_on_the_robot(
    lopsided: Locator, room: Rooms, scan_of: Scans, points_of: Points
) -> None:
    truth, mount = np.array([4.0, 1.5, 0.7]), np.array([0.2, -0.1, math.pi / 2])
    back = between_one(mount, np.zeros(3))
    lidar = np.array([4.0, 1.5, 0.7])
    located = lopsided.locate(move(points_of(scan_of(room(*LOPSIDED), lidar, sigma=0.01)), mount), lidar=mount)
    assert located.confident
    base = truth.copy()
    base[:2] += [
        math.cos(truth[2]) * back[0] - math.sin(truth[2]) * back[1],
        math.sin(truth[2]) * back[0] + math.cos(truth[2]) * back[1],
    ]
    base[2] = wrap_angle(truth[2] + back[2])
    assert off(located, base)[0] < 0.05


def test_a_place_that_looks_like_another_is_doubtful_and_has_it_as_runner_up(
    plain: Locator, room: Rooms, scan_of: Scans, points_of: Points
) -> None:
    truth = np.array([2.0, 1.5, 0.4])
    located = plain.locate(points_of(scan_of(room(PLAIN), truth, sigma=0.01, seed=1)))
    other = np.array([7.0 - 2.0, 4.0 - 1.5, wrap_angle(0.4 + math.pi)])
    assert not located.confident
    assert located.runners_up
    poses = [located.pose, located.runners_up[0].pose]
    for wanted in (truth, other):
        assert min(math.hypot(*(pose[:2] - wanted[:2])) for pose in poses) < 0.1
    assert located.probability + sum(r.probability for r in located.runners_up) <= 1.0 + 1e-9
    assert located.runners_up[0].probability > 0.2


@pytest.mark.parametrize("field_of_view", [math.pi, 2.0 * math.pi])
def test_a_scan_of_another_building_is_not_believed(
    lopsided: Locator, room: Rooms, scan_of: Scans, points_of: Points, field_of_view: float
) -> None:
    chance = np.random.default_rng(4)
    for k in range(12):
        pose = chance.uniform((0.0, 1.0, -3.0), (4.5, 6.0, 3.0))
        scan = scan_of(room(*HALL), pose, field_of_view=field_of_view, start=-0.5 * field_of_view, sigma=0.01, seed=k)
        assert not lopsided.locate(points_of(scan)).confident


def test_a_wall_alone_tells_no_place(lopsided: Locator, scan_of: Scans, points_of: Points) -> None:
    wall = np.array([[[-5.0, 1.0], [5.0, 1.0]]])
    located = lopsided.locate(points_of(scan_of(wall, (0.0, 0.0, 0.0), sigma=0.01)))
    assert not located.confident


@pytest.mark.parametrize("points", [np.empty((0, 4)), np.full((50, 4), np.nan), np.ones((3, 4))])
def test_a_scan_that_shows_nothing_is_found_nowhere(lopsided: Locator, points: Floats) -> None:
    located = lopsided.locate(points)
    assert located is NOT_FOUND
    assert located.probability == 0.0
    assert not located.confident


def test_a_map_of_nothing_is_refused(saved_at: Maps, room: Rooms) -> None:
    empty = saved_at(room(PLAIN), np.empty((0, 3)))
    with pytest.raises(MapError, match="nothing to localise in"):
        KnownMap(empty)


def test_a_map_of_walls_alone_is_enough(walls_alone: Callable[[Floats], SavedMap], room: Rooms, scan_of: Scans) -> None:
    segments = room(*LOPSIDED)
    locator, config, mount = Locator(KnownMap(walls_alone(segments))), Config(), np.zeros(3)
    truth = np.array([3.5, 4.2, 1.1])
    contours = trace(scan_of(segments, truth, sigma=0.01), config)
    found = find_landmarks(contours, make_detector("matched_filter", adapted=True), config)
    landmarks = constellation_of(found.corners, found.walls, mount)
    for seen in (None, landmarks):
        located = locator.locate(oriented_points(contours), seen)
        assert off(located, truth)[0] < 0.05
        assert located.confident


def test_several_scans_decide_what_one_leaves_open(
    lopsided: Locator, room: Rooms, scan_of: Scans, points_of: Points
) -> None:
    """A lidar with a narrow field of view that sees a corner, like others of the room, then turns."""
    segments, narrow, noise = room(*LOPSIDED), math.radians(70.0), np.diag([0.01, 0.01, 0.01]) ** 2
    several = SeveralScans(30.0)
    alone, before = None, None
    for heading in np.arange(-2.6, 1.5, 0.25):
        pose = np.array([4.0, 1.2, heading])
        points = points_of(scan_of(segments, pose, field_of_view=narrow, start=-0.5 * narrow, beams=120, sigma=0.01))
        alone = alone or lopsided.locate(points)
        several.push(points, np.zeros(3) if before is None else between_one(before, pose) + SLIP, noise)
        before = pose
    together = lopsided.find(several.view())
    assert alone is not None
    assert before is not None
    assert alone.probability < CONFIDENT
    assert together.confident
    assert together.probability > alone.probability
    assert off(together, before)[0] < 0.1


@given(odds=st.lists(st.floats(-50.0, 50.0), max_size=8), unseen=st.floats(-50.0, 50.0) | st.just(-math.inf))
def test_probabilities_leave_room_for_elsewhere_and_keep_the_order(odds: list[float], unseen: float) -> None:
    shares = probabilities(odds, unseen)
    assert len(shares) == len(odds)
    assert ((shares >= 0.0) & (shares <= 1.0)).all()
    assert shares.sum() <= 1.0 + 1e-12
    order = np.argsort(odds)
    assert (np.diff(shares[order]) >= 0.0).all()
    assert (probabilities(odds) >= shares - 1e-12).all()


def test_what_a_search_left_out_takes_from_the_probability_the_more_the_better_it_may_be() -> None:
    odds = [unseen_log_odds(score, 50.0) for score in (0.0, 0.4, 0.6, 0.9)]
    assert odds[0] == -math.inf
    assert odds == sorted(odds)
    shares = [probabilities([6.0], unseen)[0] for unseen in odds]
    assert shares == sorted(shares, reverse=True)


def test_a_real_robot_is_found_again_where_it_was_before() -> None:
    pytest.importorskip("gtsam", reason="needs the extra 'graph'")
    if not INTEL.exists():
        pytest.skip("the real recordings are not here: no intel/intel.log.xz in ../shared/data")
    from contourslam.graph import GraphSlam, kept

    slam, scans = GraphSlam(Config(back_end="graph")), []
    for message in open_recording(INTEL).messages():
        if isinstance(message, Odometry):
            slam.push_odometry(message)
        elif isinstance(message, LaserScan):
            slam.push_scan(message)
            scans.append(message)
            if len(scans) == 4500:
                break
    poses = slam.finish().poses
    known = Locator(KnownMap(_until(kept(slam, {}), scans[2700].stamp)))
    later = [k for k in range(2700, 4500) if np.hypot(*(poses[:2700, :2] - poses[k, :2]).T).min() < 0.5]
    chosen = np.random.default_rng(0).choice(later, 60, replace=False).tolist()
    found = wrong = 0
    for k in chosen:
        located = known.locate(oriented_points(trace(scans[k], Config())))
        right = located.method != "none" and off(located, poses[k])[0] < 0.1
        found, wrong = found + right, wrong + (located.confident and not right)
    assert found >= 0.85 * len(chosen)
    assert wrong <= 1


def _until(saved: SavedMap, stamp: float) -> SavedMap:
    """The part of a map that was seen before a time."""
    frames = saved.keyframes
    assert frames is not None
    n = int(np.searchsorted(frames.stamps, stamp))
    arrays = (frames.stamps[:n], frames.poses[:n], frames.covariances[:n], frames.blurs[:n], frames.starts[: n + 1])
    first = type(frames)(*arrays, frames.points[: frames.starts[n]], frames.drives[:n])
    return SavedMap(saved.corners, saved.walls, first)
