import errno
import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from ruamel.yaml import YAML

from contourslam.cli import main
from contourslam.recordings import Message, read_trajectory
from contourslam.recordings.carmen import CarmenRecording
from contourslam.report.result_folder import read_result_folder

Failure = Callable[..., str]
GRAPH = find_spec("gtsam") is not None
FILES = {
    "trajectory.tum",
    *(["trajectory_online.tum"] if GRAPH else []),
    "index.html",
    "map.cmap",
    "map.geojson",
    "map.svg",
    "odometry.tum",
    "metrics.json",
    "config.yaml",
    "scans.csv",
}

# Presses Ctrl-C after some messages of the recording, once or twice.
INTERRUPTED = """
import os, signal, sys
from contourslam.cli import main
from contourslam.recordings.carmen import CarmenRecording
whole = CarmenRecording.messages
def messages(self):
    for i, message in enumerate(whole(self)):
        if i == 40:
            for _ in range(int(sys.argv[1])):
                os.kill(os.getpid(), signal.SIGINT)
        yield message
CarmenRecording.messages = messages
sys.exit(main(sys.argv[2:]))
"""


def test_a_run_leaves_every_promised_file(mapped: Path) -> None:
    assert {path.name for path in mapped.iterdir()} == FILES
    assert "contourslam run" in (mapped / "config.yaml").read_text()


def test_the_page_of_a_run_says_what_was_mapped(mapped: Path) -> None:
    page = (mapped / "index.html").read_text()
    metrics = json.loads((mapped / "metrics.json").read_text())
    assert f"{metrics['landmarks']['corners']} corners and {metrics['landmarks']['walls']} walls" in page
    assert "<h1>circle.log</h1>" in page
    for absent in ("known relative poses", "true poses", "Closed loops", "INCOMPLETE"):
        assert absent not in page


@pytest.mark.parametrize("back_end", ["ekf", "graph"])
def test_the_way_through_a_known_room_is_right(back_end: str, log: Path, tmp_path: Path) -> None:
    if back_end == "graph" and not GRAPH:
        pytest.skip("the graph needs GTSAM, the extra `graph`")
    assert main(["run", str(log), "-o", str(tmp_path), "--back-end", back_end]) == 0
    result = read_result_folder(tmp_path).result
    assert result.complete
    assert result.back_end == back_end
    turn = 0.05 * (len(result.stamps) - 1)
    end = np.array([0.8 * np.sin(turn), 0.8 * (1.0 - np.cos(turn))])
    assert np.linalg.norm(result.poses[-1, :2] - end) < 0.02


def test_the_map_of_a_known_room_is_right(log: Path, tmp_path: Path) -> None:
    assert main(["run", str(log), "-o", str(tmp_path), "--back-end", "ekf", "--no-contour-matching"]) == 0
    result = read_result_folder(tmp_path).result
    start = np.array([2.0, 1.7])  # the run begins at zero
    for corner in ((0.0, 0.0), (6.0, 0.0), (6.0, 5.0), (0.0, 5.0)):
        distances = np.linalg.norm(result.corner_map.positions + start - corner, axis=1)
        assert distances.min() < 0.02


@pytest.mark.skipif(not GRAPH, reason="the graph needs GTSAM, the extra `graph`")
@pytest.mark.parametrize(
    ("options", "doubt"),
    [
        ([], ""),
        (["--sigma-range", "0.001"], "there is no corner in the map: the lidar's noise may not be the 0.001 m"),
        (["--mount-yaw", "3.1416"], "wheels and contours disagree (NIS "),
    ],
)
def test_what_looks_like_a_wrong_setting_is_said(
    options: list[str], doubt: str, log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["run", str(log), "-o", str(tmp_path), *options]) == 0
    said = capsys.readouterr().err
    assert doubt in said if doubt else said == ""


