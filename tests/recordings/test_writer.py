import itertools
import math
import resource
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore

from contourslam.errors import RecordingError
from contourslam.recordings import Message, RecordingWriter, open_recording, write_recording
from contourslam.scan import LaserScan, Odometry, TruePose, evenly_spaced

Drain = Callable[[Iterator[Any]], tuple[list[Any], RecordingError | None]]
Same = Callable[[Message, Message], bool]


def test_a_recording_comes_back_as_it_was_written(tmp_path: Path, messages: list[Message], same: Same) -> None:
    path = tmp_path / "deep" / "run"
    write_recording(path, iter(messages), lidar_mount=(0.25, -0.125, 0.5))
    for place in (path, path / "run.mcap"):
        recording = open_recording(place)
        got = list(recording.messages())
        assert len(got) == len(messages) and all(same(*pair) for pair in zip(got, messages, strict=True))
        assert recording.lidar_mount == pytest.approx((0.25, -0.125, 0.5), abs=1e-12)
    assert sorted(file.name for file in path.iterdir()) == ["metadata.yaml", "run.mcap"]


def test_ros_finds_standard_messages_frames_and_qualities_of_service(tmp_path: Path, messages: list[Message]) -> None:
    write_recording(tmp_path / "run", messages, lidar_mount=(0.2, 0.0, 0.0))
    store = get_typestore(Stores.LATEST)
    with Reader(tmp_path / "run") as reader:
        counts = {name: (info.msgtype, info.msgcount) for name, info in reader.topics.items()}
        assert counts == {
            "/scan": ("sensor_msgs/msg/LaserScan", 20),
            "/odom": ("nav_msgs/msg/Odometry", 40),
            "/tf": ("tf2_msgs/msg/TFMessage", 40),
            "/tf_static": ("tf2_msgs/msg/TFMessage", 1),
            "/ground_truth": ("nav_msgs/msg/Odometry", 40),
        }
        durability = {c.topic: c.ext.offered_qos_profiles[0].durability.name for c in reader.connections}
        assert durability["/tf_static"] == "TRANSIENT_LOCAL" and durability["/scan"] == "VOLATILE"
        assert all(connection.msgdef.data for connection in reader.connections)
        first: dict[str, Any] = {}
        times = []
        for connection, time, data in reader.messages():
            times.append(time)
            first.setdefault(connection.topic, store.deserialize_cdr(data, connection.msgtype))
    assert times == sorted(times)
    assert first["/scan"].header.frame_id == "laser"
    assert (first["/odom"].header.frame_id, first["/odom"].child_frame_id) == ("odom", "base_link")
    assert (first["/ground_truth"].header.frame_id, first["/ground_truth"].child_frame_id) == ("map", "base_link")
    frames = [
        (t.transforms[0].header.frame_id, t.transforms[0].child_frame_id) for t in (first["/tf_static"], first["/tf"])
    ]
    assert frames == [("base_link", "laser"), ("odom", "base_link")]


def test_a_scan_is_recorded_when_its_last_beam_was_measured(tmp_path: Path) -> None:
    write_recording(tmp_path / "run", [Odometry(5.0, np.zeros(3)), a_scan(5.0, time_increment=0.01)])
    with Reader(tmp_path / "run") as reader:
        times = {connection.topic: time for connection, time, _ in reader.messages()}
    assert times["/scan"] == round(5.07e9)


def test_the_order_is_kept_where_stamps_run_backwards_or_repeat(tmp_path: Path, shared_data: Path) -> None:
    log = open_recording(shared_data / "intel" / "intel.log.xz")
    stamps = [10.0, 9.0, 9.0, 11.0, 2.0]
    write_recording(tmp_path / "run", [a_scan(5.0), *(Odometry(stamp, np.zeros(3)) for stamp in stamps)])
    assert [message.stamp for message in open_recording(tmp_path / "run").messages()] == [5.0, *stamps]
    readings = list(itertools.islice(log.messages(), 5000, 6000))
    assert (np.diff([message.stamp for message in readings]) < 0).any()
    write_recording(tmp_path / "intel", readings)
    copy = open_recording(tmp_path / "intel").messages()
    assert [message.stamp for message in copy] == [message.stamp for message in readings]


