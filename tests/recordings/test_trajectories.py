import lzma
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from contourslam.errors import ContourslamError, RecordingError, ResultError
from contourslam.geometry.angles import wrap
from contourslam.recordings import read_trajectory, write_trajectory

IN_FILE = settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None, max_examples=60)


@IN_FILE
@given(hnp.arrays(np.float64, st.tuples(st.integers(1, 20), st.just(4)), elements=st.floats(-1e3, 1e3)))
def test_a_trajectory_comes_back_to_a_nanosecond_and_a_nanometre(tmp_path: Path, rows: np.ndarray) -> None:
    path = tmp_path / "trajectory.tum"
    stamps = 976052857.0 + rows[:, 0]
    write_trajectory(path, stamps, rows[:, 1:])
    got_stamps, got = read_trajectory(path)
    assert np.array_equal(got_stamps, stamps)
    assert np.abs(got[:, :2] - rows[:, 1:3]).max() < 1e-9
    assert np.abs(wrap(got[:, 2] - rows[:, 3])).max() < 1e-9


def test_rows_of_four_are_planar_poses_compressed_or_not(tmp_path: Path) -> None:
    path = tmp_path / "poses.xz"
    path.write_bytes(lzma.compress(b"# t x y theta\n1 2 3 7\n2.5 -1 0.5 -0.25\n"))
    stamps, poses = read_trajectory(path)
    assert stamps.tolist() == [1.0, 2.5]
    assert np.allclose(poses, [[2.0, 3.0, 7.0 - 2 * np.pi], [-1.0, 0.5, -0.25]])


def test_the_heading_is_right_where_the_robot_also_tilts(tmp_path: Path) -> None:
    half_yaw, half_pitch = 0.5 * 1.2, 0.5 * 0.3
    qx, qy = -np.sin(half_yaw) * np.sin(half_pitch), np.cos(half_yaw) * np.sin(half_pitch)
    qz, qw = np.sin(half_yaw) * np.cos(half_pitch), np.cos(half_yaw) * np.cos(half_pitch)
    path = tmp_path / "t.tum"
    path.write_text(f"0 0 0 0 {qx} {qy} {qz} {qw}\n")
    assert read_trajectory(path)[1][0, 2] == pytest.approx(1.2, abs=1e-12)


def test_a_quaternion_that_is_none_is_named_by_its_line(tmp_path: Path) -> None:
    path = tmp_path / "t.tum"
    path.write_text("# head\n0 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 0\n")
    with pytest.raises(RecordingError, match=r"t\.tum: line 3: .*quaternion"):
        read_trajectory(path)


def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "t.tum"
    write_trajectory(path, [1.0], [[1.0, 2.0, 3.0]])
    before = path.read_text()

    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", full)
    with pytest.raises(ResultError, match=r"t\.tum: cannot be written: No space left"):
        write_trajectory(path, [1.0, 2.0], np.zeros((2, 3)))
    assert path.read_text() == before
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    ("stamps", "poses"), [([1.0], [[1.0, 2.0]]), ([1.0, 2.0], [[0.0, 0.0, 0.0]]), ([np.nan], [[0.0, 0.0, 0.0]])]
)
def test_what_is_no_trajectory_is_not_written(tmp_path: Path, stamps: list[float], poses: list[list[float]]) -> None:
    with pytest.raises(ResultError):
        write_trajectory(tmp_path / "t.tum", stamps, poses)
    assert not list(tmp_path.iterdir())


@IN_FILE
@given(st.binary(max_size=200))
def test_any_bytes_are_a_trajectory_or_a_known_error(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "t.tum"
    path.write_bytes(content)
    try:
        stamps, poses = read_trajectory(path)
    except ContourslamError as error:
        assert "t.tum" in str(error) and "\n" not in str(error)
    else:
        assert poses.shape == (len(stamps), 3)
