import gzip
import lzma
import math
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from contourslam.errors import RecordingError
from contourslam.recordings import open_recording
from contourslam.recordings.carmen_lines import beam_angles
from contourslam.scan import LaserScan, Odometry

Drain = Callable[[Iterator[Any]], tuple[list[Any], RecordingError | None]]


def log(tmp_path: Path, *lines: str | bytes, name: str = "run.log") -> Path:
    path = tmp_path / name
    path.write_bytes(b"".join(line.encode() if isinstance(line, str) else line for line in lines))
    return path


def flaser(count: int, stamp: float = 7.5, value: float = 2.0) -> str:
    return f"FLASER {count} {f'{value:.2f} ' * count}9 8 7 1 2 0.5 {stamp} host 0.1\n"


@pytest.mark.parametrize(
    ("name", "scans", "odometry_lines", "beams"),
    [
        ("intel/intel.log", 9243, 13631, 180),
        ("mit_csail/mit-csail.clf", 1988, 0, 361),
        ("aces/aces.log", 440, 7374, 180),
        ("acapulco/acapulco.log", 861, 11281, 181),
    ],
)
def test_every_line_of_the_real_logs_is_read(
    shared_data: Path, name: str, scans: int, odometry_lines: int, beams: int
) -> None:
    recording = open_recording(shared_data / f"{name}.xz")
    messages = list(recording.messages())
    read_scans = [message for message in messages if isinstance(message, LaserScan)]
    assert len(read_scans) == scans
    assert len(messages) - scans == odometry_lines + scans
    assert {scan.ranges.size for scan in read_scans} == {beams}
    assert recording.skipped == {} and recording.lidar_mount is None
    counts = {topic.name: topic.count for topic in recording.topics()}
    assert counts == {"FLASER": scans} | ({"ODOM": odometry_lines} if odometry_lines else {})
    stamps = [message.stamp for message in messages]
    assert (recording.start, recording.end) == (min(stamps), max(stamps))


def test_stamps_that_run_backwards_keep_the_order_of_the_file_and_reading_is_fast(shared_data: Path) -> None:
    """At least 4,000 scans a second of processor time, less than half of what an idle machine reaches."""
    recording = open_recording(shared_data / "intel" / "intel.log.xz")
    began = time.process_time()
    stamps = np.array([message.stamp for message in recording.messages() if isinstance(message, LaserScan)])
    assert stamps.size / (time.process_time() - began) > 4000
    assert (np.diff(stamps) < 0).sum() > 100


@pytest.mark.parametrize("count", [180, 360, 181, 361, 90, 541])
def test_beams_span_half_a_turn_and_an_odd_number_has_both_ends(count: int) -> None:
    angles = beam_angles(count)
    step = math.pi / (count - count % 2)
    assert angles[0] == pytest.approx(-math.pi / 2) and np.allclose(np.diff(angles), step)
    assert angles[-1] == pytest.approx(math.pi / 2 - (0.0 if count % 2 else step))


def test_a_scan_line_gives_its_odometry_and_then_the_scan(tmp_path: Path) -> None:
    odometry, scan = open_recording(log(tmp_path, flaser(5))).messages()
    assert isinstance(odometry, Odometry) and isinstance(scan, LaserScan)
    assert odometry.stamp == scan.stamp == 7.5
    assert odometry.pose.tolist() == [1.0, 2.0, 0.5]
    assert scan.ranges.tolist() == [2.0] * 5 and not scan.offsets.any()


def test_fifty_metres_and_more_are_no_return(tmp_path: Path) -> None:
    path = log(tmp_path, "FLASER 4 81.91 50.00 49.99 nan 0 0 0 0 0 0 1.0 host 0\n")
    scan = list(open_recording(path).messages())[1]
    assert isinstance(scan, LaserScan)
    assert (scan.ranges < scan.range_max).tolist() == [False, False, True, False]


