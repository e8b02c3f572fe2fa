import math
import sqlite3
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from contourslam.errors import RecordingError
from contourslam.recordings import Message, Recording, open_recording
from contourslam.recordings.ros_encoding import Encoder
from contourslam.scan import LaserScan, Odometry, TruePose

Entry = tuple[str, float, Any]
Entries = Callable[[list[Message]], Iterator[Entry]]
BagMaker = Callable[[str, Path, Iterator[Entry]], Path]
Drain = Callable[[Iterator[Any]], tuple[list[Any], RecordingError | None]]
FORMATS = ("bag1", "bag1_bz2", "bag1_lz4", "mcap", "sqlite3", "lone_mcap", "lone_db3")


@pytest.fixture
def open_entries(tmp_path: Path, make_bag: BagMaker) -> Callable[..., Recording]:
    """Write entries to an MCAP bag and open it."""

    def write_and_open(entries: list[Entry], **topics: str) -> Recording:
        return open_recording(make_bag("mcap", tmp_path, iter(entries)), **topics)

    return write_and_open


@pytest.mark.parametrize("kind", FORMATS)
def test_every_format_gives_back_what_was_recorded(
    tmp_path: Path,
    messages: list[Message],
    entries: Entries,
    make_bag: BagMaker,
    same: Callable[[Message, Message], bool],
    kind: str,
) -> None:
    recording = open_recording(make_bag(kind, tmp_path, entries(messages)))
    files = sorted(tmp_path.rglob("*"))
    for _ in range(2):  # each call is a new pass
        got = list(recording.messages())
        assert len(got) == len(messages)
        assert all(same(*pair) for pair in zip(got, messages, strict=True))
    assert recording.skipped == {} and recording.notes == []
    assert recording.lidar_mount == pytest.approx((0.25, -0.125, 0.5))
    assert [(topic.name, topic.count) for topic in recording.topics()] == [
        ("/ground_truth", 40),
        ("/odom", 40),
        ("/scan", 20),
        ("/tf_static", 1),
    ]
    assert (recording.start, recording.duration) == (100.0, pytest.approx(39 * 0.125))
    assert sorted(tmp_path.rglob("*")) == files  # nothing was written beside the bag


def test_equal_times_keep_the_order_of_the_file(
    messages: list[Message], encoder: Encoder, open_entries: Callable[..., Recording]
) -> None:
    entries = [("/odom", 1.0, encoder.odometry(9.0 - i, np.zeros(3), "odom", "base_link")) for i in range(5)]
    entries += [("/scan", 1.0, encoder.scan(_a_scan(messages), "laser"))]
    stamps = [message.stamp for message in open_entries(entries).messages()]
    assert stamps[:5] == [9.0, 8.0, 7.0, 6.0, 5.0]


@pytest.mark.parametrize("topic", ["/pose/ground_truth", "/groundtruth", "/sim/truth"])
def test_truth_is_known_by_its_name(
    messages: list[Message], encoder: Encoder, open_entries: Callable[..., Recording], topic: str
) -> None:
    entries = [
        ("/wheels", 1.0, encoder.odometry(1.0, np.ones(3), "odom", "base_link")),
        (topic, 1.0, encoder.odometry(1.0, np.zeros(3), "map", "base_link")),
        ("/front", 1.0, encoder.scan(_a_scan(messages), "laser")),
    ]
    kinds = [type(message) for message in open_entries(entries).messages()]
    assert kinds == [Odometry, TruePose, LaserScan]


def test_among_several_topics_the_usual_name_wins_and_otherwise_the_user_is_asked(
    messages: list[Message], encoder: Encoder, tmp_path: Path, make_bag: BagMaker
) -> None:
    scan, odometry = encoder.scan(_a_scan(messages), "laser"), encoder.odometry(1.0, np.ones(3), "odom", "base_link")
    usual = [("/scan", 1.0, scan), ("/rear", 1.0, scan), ("/odom", 1.0, odometry), ("/odom_raw", 1.0, odometry)]
    (tmp_path / "usual").mkdir()
    assert len(list(open_recording(make_bag("mcap", tmp_path / "usual", iter(usual))).messages())) == 2
    unclear = [("/front", 1.0, scan), ("/rear", 1.0, scan), ("/rear", 2.0, scan), ("/odom", 1.0, odometry)]
    path = make_bag("mcap", tmp_path, iter(unclear))
    with pytest.raises(RecordingError, match=r"several topics could be the scan.*/front, /rear"):
        open_recording(path)
    assert len(list(open_recording(path, scan_topic="/rear").messages())) == 3
    assert len(list(open_recording(path, scan_topic="rear").messages())) == 3
    with pytest.raises(RecordingError, match="has no topic /top for the scan; its topics: /front: sensor_msgs"):
        open_recording(path, scan_topic="/top")
    with pytest.raises(RecordingError, match="the scan topic /odom holds nav_msgs/msg/Odometry"):
        open_recording(path, scan_topic="/odom")


