import errno
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from contourslam.cli import main
from contourslam.nearest import near_file, no_such, perhaps, unreadable

DETECTORS = ["matched_filter", "wu", "teh_chin", "curvature_scale_space"]


@pytest.mark.parametrize(
    ("slip", "meant"),
    [("matched_filtr", "matched_filter"), ("TEH-CHIN", "teh_chin"), ("wuu", "wu"), ("curvature_scale", DETECTORS[3])],
)
def test_a_slip_of_the_keyboard_leads_to_what_was_meant(slip: str, meant: str) -> None:
    assert perhaps(slip, DETECTORS) == f"; did you mean {meant}?"
    assert no_such("detector", slip, DETECTORS).endswith(f"mean {meant}?; choose one of {', '.join(DETECTORS)}")


def test_what_is_like_nothing_there_is_suggested_nothing() -> None:
    assert perhaps("hough", DETECTORS) == ""
    assert perhaps("wu", []) == ""


@given(st.text(), st.lists(st.text(), max_size=5))
def test_only_what_is_there_is_suggested(name: str, choices: list[str]) -> None:
    said = perhaps(name, choices)
    assert not said or said.removeprefix("; did you mean ").removesuffix("?") in choices


def test_a_file_that_is_not_there_is_looked_for_where_its_path_breaks_off(tmp_path: Path) -> None:
    (tmp_path / "recordings").mkdir()
    (tmp_path / "recordings" / "intel.log.xz").touch()
    meant = tmp_path / "recordings" / "intel.log.xz"
    assert near_file(tmp_path / "recordings" / "intel.log.gz") == f"; did you mean {meant}?"
    assert near_file(tmp_path / "recording" / "intel.log.xz") == f"; did you mean {tmp_path / 'recordings'}?"
    assert near_file(tmp_path / "elsewhere.bag") == ""
    assert near_file(meant) == ""
    assert near_file(meant / "below_a_file") == ""


def test_a_file_that_may_not_be_read_is_no_slip(tmp_path: Path) -> None:
    (tmp_path / "map.cmap").touch()
    error = PermissionError(errno.EACCES, "Permission denied")
    assert unreadable(tmp_path / "map.cmap", error) == f"{tmp_path / 'map.cmap'}: cannot be read (Permission denied)"


def test_the_commands_suggest_the_nearest_command_file_and_detector(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("drive.bag").touch()
    for words, meant in (
        (["rnu", "drive.bag"], "did you mean run?"),
        (["info", "drve.bag"], "did you mean drive.bag?"),
        (["run", "drive.bag", "-o", "out", "--detector", "teh-chin"], "did you mean teh_chin?"),
    ):
        assert main(words) in (1, 2)
        assert meant in capsys.readouterr().err
