import base64
import re
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import matplotlib
import numpy as np
import pytest

from contourslam.config import Config
from contourslam.evaluation.metrics import run_metrics
from contourslam.evaluation.relations import JudgedRelations, judge
from contourslam.geometry.poses import between
from contourslam.report.figures.series import matching_figure, relation_figure
from contourslam.report.figures.way import error_map_figure, map_figure, poses_at
from contourslam.report.page.album import embedded
from contourslam.report.run_page import write_run_page
from contourslam.report.scan_table import EMPTY_CORNERS, EMPTY_WALLS
from contourslam.slam.result import RunResult

Make = Callable[..., RunResult]


def judged(run: RunResult, gap: int = 20) -> JudgedRelations:
    """Hold the run against relations made from its true poses."""
    assert run.truth is not None
    stamps = np.stack([run.stamps[:-gap], run.stamps[gap:]], axis=-1)
    return judge(run, stamps, between(run.truth[:-gap], run.truth[gap:]))


def write(folder: Path, run: RunResult, relations: JudgedRelations | None = None, **more: str) -> str:
    command = more.pop("command", "contourslam run a.log <&>")
    metrics = {**run_metrics(run, relations=relations), **more}
    assert write_run_page(folder, run, Config(), metrics, relations, command=command, name="a.log <&>") == ()
    return (folder / "index.html").read_text()


@pytest.fixture(scope="module")
def full(tmp_path_factory: pytest.TempPathFactory, make_graph_run: Make) -> Path:
    """The page of a run that has all there is."""
    folder = tmp_path_factory.mktemp("run")
    run = make_graph_run(loops=40)
    write(folder, run, judged(run), back_end_reason="the log is long")
    return folder


def sections(text: str) -> list[str]:
    return re.findall(r'<h2 id="([a-z]+)">', text)


def test_a_run_with_everything_has_every_section(full: Path) -> None:
    text = (full / "index.html").read_text()
    assert sections(text) == ["map", "relations", "truth", "matching", "loops", "timings", "reproduce"]
    assert "by the graph back end (the log is long); 40 loops closed." in text
    assert "online, as known at the time" in text
    assert "contourslam run a.log &lt;&amp;&gt;" in text


def test_the_page_is_one_file_accessible_and_refers_to_nothing_outside(full: Path, parsed) -> None:
    assert {path.name for path in full.iterdir()} == {"index.html", "relation_errors.csv"}
    text = (full / "index.html").read_text()
    page = parsed(text)
    assert not re.search(r"https?://|//cdn|@import|url\(", text)
    assert page.all("script") == []
    ids = [attributes["id"] for _, attributes in page.tags if "id" in attributes]
    assert len(ids) == len(set(ids))
    assert all(link["href"][1:] in ids for link in page.all("a"))
    images = page.all("img")
    assert len(images) == 5
    for image in images:
        assert len(image["alt"]) > 15
        assert int(image["width"]) > 0
        svg = base64.b64decode(image["src"].removeprefix("data:image/svg+xml;base64,")).decode()
        assert all(link.startswith(("#", "data:")) for link in re.findall(r'(?:href|src)="([^"]*)"', svg))
    assert all(header.get("scope") in ("row", "col") for header in page.all("th"))
    assert len(page.all("caption")) == len(page.all("table"))


def test_what_a_run_does_not_have_is_left_out(tmp_path: Path, make_run: Make) -> None:
    run = replace(make_run(), truth=None, seconds={}, nis_dof=np.zeros(300, dtype=np.int64))
    text = write(tmp_path, run)
    assert sections(text) == ["map", "reproduce"]
    assert "by the EKF back end." in text
    assert not (tmp_path / "relation_errors.csv").exists()


def test_an_earlier_runs_relations_do_not_stay(tmp_path: Path, make_run: Make) -> None:
    (tmp_path / "relation_errors.csv").write_text("an earlier run's")
    assert "INCOMPLETE" in write(tmp_path, make_run(complete=False))
    assert not (tmp_path / "relation_errors.csv").exists()


