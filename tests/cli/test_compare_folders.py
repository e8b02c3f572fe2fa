import json
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from contourslam.cli import main

Failure = Callable[..., str]


@pytest.fixture(scope="module")
def other(mapped: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Another run of the recording."""
    folder = tmp_path_factory.mktemp("other") / "again"
    shutil.copytree(mapped, folder)
    return folder


def test_runs_of_a_recording_are_compared_by_relations_they_are_given(
    mapped: Path, other: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    relations = tmp_path / "truth.relations"
    row = f"{0.8 * np.sin(2.5)} {0.8 * (1 - np.cos(2.5))} 0 0 0 2.5\n"
    relations.write_text("".join(f"{100 + begin} {110 + begin} {row}" for begin in (0.0, 0.2, 0.4)))
    out = tmp_path / "out"
    assert main(["compare", str(mapped), str(other), "--relations", str(relations), "-o", str(out), "--json"]) == 0
    metrics = json.loads(capsys.readouterr().out)
    assert metrics == json.loads((out / "metrics.json").read_text())
    (recording,) = metrics["recordings"].values()
    assert list(metrics["recordings"]) == ["circle.log"]
    assert recording["runs"] == ["circle", "again"]
    assert recording["pairs"][0]["difference"]["mean"] == 0.0
    assert recording["apart"]["again"]["position"]["max"] < 1e-12
    assert (out / "index.html").is_file()
    assert {path.stem for path in (out / "figures").glob("*.pdf")} == {
        "trajectories", "differences", "maps", "relation_errors", "relation_turns",
    }  # fmt: skip


def test_options_of_the_simulated_comparison_are_refused_for_folders(
    failure: Failure, mapped: Path, other: Path, tmp_path: Path
) -> None:
    for option in (["--seeds", "10"], ["--room", "large_hall"], ["--sigma-range", "0.02"], ["--no_details"]):
        said = failure("compare", mapped, other, "-o", tmp_path / "x", *option)
        assert option[0].replace("_", "-") in said
        assert "folders" in said
    assert "name those" in failure("compare", "-o", tmp_path / "x", "--truth", "truth.tum")
    assert not (tmp_path / "x").exists()


@pytest.mark.parametrize("command", ["compare", "figures"])
def test_a_run_is_never_overwritten_by_what_is_made_of_it(
    failure: Failure, mapped: Path, tmp_path: Path, command: str
) -> None:
    before = (mapped / "metrics.json").read_bytes()
    assert "one of the runs itself" in failure(command, mapped, "-o", mapped, "--overwrite")
    assert (mapped / "metrics.json").read_bytes() == before


def test_a_folder_that_is_none_is_named_and_nothing_is_written(failure: Failure, mapped: Path, tmp_path: Path) -> None:
    empty = tmp_path / "empty"
    empty.mkdir()
    assert f"{empty}: is no result folder" in failure("compare", mapped, empty, "-o", tmp_path / "x")
    assert "twice" in failure("figures", mapped, mapped, "-o", tmp_path / "x")
    assert not (tmp_path / "x").exists()


def test_a_width_that_no_page_has_is_refused(failure: Failure, mapped: Path, tmp_path: Path) -> None:
    for width in ("broad", "0.2", "nan"):
        assert "--width must be" in failure("figures", mapped, "-o", tmp_path / "x", "--width", width)
