import json
import math
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from contourslam.cli import main
from contourslam.recordings import write_trajectory
from contourslam.report.result_folder import read_result_folder
from contourslam.report.scan_table import write_scan_table

Failure = Callable[..., str]


def truth(path: Path, begin: float = 100.0) -> Path:
    turn = 0.05 * np.arange(60)
    poses = np.stack([2.0 + 0.8 * np.sin(turn), 1.7 + 0.8 * (1.0 - np.cos(turn)), turn], axis=-1)
    write_trajectory(path, begin + 0.2 * np.arange(60), poses)
    return path


def test_a_run_is_judged_by_a_true_trajectory_in_another_frame(
    mapped: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["evaluate", str(mapped), "--truth", str(truth(tmp_path / "truth.tum")), "--json"]) == 0
    metrics = json.loads(capsys.readouterr().out)[str(mapped)]
    assert 0.0 < metrics["rmse"]["x"] < 0.01
    assert metrics["rmse"]["theta"] < 0.005
    assert metrics["odometry_rmse"]["x"] > metrics["rmse"]["x"]


def test_folders_stand_side_by_side(mapped: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    relations = tmp_path / "truth.relations"
    relations.write_text(f"100.0 110.0 {0.8 * np.sin(2.5)} {0.8 * (1 - np.cos(2.5))} 0 0 0 2.5\n")
    other = tmp_path / "other"
    shutil.copytree(mapped, other)
    assert main(["evaluate", str(mapped), str(other), "--relations", str(relations)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].split() == [str(mapped), str(other)]
    row = next(line for line in lines if line.startswith("relation error, mean, m "))
    first, second = row.split()[-2:]
    assert first == second
    assert float(first) < 0.02


def test_the_online_poses_are_judged_beside_the_refined(
    mapped: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    relations = tmp_path / "truth.relations"
    relations.write_text(f"100.0 110.0 {0.8 * np.sin(2.5)} {0.8 * (1 - np.cos(2.5))} 0 0 0 2.5\n")
    folder = tmp_path / "refined"
    shutil.copytree(mapped, folder)
    stored = read_result_folder(folder)
    online = stored.result.poses.copy()
    online[20:, 0] += 0.25
    online[20:, 2] += math.radians(3.0)
    write_scan_table(folder / "scans.csv", replace(stored.result, online_poses=online))
    assert main(["evaluate", str(folder), "--relations", str(relations), "--json"]) == 0
    metrics = json.loads(capsys.readouterr().out)[str(folder)]
    assert metrics["relations"]["translation"]["mean"] < 0.02
    assert metrics["online_relations"]["translation"]["mean"] == pytest.approx(0.25, abs=0.02)
    assert main(["evaluate", str(folder), "--relations", str(relations)]) == 0
    rows = dict(line.rsplit(None, 1) for line in capsys.readouterr().out.splitlines()[1:])
    assert float(rows["online relation error, median, m"]) == pytest.approx(0.25, abs=0.02)
    assert float(rows["online relation error, rotation, mean, deg"]) == pytest.approx(3.0, abs=0.3)
    assert float(rows["relation error, rotation, mean, deg"]) < 0.5


def test_a_truth_of_another_clock_says_so(failure: Failure, mapped: Path, tmp_path: Path) -> None:
    said = failure("evaluate", mapped, "--truth", truth(tmp_path / "truth.tum", begin=5000.0))
    assert "clock" in said


def test_relations_of_another_clock_say_so(failure: Failure, mapped: Path, tmp_path: Path) -> None:
    relations = tmp_path / "truth.relations"
    relations.write_text("5000.0 5001.0 1 0 0 0 0 0\n")
    assert "clock" in failure("evaluate", mapped, "--relations", relations)


def test_a_folder_that_is_no_result_is_named(failure: Failure, tmp_path: Path) -> None:
    assert str(tmp_path) in failure("evaluate", tmp_path)
    assert "nothing" in failure("evaluate", tmp_path / "nothing")