def test_the_relation_errors_stand_beside_each_other(full: Path, make_graph_run: Make) -> None:
    found = judged(make_graph_run(loops=40))
    text = (full / "index.html").read_text()
    assert "INCOMPLETE" not in text
    table = np.genfromtxt(full / "relation_errors.csv", delimiter=",", names=True)
    np.testing.assert_array_equal(table["later_stamp"], found.stamps[:, 1])
    np.testing.assert_allclose(table["translation"], found.estimate.translation, rtol=1e-5)
    assert found.online is not None
    np.testing.assert_allclose(table["online_rotation"], found.online.rotation, rtol=1e-5)
    np.testing.assert_allclose(table["odometry_translation"], found.odometry.translation, rtol=1e-5)
    for errors in (found.estimate, found.online, found.odometry):
        assert f"<td>{errors.translation.mean():.4f} m</td>" in text
        assert f"<td>{np.degrees(errors.rotation.mean()):.2f}°</td>" in text


def test_the_largest_loops_come_first_and_the_table_ends_at_thirty(full: Path, make_graph_run: Make) -> None:
    text = (full / "index.html").read_text()
    part = text[text.index('id="loops"') : text.index('id="timings"')]
    rows = re.findall(r'<th scope="row">(\d+:\d\d) → (\d+:\d\d)</th><td>([\d.]+) m</td><td>(-?[\d.]+)°</td>', part)
    assert len(rows) == 30
    shifts = [float(row[2]) for row in rows]
    assert shifts == sorted(shifts, reverse=True)
    first = make_graph_run(loops=40).loops[0]
    assert shifts[0] == pytest.approx(np.hypot(*first.shift[:2]), abs=1e-4)
    assert float(rows[0][3]) == pytest.approx(np.degrees(first.shift[2]), abs=0.01)
    assert "The 30 of 40 closed loops" in part


def test_a_single_scan_has_its_page(tmp_path: Path, make_graph_run: Make) -> None:
    run = make_graph_run(scans=3)
    fields = ("stamps", "poses", "covariances", "odometry", "nis", "nis_dof", "truth", "online_poses", "quality")
    counts = ("matched_count", "corner_count", "wall_count")
    cut = replace(
        run,
        **{name: getattr(run, name)[:1] for name in (*fields, *counts)},
        corner_map=EMPTY_CORNERS,
        wall_map=EMPTY_WALLS,
    )
    assert "1 scan over" in write(tmp_path, cut)


def test_a_poor_clock_and_gaps_in_the_truth_are_drawn(tmp_path: Path, make_graph_run: Make) -> None:
    run = make_graph_run()
    stamps = run.stamps.copy()
    stamps[100:110] = stamps[90]  # repeated and backwards
    truth = run.truth.copy()
    truth[::3] = np.nan
    assert sections(write(tmp_path, replace(run, stamps=stamps, truth=truth), judged(run)))[1:3] == [
        "relations",
        "truth",
    ]


def test_a_robot_that_stood_still_without_error_is_drawn(make_graph_run: Make) -> None:
    run = make_graph_run()
    still = replace(run, poses=np.zeros_like(run.poses), corner_map=EMPTY_CORNERS, wall_map=EMPTY_WALLS)
    for figure in (map_figure(still), error_map_figure(still, run.stamps[:9], np.zeros(9))):
        assert embedded(figure, alt="", caption="").height >= 300


def test_a_loop_is_drawn_from_pose_to_pose(make_graph_run: Make) -> None:
    run = make_graph_run(loops=3)
    axes = map_figure(run).axes[0]
    lines = next(found for found in axes.collections if len(found.get_colors()) == 3 and hasattr(found, "get_segments"))
    wanted = {
        (
            tuple(run.poses[run.stamps == loop.earlier_stamp][0, :2]),
            tuple(run.poses[run.stamps == loop.later_stamp][0, :2]),
        )
        for loop in run.loops
    }
    assert {(tuple(a), tuple(b)) for a, b in lines.get_segments()} == wanted
    assert len({tuple(colour) for colour in lines.get_colors()}) == 3  # three shifts, three colours


