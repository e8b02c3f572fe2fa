"""The node replay: what `contourslam run` leaves of a bag, by parameters."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np

from contourslam.cli import main as contourslam
from contourslam.recordings.trajectories import read_trajectory


def replay(*parameters: str) -> "subprocess.CompletedProcess[str]":
    words = [word for parameter in parameters for word in ("-p", parameter)]
    return subprocess.run(
        [sys.executable, "-m", "contourslam_ros.replay", "--ros-args", *words], capture_output=True, text=True
    )


def test_it_writes_what_the_command_writes(compiled: None, recording: Path, tmp_path: Path) -> None:
    done = replay(f"bag:={recording}", f"output:={tmp_path / 'node'}", "contour.spacing:=0.06", "grid:=true")
    assert done.returncode == 0, done.stderr
    words = [
        "run",
        str(recording),
        "-o",
        str(tmp_path / "command"),
        "--spacing",
        "0.06",
        "--grid",
        "--back-end",
        "graph",
    ]
    assert contourslam(words) == 0
    names = {path.name for path in (tmp_path / "command").iterdir()}
    assert names == {path.name for path in (tmp_path / "node").iterdir()}
    assert "map.pgm" in names
    ours, theirs = (read_trajectory(tmp_path / folder / "trajectory.tum") for folder in ("node", "command"))
    np.testing.assert_array_equal(ours[0], theirs[0])
    np.testing.assert_allclose(ours[1], theirs[1], atol=1e-6)
    assert json.loads((tmp_path / "node" / "metrics.json").read_text())["complete"]


def test_it_says_what_is_missing(tmp_path: Path) -> None:
    done = replay("bag:=a")
    assert done.returncode == 2
    assert "replay needs the parameters bag" in done.stderr
    done = replay(f"bag:={tmp_path / 'absent'}", f"output:={tmp_path / 'out'}")
    assert done.returncode == 1
    assert "absent" in done.stderr