@pytest.mark.parametrize("tail", ["0", "2 17 18", ""])
def test_the_newer_scan_line_carries_its_own_angles(tmp_path: Path, tail: str) -> None:
    """With and without remissions; the oldest of these logs have not even their number."""
    line = f"ROBOTLASER1 0 -1.0 2.0 0.5 20.0 0.01 0 5 1 2 3 4 20.0 {tail} 9 9 9 1 2 0.5 0 0 0 0 0 3.5 host 0.1\n"
    odometry, scan = open_recording(log(tmp_path, line)).messages()
    assert isinstance(odometry, Odometry) and isinstance(scan, LaserScan)
    assert odometry.pose.tolist() == [1.0, 2.0, 0.5] and odometry.stamp == scan.stamp == 3.5
    assert np.allclose(scan.angles, [-1.0, -0.5, 0.0, 0.5, 1.0])
    assert scan.ranges.tolist() == [1, 2, 3, 4, 20] and scan.range_max == 20.0


def test_parameters_place_the_lidar(tmp_path: Path, carmen_lines: list[bytes]) -> None:
    assert open_recording(log(tmp_path, *carmen_lines)).lidar_mount == (0.14, 0.0, 0.0)


def test_a_laser_pose_off_the_odometry_by_a_constant_is_mentioned_and_not_used(tmp_path: Path) -> None:
    lines = [
        f"FLASER 1 2.0 {x + 0.2 * math.cos(a)} {0.2 * math.sin(a)} {a} {x} 0 {a} {x} host 0\n"
        for x, a in [(0.0, 0.0), (1.0, 0.4), (2.0, -2.0)]
    ]
    recording = open_recording(log(tmp_path, *lines))
    assert recording.lidar_mount is None
    assert "0.200 m, 0.000 m" in recording.notes[0].replace("-0.000", "0.000")
    assert open_recording(log(tmp_path, *lines[:1], flaser(1))).notes == []


def test_comments_other_lines_and_blank_lines_are_passed_over(tmp_path: Path) -> None:
    noise = ["# comment\n", "\n", "SYNC start host 0\n", "RLASER 1 2.0 0 0 0 0 0 0 1 host 0\n", "PARAM a b host 0\n"]
    recording = open_recording(log(tmp_path, *noise, flaser(3), *noise))
    assert len(list(recording.messages())) == 2 and recording.skipped == {}


def test_the_kind_of_scan_line_can_be_chosen(tmp_path: Path) -> None:
    other = "ROBOTLASER1 0 -1 2 1 20.0 0 0 3 1 2 3 0 9 9 9 1 2 0.5 0 0 0 0 0 3.5 host 0.1\n"
    path = log(tmp_path, flaser(5), other)
    sizes = [
        [m.ranges.size for m in open_recording(path, scan_topic=kind).messages() if isinstance(m, LaserScan)]
        for kind in (None, "FLASER", "ROBOTLASER1")
    ]
    assert sizes == [[5], [5], [3]]
    for arguments in ({"scan_topic": "/scan"}, {"truth_topic": "/truth"}, {"odometry_topic": "/odom"}):
        with pytest.raises(RecordingError, match="CARMEN"):
            open_recording(path, **arguments)


@pytest.mark.parametrize(
    ("bad", "reason"),
    [
        (flaser(5).replace("FLASER 5", "FLASER 6"), "FLASER line with a wrong number of values (first: line 2)"),
        (flaser(5).replace(" 2.00 2.00", " 2.00", 1), "FLASER line with a wrong number of values (first: line 2)"),
        (flaser(5).replace("2.00", "x"), "FLASER line with a value that is not a number (first: line 2)"),
        (flaser(5).replace("7.5", "nan"), "FLASER line with a value that is not a number (first: line 2)"),
        ("ODOM 1 2 3\n", "ODOM line with a wrong number of values (first: line 2)"),
        ("ODOM 1 2 inf 0 0 0 4 host 1\n", "ODOM line with a value that is not a number (first: line 2)"),
        (b"\xff\xfe!! what\n", "line that is not CARMEN's (first: line 2)"),
    ],
)
def test_a_malformed_line_is_skipped_and_counted(tmp_path: Path, bad: str | bytes, reason: str) -> None:
    recording = open_recording(log(tmp_path, flaser(4), bad, flaser(4), bad))
    for _ in range(2):  # a second pass counts afresh
        assert len(list(recording.messages())) == 4
        assert recording.skipped == {reason: 2}