def test_the_back_end_is_the_graph_where_gtsam_is_and_the_reason_is_said(
    log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    best = "graph" if GRAPH else "ekf"
    for options, back_end, reason in (([], best, "GTSAM is"), (["--back-end", "ekf"], "ekf", "asked" if GRAPH else "")):
        out = tmp_path / f"out{len(options)}"
        assert main(["run", str(log), "-o", str(out), "--max-scans", "5", *options]) == 0
        said = capsys.readouterr().out
        assert f"back end: {back_end} (" in said
        assert reason in said
        assert " loops, " in said.splitlines()[0]
        metrics = json.loads((out / "metrics.json").read_text())
        assert metrics["back_end"] == back_end
        assert metrics["back_end_reason"] in said
        assert metrics["back_end_reason"] in (out / "index.html").read_text()


def test_without_gtsam_the_filter_runs_and_says_how_to_get_the_graph(log: Path, tmp_path: Path) -> None:
    code = (
        "import importlib.util as util, sys\n"
        "find = util.find_spec\n"
        "util.find_spec = lambda name, *more: None if name == 'gtsam' else find(name, *more)\n"
        "sys.modules['gtsam'] = None\n"
        "from contourslam.cli import main\n"
        "sys.exit(main(sys.argv[1:]))\n"
    )
    arguments = [sys.executable, "-c", code, "run", str(log), "-o", str(tmp_path / "out"), "--max-scans", "5"]
    done = subprocess.run(arguments, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "back end: ekf (GTSAM is not installed: `pip install 'contourslam[graph]'`" in done.stdout
    settings = read_result_folder(tmp_path / "out").config.slam
    assert (settings.walls, settings.contour_matching) == (True, True)


def test_the_recording_is_read_once_unless_a_grid_is_wanted(
    log: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole, passes = CarmenRecording.messages, []

    def counted(recording: CarmenRecording) -> Iterator[Message]:
        passes.append(recording)
        yield from whole(recording)

    monkeypatch.setattr(CarmenRecording, "messages", counted)
    arguments = ["run", str(log), "-o", str(tmp_path), "--overwrite"]
    for options, expected in (([], 1), (["--grid"], 3)):
        assert main([*arguments, *options]) == 0
        assert len(passes) == expected


def test_online_and_refined_errors_are_said_beside_each_other(
    log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    if not GRAPH:
        pytest.skip("the graph needs GTSAM, the extra `graph`")
    relations = tmp_path / "truth.relations"
    relations.write_text(f"100.0 110.0 {0.8 * np.sin(2.5)} {0.8 * (1 - np.cos(2.5))} 0 0 0 2.5\n")
    assert main(["run", str(log), "-o", str(tmp_path / "out"), "--relations", str(relations)]) == 0
    said = capsys.readouterr().out
    assert "relation error, refined at the end: 0.0" in said
    assert "as known at the time (online): 0.0" in said


def test_the_configuration_a_run_wrote_gives_the_same_run(log: Path, mapped: Path, tmp_path: Path) -> None:
    options = ["--detector", "wu", "--sigma-range", "0.02", "--no-walls"]
    assert main(["run", str(log), "-o", str(tmp_path / "a"), *options]) == 0
    assert main(["run", str(log), "-o", str(tmp_path / "b"), "--config", str(tmp_path / "a" / "config.yaml")]) == 0
    first, second = (tmp_path / name / "trajectory.tum" for name in "ab")
    assert first.read_bytes() == second.read_bytes()
    assert first.read_bytes() != (mapped / "trajectory.tum").read_bytes()


def test_an_option_beside_a_configuration_file_wins(log: Path, mapped: Path, tmp_path: Path) -> None:
    arguments = [f"--config={mapped / 'config.yaml'}", "--min-wall", "0.7", "-o", str(tmp_path / "out")]
    assert main(["run", str(log), *arguments, "--max-scans", "3"]) == 0
    old, new = (YAML(typ="safe").load(folder / "config.yaml") for folder in (mapped, tmp_path / "out"))
    assert new["landmarks"].pop("min_wall") == 0.7
    assert old["landmarks"].pop("min_wall") != 0.7
    assert old == new


def test_an_unknown_key_in_a_configuration_file_is_named(failure: Failure, tmp_path: Path) -> None:
    path = tmp_path / "config.yaml"
    path.write_text("slam:\n  wals: true\n")
    assert "slam.wals" in failure("run", "x.log", "-o", tmp_path / "out", "--config", path, code=2)


def test_a_missing_configuration_file_is_named(failure: Failure, tmp_path: Path) -> None:
    path = tmp_path / "none.yaml"
    assert str(path) in failure("run", "x.log", "-o", tmp_path / "out", "--config", path, code=2)


def test_a_folder_that_holds_something_is_refused(
    failure: Failure, log: Path, mapped: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = (mapped / "metrics.json").read_bytes()
    assert "--overwrite" in failure("run", log, "-o", mapped)
    assert (mapped / "metrics.json").read_bytes() == before


def test_overwriting_leaves_nothing_of_the_run_before(log: Path, tmp_path: Path) -> None:
    arguments = ["run", str(log), "-o", str(tmp_path), "--overwrite", "--max-scans", "5"]
    assert main([*arguments, "--grid"]) == 0
    assert {path.name for path in tmp_path.iterdir()} == FILES | {"map.pgm", "map.yaml"}
    assert main(arguments) == 0
    assert {path.name for path in tmp_path.iterdir()} == FILES


def test_an_output_folder_that_cannot_be_made_is_a_known_failure(failure: Failure, log: Path, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    assert "output folder" in failure("run", log, "-o", tmp_path / "file")


def test_an_unknown_detector_lists_those_there_are_and_writes_nothing(
    failure: Failure, log: Path, tmp_path: Path
) -> None:
    said = failure("run", log, "-o", tmp_path / "out", "--detector", "harris")
    assert "matched_filter, wu, teh_chin, curvature_scale_space" in said
    assert not (tmp_path / "out").exists()


def test_a_log_without_scans_says_what_it_has(failure: Failure, tmp_path: Path) -> None:
    path = tmp_path / "wheels.log"
    path.write_text("ODOM 0 0 0 0 0 0 1.0 host 1.0\n" * 3)
    said = failure("run", path, "-o", tmp_path / "out")
    assert "FLASER" in said
    assert "ODOM: 3" in said


def test_a_truncated_log_keeps_the_map_of_what_came_before(failure: Failure, log: Path, tmp_path: Path) -> None:
    path = tmp_path / "cut.log"
    content = log.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    said = failure("run", path, "-o", tmp_path / "out")
    assert "cut short" in said
    assert str(tmp_path / "out") in said
    kept = read_result_folder(tmp_path / "out")
    assert 25 <= len(kept.result.stamps) <= 30
    assert not kept.result.complete
    assert any("cut short" in reason for reason in kept.result.skipped)


@pytest.mark.parametrize("presses", [1, 2])
def test_ctrl_c_in_mid_run_keeps_what_is_done(presses: int, log: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    arguments = [sys.executable, "-c", INTERRUPTED, str(presses), "run", str(log), "-o", str(out)]
    done = subprocess.run(arguments, capture_output=True, text=True, check=False)
    assert done.returncode == 130, done.stderr
    assert "Traceback" not in done.stderr
    assert str(out) in done.stderr.splitlines()[-1]
    kept = read_result_folder(out).result
    assert 15 <= len(kept.stamps) <= 20  # odometry and scan alternate in the log
    assert not kept.complete


def test_a_full_disk_is_a_known_failure(
    failure: Failure, log: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(descriptor: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", full)
    said = failure("run", log, "-o", tmp_path / "out", "--max-scans", "3")
    assert "No space left on device" in said


def test_without_the_report_extra_all_is_written(log: Path, tmp_path: Path) -> None:
    code = (
        "import sys\n"
        "for name in ('matplotlib', 'scipy', 'evo'):\n"
        "    sys.modules[name] = None\n"
        "from contourslam.cli import main\n"
        "sys.exit(main(sys.argv[1:]))\n"
    )
    arguments = [sys.executable, "-c", code, "run", str(log), "-o", str(tmp_path), "--max-scans", "3"]
    done = subprocess.run(arguments, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert {path.name for path in tmp_path.iterdir()} == FILES


def test_every_and_max_scans_thin_the_recording(log: Path, tmp_path: Path) -> None:
    assert main(["run", str(log), "-o", str(tmp_path), "--every", "3", "--max-scans", "4"]) == 0
    assert read_result_folder(tmp_path).result.stamps.tolist() == pytest.approx([100.0, 100.6, 101.2, 101.8])
    stamps, _ = read_trajectory(tmp_path / "trajectory.tum")
    assert stamps.tolist() == pytest.approx(np.arange(100.0, 101.9, 0.2).tolist())  # the wheels between them too


def test_every_zero_is_refused(failure: Failure, log: Path, tmp_path: Path) -> None:
    assert "--every" in failure("run", log, "-o", tmp_path / "out", "--every", "0")


def test_relations_are_judged_beside_raw_odometry(
    log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    relations = tmp_path / "truth.relations"
    turn = 0.05 * 50
    relations.write_text(f"100.0 110.0 {0.8 * np.sin(turn)} {0.8 * (1 - np.cos(turn))} 0 0 0 {turn}\n")
    arguments = ["run", str(log), "-o", str(tmp_path / "out"), "--relations", str(relations), "--json"]
    assert main(arguments) == 0
    metrics = json.loads(capsys.readouterr().out)
    assert metrics["relations"]["count"] == 1
    assert metrics["relations"]["translation"]["mean"] < metrics["odometry_relations"]["translation"]["mean"]
    assert json.loads((tmp_path / "out" / "metrics.json").read_text())["relations"] == metrics["relations"]
    header, row = (tmp_path / "out" / "relation_errors.csv").read_text().splitlines()
    online = "online_translation,online_rotation," if GRAPH else ""
    assert header == f"earlier_stamp,later_stamp,translation,rotation,{online}odometry_translation,odometry_rotation"
    values = [float(value) for value in row.split(",")]
    assert values[:2] == [100.0, 110.0]
    assert values[2] == pytest.approx(metrics["relations"]["translation"]["mean"], rel=1e-4)
    page = (tmp_path / "out" / "index.html").read_text()
    assert "Error against known relative poses" in page
    assert "--relations" in page  # the command


def test_a_single_scan_is_not_judged_and_still_shown(log: Path, tmp_path: Path) -> None:
    relations = tmp_path / "truth.relations"
    relations.write_text("100.0 110.0 1 0 0 0 0 0\n")
    arguments = ["--max-scans", "1", "--relations", str(relations)]
    assert main(["run", str(log), "-o", str(tmp_path / "out"), *arguments]) == 0
    assert "1 scan over" in (tmp_path / "out" / "index.html").read_text()


def test_a_wrong_relations_file_fails_before_any_work(failure: Failure, log: Path, tmp_path: Path) -> None:
    relations = tmp_path / "truth.relations"
    relations.write_text("1 2 3\n")
    assert "line 1" in failure("run", log, "-o", tmp_path / "out", "--relations", relations)
    assert not (tmp_path / "out").exists()
