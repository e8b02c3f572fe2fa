import csv
import json
import re
from pathlib import Path
from typing import Any

import pytest

from contourslam.errors import ResultError
from contourslam.report.sweep.markdown import write_markdown
from contourslam.report.sweep.measures import MEASURES
from contourslam.report.sweep.page import write_sweep_report
from contourslam.report.sweep.parts import Parts
from contourslam.report.sweep.reading import sweep_of

pytest.importorskip("scipy")
POSITION = [MEASURES["position"]]


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory, sweep_rows, log_rows) -> Path:
    """A report in which the matched filter is better by a fifth, and two of its runs failed."""
    folder = tmp_path_factory.mktemp("report")
    rows = sweep_rows((0.8, 1.0, 1.0, 1.0), seeds=16, failed=[("matched_filter", 3)])
    sweep = sweep_of([*rows, *log_rows], ["name = 'of & tests'"], expected=len(rows) + len(log_rows) + 7)
    write_sweep_report(folder, Parts(sweep, POSITION, "contourslam sweep-report out/sweep -o out/report"))
    return folder


def test_better_is_said_only_where_a_test_says_so(report: Path) -> None:
    metrics = json.loads((report / "metrics.json").read_text())
    (together,) = [line for line in metrics["findings"]["position"] if "2 rooms and 5 conditions together" in line]
    assert sum("over all its 5 conditions" in line for line in metrics["findings"]["position"]) == 2
    assert "Matched filter is better than" in together and together.count("better") == 1 and "16 seeds" in together
    assert {pair["better"] for pair in metrics["pairs"]["pairs_position_corners"]} == {"matched_filter", None}
    page = (report / "index.html").read_text()
    assert page.count('<td class="better left">matched filter is better') == sum(
        pair["better"] is not None for pairs in metrics["pairs"].values() for pair in pairs
    )


def test_failed_runs_are_shown_wherever_they_are_missing(report: Path) -> None:
    rows = list(csv.reader((report / "tables" / "table_one_corners.csv").read_text().splitlines()))
    assert any("1 failed" in row for row in rows)
    failures = (report / "tables" / "failures.csv").read_text()
    assert "MemoryError: no memory" in failures and "RecordingError" in failures
    assert "12 failed" in (report / "index.html").read_text()


def test_what_is_not_done_yet_is_said(report: Path) -> None:
    assert "INCOMPLETE: 7 runs are not done yet." in (report / "index.html").read_text()


def test_the_page_names_wheels_the_paper_recordings_and_the_experiment(report: Path) -> None:
    page = (report / "index.html").read_text()
    for text in ("furnished room, raw odometry", "The paper&#x27;s Table I", "intel, raw odometry", "of &amp; tests"):
        assert text in page
    assert "&lt;b&gt;cannot" in page and "<b>" not in page


def test_the_page_stands_alone_and_is_well_nested(report: Path, parsed: Any) -> None:
    page = parsed((report / "index.html").read_text())
    assert not page.all("img") and not page.all("link")[1:]
    assert len(page.all("figure")) == 4
    assert all(attributes.get("aria-label") for attributes in page.all("svg") if "role" in attributes)


def test_every_table_and_figure_is_a_file_too(report: Path) -> None:
    tables = {path.name for path in (report / "tables").iterdir()}
    assert {"table_one_corners.csv", "table_one_corners.tex", "pairs_position_corners.csv", "logs.tex"} <= tables
    assert len(list((report / "figures").glob("*.svg"))) == 4


