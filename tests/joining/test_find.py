"""Two maps with no known relative pose: joined where they overlap, kept apart where that could be otherwise."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from contourslam.errors import MapError
from contourslam.geometry.angles import wrap
from contourslam.geometry.poses import between, compose, inverse
from contourslam.joining.chart import Chart
from contourslam.joining.find import decide, find_joint
from contourslam.joining.joint import Apart, Joint
from contourslam.joining.looks import look, turned_round
from contourslam.maps.saved_map import SavedMap

Floats = NDArray[np.float64]
Rooms = Callable[..., Floats]
Maps = Callable[..., SavedMap]

# No two places of it are alike: an L with a slanting wall, a crate at an angle and a column.
LOPSIDED = (
    ((0, 0), (10, 0), (10, 4.5), (6, 4.5), (6, 8), (1.2, 8), (0, 6.6)),
    ((2, 2.2), (1.8, 2.8), (2.6, 3.1), (2.8, 2.5)),
    ((8.0, 1.9), (8.0, 2.4), (8.5, 2.4), (8.5, 1.9)),
)
FIRST_WAY = ((1.2, 1.2), (7.0, 1.1), (9.2, 3.5), (5.0, 3.4), (4.5, 7.0), (1.6, 6.2), (1.0, 2.0))
SECOND_WAY = ((5.0, 7.0), (3.8, 4.0), (1.0, 4.6), (1.2, 1.0), (6.5, 1.2), (7.2, 3.6), (4.0, 3.8))
FRAME = (3.0, -1.0, 2.1)
# Another room, as large.
HALL = (((0, 0), (9, -2), (13, 3), (12, 8), (6, 7), (2, 10), (-3, 6)), ((5, 3), (5, 4.5), (6.2, 4.9), (6.5, 3.3)))
HALL_WAY = ((0.5, 1.5), (4.0, 1.5), (8.5, 1.0), (10.5, 4.5), (7.5, 5.8), (2.0, 6.5), (0.0, 4.0))
# The lopsided room with other things in it and a niche walled up.
CHANGED = (
    ((0, 0), (10, 0), (10, 4.5), (6, 4.5), (6, 6.2), (0, 6.2)),
    ((4, 2.2), (4.2, 3.1), (5.0, 2.9), (4.8, 2.0)),
    ((1.0, 3.6), (1.0, 4.3), (2.2, 4.3), (2.2, 3.6)),
)
CHANGED_WAY = ((1.2, 1.2), (7.0, 1.1), (9.2, 3.5), (5.0, 3.9), (3.0, 5.4), (3.0, 1.4))
CORRIDOR = (((0, 0), (60, 0), (60, 2.2), (0, 2.2)),)
CORRIDOR_WAY = ((32.0, 1.0), (50.0, 1.2))  # as far as the lidar sees there are two walls


def niches(count: int) -> tuple[tuple[tuple[float, float], ...], ...]:
    """A long corridor with as many niches as alike, 3 m apart, far from both of its ends."""
    upper = []
    for k in range(count):
        x = 40.0 + 3.0 * (count - k)
        upper += [(x, 2.2), (x, 2.8), (x - 1.0, 2.8), (x - 1.0, 2.2)]
    end = 80.0 + 3.0 * count
    return (((0.0, 0.0), (end, 0.0), (end, 2.2), *upper, (0.0, 2.2)),)


@pytest.fixture(scope="module")
def first(room: Rooms, walked: Maps) -> Chart:
    return Chart(walked(room(*LOPSIDED), FIRST_WAY, seed=1))


@pytest.fixture(scope="module")
def second(room: Rooms, walked: Maps) -> Chart:
    return Chart(walked(room(*LOPSIDED), SECOND_WAY, frame=FRAME, seed=2))


@pytest.fixture(scope="module")
def joint(first: Chart, second: Chart) -> Joint:
    found = find_joint(first, second)
    assert isinstance(found, Joint)
    return found


def away(pose: Floats, truth: Floats) -> tuple[float, float]:
    """Distance, m, and turn, rad."""
    off = between(np.asarray(truth), pose)
    return math.hypot(off[0], off[1]), abs(float(off[2]))


def test_a_room_seen_on_two_days_is_joined_within_centimetres(joint: Joint) -> None:
    distance, turn = away(joint.pose, np.array(FRAME))
    assert distance < 0.02
    assert turn < math.radians(0.3)
    assert joint.evidence.contradicted < 0.01
    assert joint.evidence.rival < 0.5
    assert joint.evidence.way > 8.0


def test_ties_hold_keyframes_of_the_second_map_to_places_of_the_first(
    joint: Joint, first: Chart, second: Chart
) -> None:
    assert len(joint.ties) >= 10
    squares = []
    for tie in joint.ties:
        truth = between(first.frames.poses[tie.first], compose(np.array(FRAME), second.frames.poses[tie.second]))
        off = between(truth, tie.pose)
        assert math.hypot(off[0], off[1]) < 0.05
        squares.append(float(off @ np.linalg.solve(tie.covariance, off)))
    assert np.median(squares) < 9.0  # three degrees of freedom
    keys = [tie.second for tie in joint.ties]
    assert keys == sorted(set(keys))


def test_the_other_order_gives_the_inverse(joint: Joint, first: Chart, second: Chart) -> None:
    back = find_joint(second, first)
    assert isinstance(back, Joint)
    assert away(back.pose, inverse(joint.pose))[0] < 1e-9
    assert back.evidence == joint.evidence
    for tie, other in zip(back.ties, joint.ties, strict=True):
        assert (tie.first, tie.second) == (other.second, other.first)
        assert away(compose(tie.pose, other.pose), np.zeros(3))[0] < 1e-9


def test_the_covariance_of_a_tie_turned_round_is_that_of_the_inverse(joint: Joint, first: Chart, second: Chart) -> None:
    back = find_joint(second, first)
    assert isinstance(back, Joint)
    tie, other = joint.ties[3], back.ties[3]
    chance = np.random.default_rng(5)
    errors = chance.multivariate_normal(np.zeros(3), 1e-2 * tie.covariance, 20_000)
    seen = inverse(compose(tie.pose, errors))
    drawn = 1e2 * np.cov(between(inverse(tie.pose), seen).T)
    scale = np.sqrt(np.outer(np.diag(other.covariance), np.diag(other.covariance)))
    assert np.abs((drawn - other.covariance) / scale).max() < 0.05


def test_the_frames_of_the_maps_are_of_no_matter(joint: Joint, first: Chart, second: Chart, moved: Maps) -> None:
    one, other = (-7.3, 2.2, 0.6), (11.1, 4.4, -1.9)
    found = find_joint(Chart(moved(first.saved, one)), Chart(moved(second.saved, other)))
    assert isinstance(found, Joint)
    distance, turn = away(found.pose, compose(inverse(np.array(one)), compose(joint.pose, np.array(other))))
    assert distance < 0.02
    assert turn < math.radians(0.2)


@pytest.mark.parametrize(("rooms", "way"), [(HALL, HALL_WAY), (CHANGED, CHANGED_WAY)])
def test_another_room_stays_apart(
    first: Chart, room: Rooms, walked: Maps, rooms: tuple[object, ...], way: tuple[tuple[float, float], ...]
) -> None:
    found = find_joint(first, Chart(walked(room(*rooms), way, seed=3)))
    assert isinstance(found, Apart)
    assert found.reason != "ambiguous"


def test_bare_walls_are_no_place(room: Rooms, walked: Maps) -> None:
    corridor = [Chart(walked(room(*CORRIDOR), CORRIDOR_WAY, seed=seed)) for seed in (4, 5)]
    found = find_joint(*corridor)
    assert isinstance(found, Apart)
    assert found.reason in ("ambiguous", "too little")


def test_one_door_of_many_that_look_alike_is_no_place(room: Rooms, walked: Maps) -> None:
    segments = room(*niches(12))
    drives = (((41.0, 1.0), (62.0, 1.1)), ((60.0, 1.2), (74.0, 1.1)))
    found = find_joint(*(Chart(walked(segments, way, seed=k)) for k, way in enumerate(drives)))
    assert isinstance(found, Apart)
    assert found.reason == "ambiguous"


def test_a_glimpse_is_too_little(first: Chart, room: Rooms, walked: Maps) -> None:
    found = find_joint(first, Chart(walked(room(*LOPSIDED), ((2.0, 1.2), (3.2, 1.1)), seed=6)))
    assert isinstance(found, Apart)
    assert found.reason == "too little"
    assert found.best is not None
    assert away(found.best.pose, np.zeros(3))[0] < 0.05


def test_looks_may_be_kept_and_come_in_any_order(joint: Joint, first: Chart, second: Chart) -> None:
    looks = [each for view in range(len(second.stretches)) for each in look(first, second, view)]
    looks += [
        turned_round(each, second, first) for view in range(len(first.stretches)) for each in look(second, first, view)
    ]
    found = decide(first, second, looks[::-1])
    assert isinstance(found, Joint)
    assert away(found.pose, joint.pose)[0] < 1e-9


def test_a_look_turned_round_twice_says_the_same(first: Chart, second: Chart) -> None:
    found = look(first, second, 0)[0]
    again = turned_round(turned_round(found, first, second), second, first)
    laid, back = (compose(each.pose, inverse(second.frames.poses[each.keyframe])) for each in (found, again))
    assert np.allclose(laid[:2], back[:2])
    assert abs(wrap(laid[2] - back[2])) < 1e-9
    assert not again.back


def test_who_watches_is_told_of_every_view(first: Chart, second: Chart) -> None:
    told: list[tuple[int, int]] = []
    find_joint(first, second, observer=lambda done, count: told.append((done, count)))
    count = len(first.stretches) + len(second.stretches)
    assert told == [(k + 1, count) for k in range(count)]


def test_a_drive_that_goes_on_leaves_its_views_as_they_are(first: Chart) -> None:
    frames = first.frames
    for kept in (12, 25, 40):
        part = replace(
            frames, stamps=frames.stamps[:kept], poses=frames.poses[:kept], covariances=frames.covariances[:kept],
            blurs=frames.blurs[:kept], starts=frames.starts[: kept + 1], drives=frames.drives[:kept],
        )  # fmt: skip
        before = Chart(replace(first.saved, keyframes=part)).stretches
        for one, other in zip(before[:-1], first.stretches, strict=False):
            assert one.tolist() == other.tolist()


def test_a_map_of_landmarks_alone_cannot_be_joined(first: Chart) -> None:
    with pytest.raises(MapError, match="contours of keyframes"):
        Chart(replace(first.saved, keyframes=None))


def test_an_empty_map_cannot_be_joined(first: Chart) -> None:
    frames = first.frames
    nothing = replace(
        frames, stamps=frames.stamps[:0], poses=frames.poses[:0], covariances=frames.covariances[:0],
        blurs=frames.blurs[:0], starts=frames.starts[:1], points=frames.points[:0], drives=frames.drives[:0],
    )  # fmt: skip
    with pytest.raises(MapError, match="contours of keyframes"):
        Chart(replace(first.saved, keyframes=nothing))