def test_a_bag_without_scans_is_refused_with_its_topics_and_one_without_odometry_is_read_with_a_note(
    messages: list[Message], encoder: Encoder, tmp_path: Path, make_bag: BagMaker
) -> None:
    odometry = [("/odom", 1.0, encoder.odometry(1.0, np.ones(3), "odom", "base_link"))]
    scans = [("/scan", 1.0, encoder.scan(_a_scan(messages), "laser"))]
    (tmp_path / "a").mkdir()
    path = make_bag("mcap", tmp_path / "a", iter(odometry))
    with pytest.raises(RecordingError, match=r"holds no scan .*; its topics: /odom: nav_msgs/msg/Odometry") as caught:
        open_recording(path)
    assert str(path) in str(caught.value)
    (tmp_path / "b").mkdir()
    recording = open_recording(make_bag("mcap", tmp_path / "b", iter(scans)))
    assert any("holds no odometry" in note and "/scan: sensor_msgs" in note for note in recording.notes)
    assert len(list(recording.messages())) == 1


@pytest.mark.parametrize("kind", ["bag1", "mcap"])
@pytest.mark.parametrize("wanted", [None, "/tf"])
def test_without_an_odometry_topic_the_transform_from_odom_serves(
    messages: list[Message], encoder: Encoder, tmp_path: Path, make_bag: BagMaker, kind: str, wanted: str | None
) -> None:
    poses = np.array([[1.0, 2.0, 0.25], [1.5, 2.0, 0.5]])
    entries: list[Entry] = [("/scan", 0.5, encoder.scan(_a_scan(messages), "laser"))]
    for stamp, pose in enumerate(poses, start=1):
        entries.append(("/tf", stamp, encoder.transform(stamp, np.zeros(3), "map", "odom")))
        entries.append(("/tf", stamp, encoder.transform(stamp, pose, "odom", "base_footprint")))
        entries.append(("/tf", stamp, encoder.transform(stamp, np.array([0.3, 0, 0]), "base_footprint", "laser")))
    recording = open_recording(make_bag(kind, tmp_path, iter(entries)), odometry_topic=wanted)
    readings = [message for message in recording.messages() if isinstance(message, Odometry)]
    assert np.allclose([reading.pose for reading in readings], poses)
    assert [reading.stamp for reading in readings] == [1.0, 2.0]
    assert recording.lidar_mount == pytest.approx((0.3, 0.0, 0.0))  # which ROS 1 keeps in /tf too


def test_the_lidar_is_found_through_a_chain_of_frames(
    messages: list[Message], encoder: Encoder, open_entries: Callable[..., Recording]
) -> None:
    """Base, plate and lidar; the odometry speaks of the footprint, a sibling below the same base."""
    entries = [
        ("/tf_static", 1.0, encoder.transform(1.0, np.array([0.2, 0.0, math.pi / 2]), "/base_link", "plate")),
        ("/tf_static", 1.0, encoder.transform(1.0, np.array([0.1, 0.0, math.pi / 2]), "plate", "laser")),
        ("/tf_static", 1.0, encoder.transform(1.0, np.array([-1.0, 0.0, 0.0]), "base_link", "base_footprint")),
        ("/odom", 1.0, encoder.odometry(1.0, np.zeros(3), "odom", "base_footprint")),
        ("/scan", 1.0, encoder.scan(_a_scan(messages), "/laser")),
    ]
    mount = open_entries(entries).lidar_mount
    assert mount is not None
    assert np.allclose(mount[:2], (1.2, 0.1)) and abs(mount[2]) == pytest.approx(math.pi)


def test_a_lidar_that_hangs_upside_down_is_turned_over(
    messages: list[Message], encoder: Encoder, open_entries: Callable[..., Recording]
) -> None:
    scan = _a_scan(messages)
    static = encoder.transform(1.0, np.array([0.2, 0.1, 0.0]), "base_link", "laser")
    rotation = static.transforms[0].transform.rotation
    # A half turn about x, then a quarter turn about z.
    rotation.x, rotation.y, rotation.z, rotation.w = math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0
    recording = open_entries(
        [
            ("/tf_static", 1.0, static),
            ("/odom", 1.0, encoder.odometry(1.0, np.zeros(3), "odom", "base_link")),
            ("/scan", 1.0, encoder.scan(scan, "laser")),
        ]
    )
    assert recording.lidar_mount == pytest.approx((0.2, 0.1, math.pi / 2))
    got = list(recording.messages())[1]
    assert isinstance(got, LaserScan) and np.allclose(got.angles, -scan.angles, atol=1e-5)
    assert "upside down" in recording.notes[0]


def test_no_transform_is_no_mount_and_is_mentioned(
    messages: list[Message], encoder: Encoder, open_entries: Callable[..., Recording]
) -> None:
    recording = open_entries(
        [
            ("/tf_static", 1.0, encoder.transform(1.0, np.zeros(3), "camera", "laser")),
            ("/tf_static", 1.0, encoder.transform(1.0, np.zeros(3), "laser", "camera")),  # a cycle
            ("/odom", 1.0, encoder.odometry(1.0, np.zeros(3), "odom", "base_link")),
            ("/scan", 1.0, encoder.scan(_a_scan(messages), "laser")),
        ]
    )
    assert recording.lidar_mount is None and "no transform" in recording.notes[0]