@pytest.mark.parametrize("end", [flaser(4)[:-30], "ODOM 1 2 3", "FLA", "FLASER 200 1.0 2.0"])
def test_a_cut_last_line_ends_in_an_error_after_all_before_it(tmp_path: Path, drain: Drain, end: str) -> None:
    messages, error = drain(open_recording(log(tmp_path, flaser(4), flaser(4), end)).messages())
    assert len(messages) == 4
    assert error is not None and "run.log: cut short in line 3" in str(error)


def test_a_last_line_without_a_line_end_but_whole_is_read(tmp_path: Path) -> None:
    assert len(list(open_recording(log(tmp_path, flaser(4), flaser(4).rstrip("\n"))).messages())) == 4


def test_binary_rubbish_ends_in_an_error_after_all_before_it(tmp_path: Path, drain: Drain) -> None:
    messages, error = drain(open_recording(log(tmp_path, flaser(4), bytes(5000), b"\n", flaser(4))).messages())
    assert len(messages) == 2
    assert error is not None and "damaged at line 2" in str(error)


@pytest.mark.parametrize("pack", [gzip.compress, lzma.compress])
def test_a_cut_compressed_log_keeps_the_scans_before_the_damage(
    tmp_path: Path, carmen_lines: list[bytes], drain: Drain, pack: Callable[[bytes], bytes]
) -> None:
    whole = list(open_recording(log(tmp_path, *carmen_lines)).messages())
    packed = pack(b"".join(carmen_lines))
    messages, error = drain(open_recording(log(tmp_path, packed[: len(packed) // 2], name="run.log.gz")).messages())
    assert error is not None and "after line" in str(error)
    assert 20 < len(messages) < len(whole)
    assert [message.stamp for message in messages] == [message.stamp for message in whole[: len(messages)]]


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "is empty"),
        (b"time,x,y\n1,2,3\n", "neither a rosbag"),
        (b"\xff\xd8\xff\xe0\x00\x10JFIF" + bytes(range(256)) * 20, "neither a rosbag"),
        (b"ODOM 1 2 3 0 0 0 4 host 1\n", r"no usable FLASER or ROBOTLASER1 line; lines found: ODOM: 1"),
        (gzip.compress(b"FLASER", mtime=0)[:-9], "cut short after line 0"),
        (gzip.compress(b"#ROSBAG V2.0\n", mtime=0), "decompress it first"),
    ],
)
def test_what_is_no_log_is_refused_by_name_and_reason(tmp_path: Path, content: bytes, words: str) -> None:
    with pytest.raises(RecordingError, match=words) as caught:
        open_recording(log(tmp_path, content))
    assert "run.log" in str(caught.value)


def test_a_log_whose_scans_are_all_malformed_says_so(tmp_path: Path, drain: Drain) -> None:
    _, error = drain(open_recording(log(tmp_path, flaser(4).replace("FLASER 4", "FLASER 9"))).messages())
    assert error is not None and "no usable FLASER line" in str(error)


FUZZ = settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None, max_examples=60)


@FUZZ
@given(st.binary(max_size=300))
def test_any_bytes_are_read_or_refused_with_a_known_error(tmp_path: Path, drain: Drain, content: bytes) -> None:
    try:
        recording = open_recording(log(tmp_path, content))
    except RecordingError as error:
        assert "run.log" in str(error) and "\n" not in str(error)
    else:
        drain(recording.messages())


@FUZZ
@given(st.data())
def test_a_damaged_log_gives_what_comes_before_and_nothing_but_known_errors(
    tmp_path: Path, carmen_lines: list[bytes], drain: Drain, data: st.DataObject
) -> None:
    content = b"".join(carmen_lines)
    place = data.draw(st.integers(0, len(content) - 1))
    patch = data.draw(st.one_of(st.none(), st.binary(min_size=1, max_size=20)))
    damaged = content[:place] if patch is None else content[:place] + patch + content[place + len(patch) :]
    whole_lines = content[:place].count(b"\n")
    try:
        recording = open_recording(log(tmp_path, damaged))
    except RecordingError:
        assert whole_lines < 4  # before the first scan
        return
    messages, _ = drain(recording.messages())
    before = max(0, whole_lines - 2)  # the log starts with two lines that yield nothing, then ODOM and FLASER in turn
    assert len(messages) >= before // 2 * 3 + before % 2
    assert all(np.isfinite(message.stamp) for message in messages)
