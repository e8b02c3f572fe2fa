import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from contourslam.cli import main

Failure = Callable[..., str]
SMALL = ["--duration", "5", "--jobs", "1", "--no-noise-sweep", "--no-details"]

# Presses Ctrl-C once the first replay of the comparison is done; its figures are made and not drawn.
INTERRUPTED = """
import os, signal, sys
from matplotlib.figure import Figure
from contourslam.cli import main
from contourslam.experiments import parallel
class Observer(parallel.Observer):
    def __init__(self, progress, stopped):
        def told(done, total):
            progress(done, total)
            if done == 1:
                os.kill(os.getpid(), signal.SIGINT)
        super().__init__(told, stopped)
parallel.Observer = Observer
Figure.savefig = lambda figure, path, **more: path.write_text("")
sys.exit(main(sys.argv[1:]))
"""


@pytest.mark.usefixtures("undrawn")
def test_compare_writes_the_promised_figures_and_prints_table_one(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    detectors = ["matched_filter", "wu"]
    arguments = ["compare", "--seeds", "2", *SMALL, "-o", str(tmp_path), "--detectors", *detectors]
    assert main(arguments) == 0
    metrics = json.loads((tmp_path / "metrics.json").read_text())
    assert metrics["complete"]
    for name in detectors:
        found = metrics["detectors"][name]
        assert {"mean", "sd"} <= found["rmse"]["x"].keys() & found["rmse"]["theta"].keys()
        assert all(found[key] is not None for key in ("nees", "fnr", "scans_per_second"))
    table = capsys.readouterr().out
    assert "mean over 2 drives" in table
    row = next(line for line in table.splitlines() if line.startswith("wu")).split()
    assert row[-3:] == ["0.171", "0.112", "0.0240"]
    assert (tmp_path / "index.html").is_file()
    assert main(["info", str(tmp_path / "recording")]) == 0


def test_ctrl_c_in_a_comparison_reports_what_is_done(tmp_path: Path) -> None:
    out = tmp_path / "out"
    command = [sys.executable, "-c", INTERRUPTED, "compare", "--seeds", "2", *SMALL, "-o", str(out)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=os.environ | {"COLUMNS": "200"})
    assert done.returncode == 130, done.stderr
    assert "Traceback" not in done.stderr
    metrics = json.loads((out / "metrics.json").read_text())
    assert not metrics["complete"]
    assert list(metrics["detectors"]) == ["matched_filter"]
    assert "INCOMPLETE" in (out / "index.html").read_text()


def test_an_unknown_room_or_detector_lists_those_there_are(failure: Failure, tmp_path: Path) -> None:
    assert "large_hall" in failure("compare", "-o", tmp_path / "x", "--room", "kitchen")
    assert "teh_chin" in failure("compare", "-o", tmp_path / "x", "--detectors", "harris")
    assert not (tmp_path / "x").exists()


def test_no_seed_is_refused(failure: Failure, tmp_path: Path) -> None:
    assert "--seeds" in failure("compare", "-o", tmp_path / "x", "--seeds", "0")
