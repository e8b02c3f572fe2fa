import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from contourslam.cli import main
from contourslam.cli.info import Info

Failure = Callable[..., str]


def test_an_unknown_command_lists_the_commands(failure: Failure) -> None:
    said = failure("rnu", code=2)
    assert "'rnu'" in said
    assert "simulate, info, detect, run, view, grid, scene, evaluate, compare" in said


def test_no_command_at_all_is_wrong_usage(failure: Failure) -> None:
    assert "--help" in failure(code=2)


@pytest.mark.parametrize(
    "arguments",
    [
        ["run", "x.log", "-o", "out", "--no-such-option", "3"],
        ["run", "x.log"],
        ["run", "x.log", "-o", "out", "--min-points", "many"],
        ["run", "x.log", "-o", "out", "--association", "guess"],
    ],
)
def test_wrong_usage_is_2_and_says_what(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(arguments) == 2
    said = capsys.readouterr()
    assert "contourslam run --help" in said.out + said.err


def test_a_value_out_of_its_range_names_the_setting(failure: Failure) -> None:
    assert "min_points must be a positive number, got -1" in failure(
        "run", "x", "-o", "y", "--min-points", "-1", code=2
    )


def test_a_missing_recording_is_a_known_failure(failure: Failure, tmp_path: Path) -> None:
    assert "nothing.log" in failure("info", tmp_path / "nothing.log")


def test_a_file_that_is_no_recording_is_a_known_failure(failure: Failure, tmp_path: Path) -> None:
    path = tmp_path / "picture.bag"
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(range(256)))
    assert "picture.bag" in failure("info", path)


def test_an_unknown_failure_keeps_its_traceback(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(self: Info, command: str) -> int:
        raise ZeroDivisionError("a bug")

    monkeypatch.setattr(Info, "execute", broken)
    with pytest.raises(ZeroDivisionError, match="a bug"):
        main(["info", "x.log"])


def test_ctrl_c_where_there_is_nothing_to_keep_is_130(monkeypatch: pytest.MonkeyPatch, failure: Failure) -> None:
    def interrupted(self: Info, command: str) -> int:
        raise KeyboardInterrupt

    monkeypatch.setattr(Info, "execute", interrupted)
    assert "interrupted" in failure("info", "x.log", code=130)


def test_a_pipe_that_closes_early_is_no_traceback(log: Path) -> None:
    with subprocess.Popen(
        [sys.executable, "-m", "contourslam", "info", str(log)], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.close()
        assert b"Traceback" not in process.stderr.read()
