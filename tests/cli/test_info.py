import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from contourslam.cli import main
from contourslam.recordings import write_recording
from contourslam.scan import evenly_spaced


def test_info_counts_what_is_in_a_log(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["info", str(log), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["topics"] == [{"name": "FLASER", "type": "laser scan and odometry", "count": 60}]
    assert found["scans"]["count"] == found["odometry"]["count"] == 60
    assert found["scans"]["beams"] == [180, 180]
    assert found["scans"]["rate"] == pytest.approx(5.0)
    assert found["scans"]["end"] - found["scans"]["start"] == pytest.approx(11.8)
    assert found["truth"]["count"] == 0
    assert found["missing"] == []
    assert found["read_to_end"]


def test_info_says_how_to_map_a_log(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["info", str(log)]) == 0
    text = capsys.readouterr().out
    assert "60 in 11.8 s, 5 Hz" in text
    assert "180 a scan, -90.0° to 89.0°" in text
    assert f"contourslam run {log} -o out" in text


def test_info_says_how_to_map_a_recording_without_odometry(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "no_wheels"
    beams = np.linspace(2.0, 3.0, 90)
    scans = [
        evenly_spaced(0.1 * k, beams, angle_min=-1.5, angle_increment=1 / 30, range_min=0.1, range_max=10.0)
        for k in range(3)
    ]
    write_recording(path, scans)
    assert main(["info", str(path)]) == 0
    text = capsys.readouterr().out
    assert "the scans alone must do" in text
    assert f"contourslam run {path} -o out" in text


def test_info_names_the_damage_and_counts_what_came_before(
    log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "cut.log"
    content = log.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    assert main(["info", str(path), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert "cut short" in found["damage"]
    assert not found["read_to_end"]
    assert 25 <= found["scans"]["count"] <= 30


def test_info_counts_stamps_that_run_backwards(log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    lines = log.read_text().splitlines(keepends=True)
    path = tmp_path / "backwards.log"
    path.write_text("".join([*lines[:10], *lines[5:10]]))
    assert main(["info", str(path)]) == 0
    assert "stamps run backwards 1 times" in capsys.readouterr().out


def test_info_as_json_is_only_json_on_standard_output(log: Path) -> None:
    command = [sys.executable, "-m", "contourslam", "info", str(log), "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert json.loads(done.stdout)["recording"] == str(log)
