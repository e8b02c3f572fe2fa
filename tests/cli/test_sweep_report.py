import json
from pathlib import Path

import pytest

from contourslam.cli import main

pytest.importorskip("pyarrow")
pytest.importorskip("scipy")

EXPERIMENT = "name = 'tiny'\n"


def results(folder: Path, count: int = 6) -> Path:
    """What a sweep of two detectors leaves that is half done."""
    from contourslam.experiments.sweep.rows import table_of

    rows = [
        {
            "key": f"{i:032x}", "status": "done", "source": "simulation", "room": "furnished_room", "seed": i // 2,
            "lidar": "paper", "noise": 0.01, "beams": 500, "duration": 60.0, "speed": 0.4, "setting": "corners",
            "detector": ("wu", "teh_chin")[i % 2], "version": "0.1.0+abc", "rmse.x": 0.01 + 0.001 * i, "rmse.y": 0.01,
        }
        for i in range(count)
    ]  # fmt: skip
    from pyarrow import parquet

    folder.mkdir()
    if rows:
        parquet.write_table(table_of(rows), folder / "results.parquet")
    keys = [f"{i:032x}" for i in range(2 * count)] or ["0" * 32]
    (folder / "experiment.json").write_text(json.dumps({"name": "tiny", "text": EXPERIMENT, "keys": keys}))
    return folder


def test_it_writes_the_report_and_says_what_can_be_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    there, out, document = results(tmp_path / "there"), tmp_path / "out", tmp_path / "doc.md"
    assert main(["sweep-report", str(there), "-o", str(out), "--markdown", str(document)]) == 0
    said, note = capsys.readouterr()
    assert "6 of 12 runs are missing; go on with the same `contourslam sweep` command" in note
    assert "No detector is shown to be better" in said and f"report: {out / 'index.html'}" in said
    assert EXPERIMENT.strip() in document.read_text() and "INCOMPLETE: 6 runs" in (out / "index.html").read_text()


def test_json_is_the_file_of_metrics(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    there, out = results(tmp_path / "there"), tmp_path / "out"
    assert main(["sweep-report", str(there), "-o", str(out), "--metric", "x", "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed == json.loads((out / "metrics.json").read_text())
    assert (printed["metrics"], printed["runs"], printed["expected"]) == (["x"], 6, 12)


def test_without_two_detectors_no_heading_stands_above_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["sweep-report", str(results(tmp_path / "there", 1)), "-o", str(tmp_path / "out")]) == 0
    said = capsys.readouterr().out
    assert "no two detectors can be compared" in said and "by the" not in said


def test_several_results_are_reported_as_one(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folders = [str(results(tmp_path / name)) for name in ("one", "other")]
    assert main(["sweep-report", *folders, "-o", str(tmp_path / "out"), "--json"]) == 0
    assert (said := json.loads(capsys.readouterr().out))["runs"] == 6  # the same runs, once
    assert said["expected"] == 12


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["nothing", "-o", "out"], "holds no results of a sweep"),
        (["empty", "-o", "out"], "no run is done yet"),
        (["damaged", "-o", "out"], "damaged/experiment.json: is none of a sweep"),
        (["there", "-o", "out", "--metric", "positoin"], "position"),
        (["there", "-o", "there", "--overwrite"], "choose another folder"),
        (["there", "-o", "there/report"], "is in the results there"),
        (["there", "-o", "out", "--markdown", "full/mine/a.md"], "full/mine/a.md: cannot be written"),
        (["there", "-o", "out", "--markdown", "full"], "full: is a folder"),
        (["there", "-o", "full"], "is not empty"),
    ],
)
def test_what_cannot_be_reported_is_said_in_a_line(
    arguments: list[str], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    results(tmp_path / "there")
    results(tmp_path / "empty", 0)
    (results(tmp_path / "damaged") / "experiment.json").write_text("[1]")
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "mine").write_text("")
    assert main(["sweep-report", *arguments]) == 1
    complaint = capsys.readouterr().err
    assert said in complaint and complaint.count("\n") == 1
