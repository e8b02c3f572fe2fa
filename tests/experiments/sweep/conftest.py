"""Experiments written to a folder, read and planned."""

from collections.abc import Callable
from pathlib import Path

import pytest

pytest.importorskip("distributed", reason="the extra sweep is not installed")
pytest.importorskip("mujoco", reason="the extra simulation is not installed")

from contourslam.experiments.sweep.experiment import Experiment, read_experiment
from contourslam.experiments.sweep.plan import plan
from contourslam.experiments.sweep.runs import Run

Written = Callable[[str], Experiment]
Planned = Callable[[str], tuple[Run, ...]]


@pytest.fixture
def written(tmp_path: Path) -> Written:
    """Reads an experiment from its text; a name need not be in it."""

    def write(text: str) -> Experiment:
        path = tmp_path / "experiment.toml"
        path.write_text(text if text.startswith("name") else f'name = "test"\n{text}')
        return read_experiment(path)

    return write


@pytest.fixture
def planned(written: Written) -> Planned:
    """Runs of an experiment."""
    return lambda text: plan(written(text))


@pytest.fixture
def log_of(tmp_path, scan_of, room):
    """Writes still.log, a CARMEN log of a robot that stands still in a room of 6 by 4 m, 25 scans."""

    def write(end: str = "") -> None:
        ranges = " ".join(f"{r:.2f}" for r in scan_of(room([[-3, -2], [3, -2], [3, 2], [-3, 2]]), beams=180).ranges)
        lines = [f"FLASER 180 {ranges} 0 0 0 0 0 0 {t / 10:.2f} robot {t / 10:.2f}\n" for t in range(25)]
        (tmp_path / "still.log").write_text("".join(lines) + end)

    return write
