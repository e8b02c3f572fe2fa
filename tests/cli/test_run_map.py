"""``contourslam run --map`` goes on in the map of an earlier run."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from contourslam.cli import main
from contourslam.maps import load_map
from contourslam.report.result_folder import read_result_folder

Failure = Callable[..., str]
pytest.importorskip("gtsam", reason="needs the extra 'graph'")


def half(log: Path, folder: Path, first: int, until: int) -> Path:
    """Some scans of a log."""
    path = folder / f"from_{first}.log"
    path.write_text("".join(log.read_text().splitlines(keepends=True)[first:until]))
    return path


def place(scan: int) -> np.ndarray:
    """Where the robot is at a scan, in the frame of its start."""
    turn = 0.05 * scan
    return np.array([0.8 * np.sin(turn), 0.8 * (1.0 - np.cos(turn))])


@pytest.mark.parametrize("given", [False, True], ids=["found", "given"])
def test_a_run_goes_on_in_an_earlier_map(
    given: bool, log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    first, second = half(log, tmp_path, 0, 40), half(log, tmp_path, 25, 60)
    assert main(["run", str(first), "-o", str(tmp_path / "monday")]) == 0
    earlier = tmp_path / "monday" / "map.cmap"
    at = ["--initial-pose", "0.9", "0.4", "60"] if given else []
    capsys.readouterr()
    assert main(["run", str(second), "--map", str(earlier), "-o", str(tmp_path / "tuesday"), *at]) == 0
    assert "the drive was found to begin at x 0.7" in capsys.readouterr().err
    result = read_result_folder(tmp_path / "tuesday").result
    assert len(result.poses) == 35
    np.testing.assert_allclose(result.poses[[0, -1], :2], [place(25), place(59)], atol=0.03)
    before, after = load_map(earlier), load_map(tmp_path / "tuesday" / "map.cmap")
    assert after.keyframes is not None
    assert set(after.keyframes.drives.tolist()) == {0, 1}
    assert after.about["recordings"].split() == ["from_0.log", "from_25.log"]
    _, i, j = np.intersect1d(before.corners.ids, after.corners.ids, return_indices=True)
    assert len(i) >= 3
    np.testing.assert_allclose(after.corners.positions[j], before.corners.positions[i], atol=0.03)


def test_a_map_may_be_replaced_by_its_own_continuation(log: Path, tmp_path: Path) -> None:
    for _ in range(2):
        earlier = ["--map", str(tmp_path / "map.cmap")] if (tmp_path / "map.cmap").exists() else []
        assert main(["run", str(log), "-o", str(tmp_path), "--overwrite", *earlier]) == 0
    keyframes = load_map(tmp_path / "map.cmap").keyframes
    assert keyframes is not None
    assert keyframes.drives.max() == 1


def test_the_filter_leaves_landmarks_alone_which_cannot_be_continued(
    log: Path, tmp_path: Path, failure: Failure
) -> None:
    assert main(["run", str(log), "-o", str(tmp_path / "ekf"), "--back-end", "ekf"]) == 0
    path = tmp_path / "ekf" / "map.cmap"
    saved = load_map(path)
    assert saved.keyframes is None
    assert len(saved.corners.ids) + len(saved.walls.ids) > 5
    said = failure("run", log, "--map", path, "-o", tmp_path / "on")
    assert f"{path}: the map cannot be continued" in said
    assert not (tmp_path / "on").exists()


def test_the_filter_continues_no_map(mapped: Path, log: Path, tmp_path: Path, failure: Failure) -> None:
    said = failure("run", log, "--map", mapped / "map.cmap", "--back-end", "ekf", "-o", tmp_path / "on")
    assert "choose --back-end graph" in said


def test_a_map_that_is_none_is_said(log: Path, tmp_path: Path, failure: Failure) -> None:
    assert "none.cmap: cannot be read" in failure("run", log, "--map", "none.cmap", "-o", tmp_path / "on")
    assert "is no map of contourslam" in failure("run", log, "--map", log, "-o", tmp_path / "on")


def test_a_start_that_the_scans_do_not_show_is_said(
    mapped: Path, tmp_path: Path, failure: Failure, capsys: pytest.CaptureFixture[str]
) -> None:
    blind = tmp_path / "blind.log"
    beams = "81.83 " * 180
    blind.write_text("".join(f"FLASER 180 {beams}0 0 0 0 0 0 {100 + 0.2 * i:.3f} host {i}\n" for i in range(15)))
    said = failure("run", blind, "--map", mapped / "map.cmap", "-o", tmp_path / "on")
    assert "none of the first 15 scans shows where in this map the drive begins; say about where with" in said
    given = ["--initial-pose", "0", "0", "0"]
    assert main(["run", str(blind), "--map", str(mapped / "map.cmap"), "-o", str(tmp_path / "there"), *given]) == 0
    assert "--initial-pose is taken as it is" in capsys.readouterr().err


def test_a_new_map_begins_where_it_is_told_to(log: Path, tmp_path: Path) -> None:
    assert main(["run", str(log), "-o", str(tmp_path), "--initial-pose", "2", "1.7", "90"]) == 0
    result = read_result_folder(tmp_path).result
    np.testing.assert_allclose(result.poses[0], [2.0, 1.7, np.pi / 2], atol=0.01)