def test_stamps_of_this_century_come_back_to_the_last_bit(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    stamps = [0.0, *rng.uniform(1.7e9, 1.8e9, 50), math.nextafter(1.7e9, 0.0)]
    write_recording(tmp_path / "run", [a_scan(1.0), *(Odometry(stamp, np.zeros(3)) for stamp in stamps)])
    assert [message.stamp for message in open_recording(tmp_path / "run").messages()] == [1.0, *stamps]


def test_angles_may_run_clockwise_and_across_the_half_turn_and_be_few(tmp_path: Path) -> None:
    clockwise = a_scan(1.0, angle_min=1.0, angle_increment=-0.25)
    backwards_in_time = LaserScan(3.0, [0.0, 0.1, 0.2], [1.0, 2, 3], [0.2, 0.1, 0.0], 0.1, 9.0)
    few = [LaserScan(4.0 + n, np.full(n, 0.5), np.full(n, 2.0), np.zeros(n), 0.1, 9.0) for n in (0, 1)]
    wrapped = LaserScan(2.0, [3.0, 3.1, 3.2 - 2 * math.pi], [1.0, 2, 3], np.zeros(3), 0.1, 9.0)
    scans = [clockwise, wrapped, backwards_in_time, *few]
    write_recording(tmp_path / "run", [Odometry(0.5, np.zeros(3)), *scans])
    got = list(open_recording(tmp_path / "run").messages())[1:]
    for scan, copy in zip(scans, got, strict=True):
        assert isinstance(copy, LaserScan)
        assert np.allclose(np.exp(1j * copy.angles), np.exp(1j * scan.angles), atol=1e-5)
        assert np.allclose(copy.stamp + copy.offsets, scan.stamp + scan.offsets, atol=1e-6)
        assert np.array_equal(copy.ranges, scan.ranges, equal_nan=True)


@pytest.mark.parametrize(
    ("bad", "words"),
    [
        (
            LaserScan(2.0, [0.0, 0.1, 0.3], [1.0, 1, 1], np.zeros(3), 0.1, 9.0),
            r"stamp 2\.0 s .* not evenly spaced in angle",
        ),
        (LaserScan(2.0, [0.0, 0.1, 0.2], [1.0, 1, 1], [0.0, 0.0, 1.0], 0.1, 9.0), "not evenly spaced in time"),
        (Odometry(-1.0, np.zeros(3)), r"stamp -1\.0 s"),
        (TruePose(math.nan, np.zeros(3)), "stamp nan s"),
        (Odometry(3e9, np.zeros(3)), "ROS stamps"),
    ],
)
def test_what_no_standard_message_can_say_is_refused_and_what_came_before_is_kept(
    tmp_path: Path, bad: Message, words: str
) -> None:
    path = tmp_path / "run"
    good = [Odometry(1.0, np.zeros(3)), a_scan(1.5)]
    with pytest.raises(RecordingError, match=words) as caught:
        write_recording(path, [*good, bad])
    assert str(path) in str(caught.value)
    assert len(list(open_recording(path).messages())) == 2


def test_an_interrupted_run_is_kept_as_a_whole_recording(tmp_path: Path, messages: list[Message], drain: Drain) -> None:
    def interrupted() -> Iterator[Message]:
        yield from messages[:50]
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_recording(tmp_path / "run", interrupted())
    got, error = drain(open_recording(tmp_path / "run").messages())
    assert len(got) == 50 and error is None


@pytest.fixture
def small_files_only() -> Iterator[None]:
    """Let no file grow beyond 1.2 MB: the same OSError, at the same calls, as a full disk."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1_200_000, hard))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.mark.usefixtures("small_files_only")
def test_a_full_disk_is_told_and_what_was_written_can_be_read(tmp_path: Path, drain: Drain) -> None:
    path = tmp_path / "run"
    rng = np.random.default_rng(2)
    ranges = rng.uniform(0.5, 9.0, (500, 1000)).astype(np.float32).astype(np.float64)
    scans = [a_scan(float(stamp), row) for stamp, row in enumerate(ranges, start=1)]
    with pytest.raises(
        RecordingError, match=r"run: cannot be written: .*; what was written so far is in .*run\.partial"
    ):
        write_recording(path, [Odometry(0.5, np.zeros(3)), *scans])
    assert not path.exists()
    got, error = drain(open_recording(tmp_path / "run.partial").messages())
    assert len(got) > 200 and error is not None
    assert all(np.array_equal(copy.ranges, scan.ranges) for copy, scan in zip(got[1:], scans, strict=False))


def test_nothing_is_overwritten_and_nothing_empty_is_left(tmp_path: Path) -> None:
    path = tmp_path / "run"
    with pytest.raises(RecordingError, match="no message to record"):
        write_recording(path, [])
    assert not path.exists()
    path.write_text("mine")
    with pytest.raises(RecordingError, match="exists already"):
        write_recording(path, [a_scan(1.0)])
    assert path.read_text() == "mine"
    with pytest.raises(RecordingError, match=r"file/run: cannot be written"):
        write_recording(tmp_path / "run" / "file" / "run", [a_scan(1.0)])


def test_a_closed_recording_takes_no_more(tmp_path: Path) -> None:
    with RecordingWriter(tmp_path / "run") as writer:
        writer.write(a_scan(1.0))
        writer.close()
        writer.close()
        with pytest.raises(RecordingError, match="closed"):
            writer.write(a_scan(2.0))


def test_a_recording_can_be_moved(tmp_path: Path, messages: list[Message]) -> None:
    write_recording(tmp_path / "run", messages)
    shutil.move(tmp_path / "run", tmp_path / "other")
    assert len(list(open_recording(tmp_path / "other").messages())) == len(messages)


def a_scan(
    stamp: float,
    ranges: Any = (1.0, 2.0, math.nan, 3.0, 4.0, 5.0, 6.0, math.inf),
    angle_min: float = -1.0,
    angle_increment: float = 0.25,
    time_increment: float = 0.0,
) -> LaserScan:
    return evenly_spaced(
        stamp,
        ranges,
        angle_min=angle_min,
        angle_increment=angle_increment,
        range_min=0.125,
        range_max=16.0,
        time_increment=time_increment,
    )