def test_a_new_report_leaves_nothing_of_an_old_one(report: Path, sweep_rows, tmp_path: Path) -> None:
    for name in ("tables/pairs_walls.csv", "figures/noise_walls_room.svg", "tables/mine.csv"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text("")
    write_sweep_report(tmp_path, Parts(sweep_of(sweep_rows(seeds=2, conditions=[(0.01, 500)])), POSITION))
    left = {path.name for path in tmp_path.rglob("*") if path.is_file()}
    assert "mine.csv" in left and not {"pairs_walls.csv", "noise_walls_room.svg"} & left


def test_few_drives_of_one_detector_are_reported_without_a_claim(sweep_rows, tmp_path: Path) -> None:
    rows = [row for row in sweep_rows(seeds=2, conditions=[(0.01, 500)]) if row["detector"] == "wu"]
    metrics = write_sweep_report(tmp_path, Parts(sweep_of(rows), [MEASURES["heading"]]))
    assert all("better" not in line for line in metrics["findings"]["heading"])
    two = write_sweep_report(tmp_path, Parts(sweep_of(sweep_rows(seeds=2)), POSITION))
    assert "Too few seeds to show anything" in two["findings"]["position"][1]
    assert "too few to show anything: 2 seeds, of 6 that two detectors" in two["in_short"]["position"][1]
    page = (tmp_path / "index.html").read_text()
    assert "under 5\N{NO-BREAK SPACE}drives" not in page and "under 5 drives it gets no interval" in page
    assert "95\N{NO-BREAK SPACE}% interval</span>" not in page and "so none is drawn" in page


def test_by_several_metrics_each_is_tested_and_the_first_is_drawn(sweep_rows, tmp_path: Path) -> None:
    measures = [MEASURES["false_negatives"], *POSITION]
    metrics = write_sweep_report(tmp_path, Parts(sweep_of(sweep_rows((0.8, 1.0, 1.0, 1.0))), measures))
    assert any("is better" in line for line in metrics["findings"]["position"])
    assert not any("is better" in line for line in metrics["findings"]["false_negatives"])
    page = (tmp_path / "index.html").read_text()
    assert "by position better than" in page and "by false negatives better than" in page
    assert (tmp_path / "figures" / "noise_corners_furnished_room.svg").read_text().count("false-negative rate") == 1


def test_recordings_alone_are_reported(log_rows, tmp_path: Path) -> None:
    metrics = write_sweep_report(tmp_path, Parts(sweep_of(log_rows), POSITION))
    assert metrics["findings"] == {"position": []} and len(metrics["recordings"]) == 4
    assert "no interval, no test" in (tmp_path / "index.html").read_text()


def test_a_recording_is_judged_by_the_true_poses_that_it_holds(log_rows, tmp_path: Path) -> None:
    held = {"rmse.x": 0.03, "rmse.y": 0.04, "odometry_rmse.x": 0.3, "odometry_rmse.y": 0.4}
    truth = log_rows[0] | held | {"recording": "drive"}
    write_sweep_report(tmp_path, Parts(sweep_of([*log_rows, truth]), POSITION))
    rows = {row[0]: row[1:] for row in csv.reader((tmp_path / "tables" / "logs.csv").read_text().splitlines())}
    assert rows["recording, setting, detector"][0] == "position (cm)"
    assert rows["drive, graph, matched filter"][0] == "5.00" and rows["drive, raw odometry"][0] == "50.00"
    assert rows["intel, graph, Wu"][:3] == ["", "1.60", "6.0"]
    write_sweep_report(tmp_path, Parts(sweep_of(log_rows), POSITION))
    assert "position" not in (tmp_path / "tables" / "logs.csv").read_text()


def test_a_document_gets_the_report_in_its_places_and_keeps_its_words(sweep_rows, tmp_path: Path) -> None:
    sweep = sweep_of(sweep_rows())
    document = tmp_path / "table.md"
    document.write_text(
        "# Mine\n\n<!-- sweep:noise -->\nold\n<!-- /sweep:noise -->\n\nwords\n\n"
        "<!-- sweep:table-one -->\n<!-- /sweep:table-one -->\n"
    )
    files = write_markdown(document, Parts(sweep, POSITION))
    text = document.read_text()
    assert text.startswith("# Mine\n") and "\nwords\n" in text and "\nold\n" not in text
    assert "| furnished room, Wu |" in text and "Every cell" not in text
    pictures = re.findall(r'src="(pictures/[^"]+)"', text)
    assert sorted(files) == sorted([document, *(tmp_path / name for name in pictures)]) and len(pictures) == 2
    write_markdown(document, Parts(sweep, POSITION))
    assert document.read_text() == text


def test_without_a_document_all_of_the_report_is_written(sweep_rows, log_rows, tmp_path: Path) -> None:
    write_markdown(tmp_path / "new.md", Parts(sweep_of([*sweep_rows(), *log_rows]), POSITION, "contourslam x"))
    titles = re.findall(r"^## (.*)", (tmp_path / "new.md").read_text(), re.MULTILINE)
    assert titles[:2] == ["In short", "What can be said"] and titles[-1] == "Reproduce this" and len(titles) == 10


def test_a_place_for_what_was_not_run_says_so(log_rows, tmp_path: Path) -> None:
    (tmp_path / "a.md").write_text("<!-- sweep:noise -->\n<!-- /sweep:noise -->\n")
    write_markdown(tmp_path / "a.md", Parts(sweep_of(log_rows), POSITION))
    assert "Nothing of this was run." in (tmp_path / "a.md").read_text()


def test_a_document_with_no_place_or_an_unknown_one_is_refused(sweep_rows, tmp_path: Path) -> None:
    document, sweep = tmp_path / "a.md", sweep_of(sweep_rows(seeds=1))
    document.write_text("# Nothing\n")
    with pytest.raises(ResultError, match="has no place"):
        write_markdown(document, Parts(sweep, POSITION))
    document.write_text("<!-- sweep:noize -->\n<!-- /sweep:noize -->\n")
    with pytest.raises(ResultError, match="noize"):
        write_markdown(document, Parts(sweep, POSITION))
    assert "noize" in document.read_text()
