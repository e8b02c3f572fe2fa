import json
from collections.abc import Callable
from pathlib import Path

import pytest

from contourslam.cli import main
from contourslam.detectors import DETECTORS

Failure = Callable[..., str]


@pytest.mark.parametrize("detector", DETECTORS)
def test_detect_draws_the_scan_and_finds_the_corners_of_the_room(
    detector: str, log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    picture = tmp_path / "scan.png"
    arguments = ["detect", str(log), "-o", str(picture), "--scan", "3", "--detector", detector, "--json"]
    assert main(arguments) == 0
    assert picture.read_bytes().startswith(b"\x89PNG")
    found = json.loads(capsys.readouterr().out)
    assert found["stamp"] == pytest.approx(100.6)
    assert found["beams"] == 180
    assert 1 <= len(found["corners"]["positions"]) <= 4
    assert len(found["walls"]["end_points"]) >= 3


def test_detect_says_in_words_what_it_found(log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["detect", str(log), "-o", str(tmp_path / "scan.svg")]) == 0
    assert "180 beams" in capsys.readouterr().out
    assert (tmp_path / "scan.svg").read_text().startswith("<?xml")


def test_a_scan_beyond_the_last_says_how_many_there_are(failure: Failure, log: Path, tmp_path: Path) -> None:
    assert "has 60 scans" in failure("detect", log, "-o", tmp_path / "scan.png", "--scan", "60")


@pytest.mark.parametrize("number", ["-1"])
def test_a_negative_scan_is_refused(number: str, failure: Failure, log: Path, tmp_path: Path) -> None:
    assert "counts from 0" in failure("detect", log, "-o", tmp_path / "scan.png", "--scan", number)


def test_a_picture_of_another_kind_is_refused(failure: Failure, log: Path, tmp_path: Path) -> None:
    assert ".png or .svg" in failure("detect", log, "-o", tmp_path / "scan.bmp")


def test_a_picture_that_is_there_is_kept(failure: Failure, log: Path, tmp_path: Path) -> None:
    (tmp_path / "scan.png").write_text("mine")
    assert "--overwrite" in failure("detect", log, "-o", tmp_path / "scan.png")
    assert (tmp_path / "scan.png").read_text() == "mine"
