"""Pairs of maps with a known truth: parts of ways, mirror images, pieces of maps, and how a joint is judged."""

from pathlib import Path

import numpy as np
import pytest

from contourslam.experiments.joinable_maps import Mapped, corridor, mapped, mirrored, part_of, parts_of_log, room_drive
from contourslam.experiments.joining import judge, piece, shared_way
from contourslam.geometry.poses import between
from contourslam.scan import LaserScan, Odometry, TruePose

pytest.importorskip("gtsam", reason="the graph needs GTSAM")
WAY = ((1.0, 0.0), (14.0, 0.1), (9.0, -0.1))


@pytest.fixture(scope="module")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("maps")


@pytest.fixture(scope="module")
def made(cache: Path) -> Mapped:
    return mapped(room_drive("one", "corridor 1", corridor(1), WAY, 1), cache)


def test_a_part_of_a_way_has_its_length() -> None:
    way = [(0.0, 0.0), (4.0, 0.0), (4.0, 0.0), (4.0, 3.0), (10.0, 3.0)]
    assert part_of(way, 2.0, 6.0) == ((2.0, 0.0), (4.0, 0.0), (4.0, 2.0))
    assert part_of(way, 5.0, 99.0)[-1] == (10.0, 3.0)


def test_a_map_is_made_in_a_frame_of_its_own_and_its_truth_is_known(made: Mapped) -> None:
    frames = made.chart.frames
    assert np.abs(frames.poses[0]).max() < 1e-6
    assert made.truth[0, :2] == pytest.approx((1.0, 0.0), abs=0.1)
    seen, true = between(frames.poses[0], frames.poses), between(made.truth[0], made.truth)
    assert np.hypot(*(seen - true)[:, :2].T).max() < 0.1


def test_a_map_that_was_kept_is_not_made_again(made: Mapped, cache: Path) -> None:
    drive = room_drive("one", "corridor 1", corridor(1), (), 1)  # leads nowhere
    assert np.array_equal(mapped(drive, cache).truth, made.truth)


def test_a_mirror_image_turns_left_where_the_drive_turns_right() -> None:
    drive = room_drive("one", "corridor 1", corridor(1), WAY[:2], 1)
    for one, other in zip(drive.messages(), mirrored(drive).messages(), strict=True):
        if isinstance(one, LaserScan):
            assert isinstance(other, LaserScan)
            assert np.array_equal(other.angles, -one.angles[::-1])
            assert np.array_equal(other.ranges, one.ranges[::-1], equal_nan=True)
        else:
            assert isinstance(one, Odometry | TruePose) and not isinstance(other, LaserScan)
            assert other.pose == pytest.approx(one.pose * (1.0, -1.0, -1.0))


def test_pieces_of_one_way_share_it_and_are_joined(made: Mapped) -> None:
    first, second = piece(made, 0.0, 13.0), piece(made, 4.0, 17.9)
    assert shared_way(first, second) > 8.0
    assert shared_way(piece(made, 0.0, 3.0), piece(made, 9.0, 12.0)) == 0.0
    verdict = judge(first, second)
    assert verdict.joined
    assert not verdict.false
    assert verdict.errors.max() < 0.05


def test_a_joint_of_strangers_is_false(made: Mapped) -> None:
    stranger = Mapped("two", "corridor 2", made.saved, made.truth)
    verdict = judge(made, stranger)
    assert verdict.joined
    assert verdict.false


def test_parts_of_a_log_hold_its_messages_once(made: Mapped) -> None:
    drive = room_drive("one", "corridor 1", corridor(1), WAY[:2], 1)
    messages = [message for message in drive.messages() if not isinstance(message, TruePose)]
    stamps = np.array([message.stamp for message in messages if isinstance(message, LaserScan)])
    parts = parts_of_log("log", messages, stamps, np.zeros((len(stamps), 3)), np.linspace(0.0, 1.0, 4))
    found = [m for part in parts for m in part.messages() if not isinstance(m, TruePose)]
    assert len({(type(m), m.stamp) for m in found}) == len({(type(m), m.stamp) for m in messages})
