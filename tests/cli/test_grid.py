from collections.abc import Callable
from pathlib import Path
from shutil import copytree

import pytest

from contourslam.cli import main

Failure = Callable[..., str]


def test_a_grid_asked_for_later_is_the_one_of_the_run(
    log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["run", str(log), "-o", str(tmp_path / "at_once"), "--grid"]) == 0
    assert main(["run", str(log), "-o", str(tmp_path / "later")]) == 0
    assert not (tmp_path / "later" / "map.pgm").exists()
    capsys.readouterr()
    assert main(["grid", str(tmp_path / "later"), str(log)]) == 0
    for name in ("map.pgm", "map.yaml"):
        assert (tmp_path / "later" / name).read_bytes() == (tmp_path / "at_once" / name).read_bytes()
    assert "cells of 0.05 m" in capsys.readouterr().out


def test_the_grid_of_a_damaged_recording_shows_what_came_before(failure: Failure, log: Path, tmp_path: Path) -> None:
    cut, out = tmp_path / "cut.log", tmp_path / "out"
    content = log.read_bytes()
    cut.write_bytes(content[: len(content) // 2])
    failure("run", cut, "-o", out)
    assert "cut short" in failure("grid", out, cut)
    assert (out / "map.pgm").stat().st_size > 10_000


def test_another_recording_is_recognised(failure: Failure, log: Path, mapped: Path, tmp_path: Path) -> None:
    other, folder = tmp_path / "other.log", tmp_path / "out"
    lines = [line.rsplit(maxsplit=3) for line in log.read_text().splitlines()]
    other.write_text(
        "".join(f"{head} {float(stamp) + 1000.0} {host} {logged}\n" for head, stamp, host, logged in lines)
    )
    copytree(mapped, folder)
    assert "another recording" in failure("grid", folder, other)
    assert not (folder / "map.pgm").exists()


def test_a_cell_without_size_is_refused(failure: Failure, log: Path, mapped: Path) -> None:
    assert "positive" in failure("grid", mapped, log, "--resolution", "0")
