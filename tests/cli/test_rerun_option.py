import os
import signal
import subprocess
import sys
import warnings
from collections.abc import Callable
from pathlib import Path

import pytest

from contourslam.cli import main
from contourslam.recordings.carmen import CarmenRecording

Failure = Callable[..., str]
REAL = CarmenRecording.messages
needs_rerun = pytest.mark.skipif("not __import__('importlib').util.find_spec('rerun')", reason="no rerun-sdk")


def scans(path: Path) -> int:
    """How many scans a file holds."""
    from rerun.chunk import RrdReader

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = [c for c in RrdReader(str(path)).stream() if c.entity_path.startswith("/plots/sigma/")]
    return sum(c.num_rows for c in found if not c.is_static)


@needs_rerun
def test_a_run_logs_every_scan(log: Path, tmp_path: Path) -> None:
    file = tmp_path / "folder" / "run.rrd"
    assert main(["run", str(log), "-o", str(tmp_path / "out"), "--rerun", str(file), "--max-scans", "30"]) == 0
    assert scans(file) == 30
    assert (tmp_path / "out" / "index.html").is_file()


@needs_rerun
def test_ctrl_c_leaves_a_file_that_opens(log: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def messages(self: CarmenRecording):
        for i, message in enumerate(REAL(self)):
            if i == 80:
                os.kill(os.getpid(), signal.SIGINT)
            yield message

    monkeypatch.setattr(CarmenRecording, "messages", messages)
    file = tmp_path / "run.rrd"
    assert main(["run", str(log), "-o", str(tmp_path / "out"), "--rerun", str(file)]) == 130
    assert 20 < scans(file) < 60
    done = subprocess.run([sys.executable, "-m", "rerun", "rrd", "verify", str(file)], check=False)
    assert done.returncode == 0


@needs_rerun
def test_a_file_that_is_there_is_kept(log: Path, tmp_path: Path, failure: Failure) -> None:
    file = tmp_path / "mine.rrd"
    file.write_text("mine")
    assert "--overwrite" in failure("run", log, "-o", tmp_path / "out", "--rerun", file)
    assert "--overwrite" in failure("view", log, "--rerun", file)
    assert file.read_text() == "mine"


@needs_rerun
def test_an_earlier_file_is_taken_away_only_once_all_else_works(log: Path, tmp_path: Path, failure: Failure) -> None:
    file = tmp_path / "mine.rrd"
    file.write_text("mine")
    again = ("view", log, "--rerun", file, "--overwrite")
    assert "each once" in failure(*again, "--detectors", "wu,wu")
    assert "cannot be served" in failure(*again, "--host", "203.0.113.7", "--port", "0")
    assert file.read_text() == "mine"


@needs_rerun
def test_a_file_that_fails_costs_nothing_of_the_run(
    log: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    import rerun as rr

    def refuse(self: rr.RecordingStream, *values: object, **named: object) -> None:
        raise ValueError("nobody foresaw this")

    monkeypatch.setattr(rr.RecordingStream, "send_columns", refuse)
    out, file = tmp_path / "out", tmp_path / "x.rrd"
    assert main(["run", str(log), "-o", str(out), "--rerun", str(file), "--max-scans", "10"]) == 1
    assert (out / "index.html").is_file() and (out / "map.cmap").is_file()
    said = capsys.readouterr()
    assert "x.rrd: ends early" in said.err and "10 scans" in said.out


@needs_rerun
def test_a_page_whose_file_fails_ends_with_code_1(
    log: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from contourslam.view.rerun_log import RerunLog

    def refuse(self: RerunLog, *values: object) -> None:
        os.kill(os.getpid(), signal.SIGINT)  # who watches has seen enough
        raise ValueError("nobody foresaw this")

    monkeypatch.setattr(RerunLog, "add", refuse)
    assert main(["view", str(log), "--port", "0", "--rerun", str(tmp_path / "x.rrd")]) == 1
    assert "nobody foresaw this" in capsys.readouterr().err


def test_without_its_library_the_extra_is_named(
    log: Path, tmp_path: Path, failure: Failure, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in [name for name in sys.modules if name.partition(".")[0] == "rerun" or "view.rerun_" in name]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "rerun", None)
    said = failure("run", log, "-o", tmp_path / "out", "--rerun", tmp_path / "x.rrd")
    assert "pip install 'contourslam[rerun]'" in said