def test_a_pose_is_looked_up_at_the_nearest_stamp_of_a_clock_that_runs_backwards(make_run: Make) -> None:
    run = make_run(scans=5)
    run = replace(run, stamps=np.array([10.0, 12.0, 11.0, 13.0, 14.0]))
    found = poses_at(run, np.array([9.0, 11.2, 12.4, 99.0]))
    np.testing.assert_array_equal(found, run.poses[[0, 2, 1, 4]])


def test_errors_lie_where_the_robot_was_and_the_largest_is_on_top(make_run: Make) -> None:
    run = make_run()
    errors = np.linspace(0.5, 0.001, 50)
    axes = error_map_figure(run, run.stamps[:50], errors).axes[0]
    dots = next(found for found in axes.collections if isinstance(found, matplotlib.collections.PathCollection))
    np.testing.assert_array_equal(dots.get_offsets()[-1], run.poses[0, :2])


def test_medians_over_time_are_drawn_on_a_logarithmic_scale() -> None:
    times = np.arange(600.0)
    axes = relation_figure(times, {"estimate": np.full(600, 0.02), "raw odometry": np.zeros(600)}).axes[0]
    assert axes.get_yscale() == "log"
    lines = {line.get_label(): line for line in axes.get_lines()}
    np.testing.assert_allclose(lines["estimate"].get_ydata(), 0.02)
    np.testing.assert_allclose(lines["raw odometry"].get_ydata(), 0.001)  # a logarithm knows no zero


def test_quality_and_innovation_have_a_panel_each_where_they_are_known(make_run: Make, make_graph_run: Make) -> None:
    assert len(matching_figure(make_graph_run()).axes) == 2
    assert len(matching_figure(make_run()).axes) == 1
    unmatched = replace(make_graph_run(), nis_dof=np.zeros(300, dtype=np.int64))
    assert [axes.get_ylabel() for axes in matching_figure(unmatched).axes] == ["matching quality"]


def test_without_matplotlib_the_page_is_left_out_and_the_errors_kept(
    tmp_path: Path, make_run: Make, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = make_run()
    (tmp_path / "index.html").write_text("an earlier run's")
    drawing = ("contourslam.report.figures", "contourslam.report.page.run")
    for name in [name for name in sys.modules if name.startswith(drawing)]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    (note,) = write_run_page(tmp_path, run, Config(), run_metrics(run), judged(run))
    assert "contourslam[report]" in note
    assert {path.name for path in tmp_path.iterdir()} == {"relation_errors.csv"}


def test_a_long_run_has_its_page_within_seconds_and_a_megabyte(tmp_path: Path, make_graph_run: Make) -> None:
    run = make_graph_run(scans=10_000, loops=300)
    found = judged(run)
    begin = time.process_time()
    write(tmp_path, run, found)
    assert time.process_time() - begin < 10.0  # measured: about 2.5
    assert (tmp_path / "index.html").stat().st_size < 1_000_000


def test_the_same_figure_gives_the_same_bytes(make_graph_run: Make) -> None:
    first, second = (embedded(map_figure(make_graph_run(scans=40)), alt="", caption="") for _ in range(2))
    assert first == second


def test_a_real_browser_shows_the_page_and_asks_for_nothing(full: Path, browse, parsed) -> None:
    images = len(parsed((full / "index.html").read_text()).all("img"))
    for width in (360, 1280):
        seen = browse(full / "index.html", width=width)
        assert seen["data-broken"] == ""
        assert "data-errors" not in seen
        assert int(seen["data-images"]) == images
        assert int(seen["data-overflow"]) <= 0
        assert all(request.startswith("data:") for request in seen["data-requests"].split())