def test_a_transform_that_is_no_motion_is_passed_over(
    messages: list[Message], encoder: Encoder, open_entries: Callable[..., Recording]
) -> None:
    corrupt = encoder.transform(1.0, np.zeros(3), "base_link", "laser")
    corrupt.transforms[0].transform.rotation.x = 1e300
    far = encoder.transform(1.0, np.array([math.inf, 0.0, 0.0]), "base_link", "laser")
    good = encoder.transform(1.0, np.array([0.5, 0.0, 0.0]), "base_link", "laser")
    recording = open_entries(
        [
            *(("/tf_static", 1.0, message) for message in (corrupt, far, good)),
            ("/odom", 1.0, encoder.odometry(1.0, np.zeros(3), "odom", "base_link")),
            ("/scan", 1.0, encoder.scan(_a_scan(messages), "laser")),
        ]
    )
    assert recording.lidar_mount == pytest.approx((0.5, 0.0, 0.0))


def test_beam_times_come_from_the_time_of_the_whole_scan_where_no_other_is_given(
    messages: list[Message], encoder: Encoder, open_entries: Callable[..., Recording]
) -> None:
    message = encoder.scan(_a_scan(messages), "laser")
    message.time_increment, message.scan_time = 0.0, 0.125
    message.angle_increment = -message.angle_increment
    odometry = encoder.odometry(1.0, np.zeros(3), "odom", "base_link")
    scan = list(open_entries([("/odom", 1.0, odometry), ("/scan", 1.0, message)]).messages())[1]
    assert isinstance(scan, LaserScan)
    assert np.allclose(np.diff(scan.offsets), 0.125 / scan.ranges.size) and (np.diff(scan.angles) < 0).all()


def test_messages_of_no_use_are_skipped_and_counted(
    messages: list[Message], encoder: Encoder, open_entries: Callable[..., Recording]
) -> None:
    scan = _a_scan(messages)
    bad_scan, bad_odometry = encoder.scan(scan, "laser"), encoder.odometry(1.0, np.zeros(3), "odom", "base_link")
    bad_scan.angle_increment = math.nan
    bad_odometry.pose.pose.orientation.w = 0.0
    recording = open_entries(
        [
            ("/scan", 1.0, bad_scan),
            ("/odom", 2.0, bad_odometry),
            ("/odom", 3.0, encoder.odometry(3.0, np.zeros(3), "odom", "base_link")),
            ("/scan", 4.0, encoder.scan(scan, "laser")),
            ("/odom", 5.0, bad_odometry),
        ]
    )
    assert len(list(recording.messages())) == 2
    assert recording.skipped == {
        "/scan: a stamp, angle or time offset is not finite (first: message 1)": 1,
        "/odom: an orientation that is no unit quaternion (first: message 2)": 2,
    }


def test_a_bag_whose_scans_are_all_of_no_use_says_so(
    messages: list[Message], encoder: Encoder, open_entries: Callable[..., Recording], drain: Drain
) -> None:
    bad = encoder.scan(_a_scan(messages), "laser")
    bad.range_max = 0.0
    odometry = encoder.odometry(1.0, np.zeros(3), "odom", "base_link")
    got, error = drain(open_entries([("/odom", 1.0, odometry), ("/scan", 2.0, bad)]).messages())
    assert len(got) == 1
    assert error is not None and "no usable scan on /scan" in str(error) and "not a range" in str(error)


def test_a_sqlite_bag_of_an_old_distribution_carries_no_definitions_and_is_read(
    messages: list[Message], entries: Entries, tmp_path: Path, make_bag: BagMaker
) -> None:
    path = make_bag("lone_db3", tmp_path, entries(messages))
    database = sqlite3.connect(path)
    database.executescript(
        "DROP TABLE message_definitions; DROP TABLE schema; ALTER TABLE topics DROP COLUMN type_description_hash;"
    )
    database.close()
    assert len(list(open_recording(path).messages())) == len(messages)


def test_the_name_of_a_file_may_hold_what_a_uri_reserves(
    messages: list[Message], entries: Entries, tmp_path: Path, make_bag: BagMaker
) -> None:
    for kind in ("lone_db3", "bag1"):
        path = make_bag(kind, tmp_path, entries(messages))
        path = path.rename(tmp_path / f"a#b?c%41{path.suffix}")
        assert len(list(open_recording(path).messages())) == len(messages)


@pytest.mark.parametrize("kind", ["lone_db3", "lone_mcap", "bag1"])
def test_the_suffix_of_a_file_does_not_matter(
    messages: list[Message], entries: Entries, tmp_path: Path, make_bag: BagMaker, kind: str
) -> None:
    path = make_bag(kind, tmp_path, entries(messages)).rename(tmp_path / "recording")
    assert len(list(open_recording(path).messages())) == len(messages)


def _a_scan(messages: list[Message]) -> LaserScan:
    return next(message for message in messages if isinstance(message, LaserScan))
