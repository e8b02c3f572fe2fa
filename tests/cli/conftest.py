"""A small CARMEN log, drawn by hand, so that the command line is tested without the simulator."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from contourslam.cli import main

BEAMS = 180
WALLS = np.array(
    [
        [[0.0, 0.0], [6.0, 0.0]],
        [[6.0, 0.0], [6.0, 5.0]],
        [[6.0, 5.0], [0.0, 5.0]],
        [[0.0, 5.0], [0.0, 0.0]],
        [[4.0, 2.0], [5.0, 2.0]],
        [[4.0, 2.0], [4.0, 2.8]],
        [[4.0, 2.8], [5.0, 2.8]],
        [[5.0, 2.0], [5.0, 2.8]],
    ]
)


def cast(pose: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    angles = pose[2] + np.deg2rad(np.arange(BEAMS) - 90.0)
    beams = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    begin, side = WALLS[:, 0] - pose[:2], WALLS[:, 1] - WALLS[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        determinant = beams[:, None, 0] * side[:, 1] - beams[:, None, 1] * side[:, 0]
        ranges = (begin[:, 0] * side[:, 1] - begin[:, 1] * side[:, 0]) / determinant
        along = (begin[:, 0] * beams[:, None, 1] - begin[:, 1] * beams[:, None, 0]) / determinant
        ranges[(along < 0.0) | (along > 1.0) | (ranges <= 0.0) | ~np.isfinite(ranges)] = np.inf
    return ranges.min(axis=1) + rng.normal(0.0, 0.01, BEAMS)


def log_lines(scans: int) -> list[str]:
    """Lines of a log: the robot drives a circle, its odometry drifts a little."""
    rng = np.random.default_rng(5)
    lines = []
    for i in range(scans):
        turn = 0.05 * i
        pose = np.array([2.0 + 0.8 * np.sin(turn), 1.7 + 0.8 * (1.0 - np.cos(turn)), turn])
        odometry = np.array([0.81 * np.sin(1.01 * turn), 0.81 * (1.0 - np.cos(1.01 * turn)), 1.01 * turn])
        ranges = " ".join(f"{r:.3f}" for r in cast(pose, rng))
        at = " ".join(f"{value:.6f}" for value in odometry)
        stamp = f"{100.0 + 0.2 * i:.3f} host {0.2 * i:.3f}"
        lines.append(f"FLASER {BEAMS} {ranges} {at} {at} {stamp}\n")
    return lines


@pytest.fixture(scope="session")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("logs") / "circle.log"
    path.write_text("".join(log_lines(60)))
    return path


@pytest.fixture(scope="session")
def mapped(log: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The result folder of a run over the log."""
    folder = tmp_path_factory.mktemp("results") / "circle"
    assert main(["run", str(log), "-o", str(folder)]) == 0
    return folder


@pytest.fixture
def failure(capsys: pytest.CaptureFixture[str]) -> Callable[..., str]:
    """Run a command that must fail with the given code and one line on standard error; give that line."""

    def run(*arguments: object, code: int = 1) -> str:
        capsys.readouterr()
        assert main([str(argument) for argument in arguments]) == code
        said = capsys.readouterr().err.strip().splitlines()
        assert len(said) == 1, said
        assert said[0].startswith("contourslam: error: ")
        return said[0]

    return run
