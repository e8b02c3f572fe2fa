from pathlib import Path

import numpy as np
import pytest

from contourslam.errors import RecordingError
from contourslam.recordings import read_relations


@pytest.mark.parametrize(("name", "count"), [("intel/intel", 2984), ("mit_csail/mit-csail", 1189)])
def test_every_relation_of_the_real_files_is_read(shared_data: Path, name: str, count: int) -> None:
    stamps, poses = read_relations(shared_data / f"{name}.relations.xz")
    assert stamps.shape == (count, 2) and poses.shape == (count, 3)
    assert np.isfinite(stamps).all() and np.abs(poses[:, 2]).max() <= np.pi + 1e-6


def test_position_and_yaw_are_taken_from_their_columns(tmp_path: Path) -> None:
    path = tmp_path / "a.relations"
    path.write_text("1 2 3 4 5 6 7 0.5\n")
    stamps, poses = read_relations(path)
    assert stamps.tolist() == [[1.0, 2.0]] and poses.tolist() == [[3.0, 4.0, 0.5]]


def test_a_short_row_is_named_by_its_line(tmp_path: Path) -> None:
    path = tmp_path / "a.relations"
    path.write_text("1 2 3 4 5 6 7 0.5\n1 2 3 4 5 6 7\n")
    with pytest.raises(RecordingError, match=r"a\.relations: line 2 has 7 values, expected 8"):
        read_relations(path)
