import json
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

pytest.importorskip("gtsam", reason="needs the extra 'graph', which makes maps with contours")

from contourslam.cli import main
from contourslam.cli.locate import UNSURE

Failure = Callable[..., str]
# Where the log's robot is at scan 50 in the frame of its map, which begins at its first pose: see the fixture `log`.
TURN = 0.05 * 50
TRUTH = (0.8 * np.sin(TURN), 0.8 * (1.0 - np.cos(TURN)), TURN)


@pytest.fixture
def kept(mapped: Path) -> str:
    return str(mapped / "map.cmap")


def test_a_scan_is_found_in_the_map_of_its_recording(log: Path, kept: str, capsys: pytest.CaptureFixture[str]) -> None:
    capsys.readouterr()
    code = main(["locate", str(log), "--map", kept, "--scan", "50", "--json"])
    found = json.loads(capsys.readouterr().out)
    np.testing.assert_allclose(found["pose"], TRUTH, atol=0.06)
    assert found["stamp"] == pytest.approx(110.0)
    assert found["probability"] > 0.5
    assert np.linalg.eigvalsh(found["covariance"]).min() > 0.0
    assert code == (0 if found["confident"] else UNSURE)


def test_several_scans_are_found_together_and_the_time_names_the_first(
    log: Path, kept: str, capsys: pytest.CaptureFixture[str]
) -> None:
    capsys.readouterr()
    assert main(["locate", str(log), "--map", kept, "--at", "2", "--scans", "41", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    np.testing.assert_allclose(found["pose"], TRUTH, atol=0.06)
    assert found["confident"]


def test_the_picture_holds_map_scan_and_robot(
    log: Path, kept: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], failure: Failure
) -> None:
    picture = tmp_path / "place.svg"
    words = ["locate", str(log), "--map", kept, "--scan", "50", "--picture", str(picture)]
    assert main(words) in (0, UNSURE)
    said = capsys.readouterr().out
    assert "pose:         x 0.4" in said
    assert "probability:" in said
    text = picture.read_text()
    ElementTree.fromstring(text)
    assert "scan</text>" in text
    assert "is there already" in failure(*words)


def test_a_scan_of_another_building_ends_in_its_own_exit_code(
    kept: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    strange = tmp_path / "strange.log"
    angles = np.deg2rad(np.arange(180) - 90.0)
    ranges = " ".join(f"{r:.3f}" for r in 4.0 + 1.5 * np.sin(7.0 * angles))
    strange.write_text(f"FLASER 180 {ranges} 0 0 0 0 0 0 1.0 host 0.0\n")
    assert main(["locate", str(strange), "--map", kept]) == UNSURE
    assert "not sure" in (said := capsys.readouterr().out) or "found nowhere" in said


@pytest.mark.parametrize(
    ("words", "what"),
    [
        (["--scan", "500"], "has 60 scans, there is none of number 500"),
        (["--at", "99"], "there is none at 99.0 s"),
        (["--scan", "50", "--scans", "20"], "has 10 scans from the one of number 50 on"),
    ],
)
def test_a_scan_that_is_not_there_is_a_known_failure(
    log: Path, kept: str, failure: Failure, words: list[str], what: str
) -> None:
    assert what in failure("locate", log, "--map", kept, *words)


@pytest.mark.parametrize("words", [["--scan", "1", "--at", "2"], ["--scan", "-1"], ["--scans", "0"]])
def test_a_choice_of_scans_that_makes_no_sense_is_said(
    log: Path, kept: str, failure: Failure, words: list[str]
) -> None:
    assert "--scan" in failure("locate", log, "--map", kept, *words)


def test_a_file_that_is_no_map_is_a_known_failure(log: Path, failure: Failure) -> None:
    assert str(log) in failure("locate", log, "--map", log)
