import re
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from contourslam.config import Config
from contourslam.evaluation.metrics import run_metrics
from contourslam.evaluation.relations import JudgedRelations, judge
from contourslam.geometry.poses import between
from contourslam.report.page.run.values import degrees
from contourslam.report.run_page import write_run_page
from contourslam.report.scan_table import EMPTY_CORNERS, EMPTY_WALLS
from contourslam.report.svg.axes import Axes
from contourslam.report.svg.colours import GREY, SHADES
from contourslam.report.svg.series import matching_drawing, relation_drawing
from contourslam.report.svg.ticks import ticks
from contourslam.report.svg.way import error_map_drawing, map_drawing, poses_at
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
    write_run_page(folder, run, Config(), metrics, relations, command=command, name="a.log <&>")
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
    name_of_svg = "http://www.w3.org/2000/svg"  # a name, not an address
    assert not re.search(r"https?://|//cdn|@import|url\(", text.replace(name_of_svg, ""))
    assert [script for script in page.all("script") if "src" in script] == []
    ids = [attributes["id"] for _, attributes in page.tags if "id" in attributes]
    assert len(ids) == len(set(ids))
    assert all(link["href"][1:] in ids for link in page.all("a"))
    drawings = [attributes for attributes in page.all("svg") if "aria-label" in attributes]
    assert len(drawings) == len(page.all("figure")) == 5
    assert all(len(attributes["aria-label"]) > 15 for attributes in drawings)
    assert page.all("img") == []
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


def test_an_angle_near_zero_has_no_sign() -> None:
    assert [degrees(value) for value in (-1e-6, 1e-6, -0.01, None)] == ["0.00°", "0.00°", "-0.57°", "–"]


def test_the_filters_nis_is_held_against_one_and_the_graphs_is_not(make_run: Make, make_graph_run: Make) -> None:
    rule = f'stroke="{GREY}" stroke-width="0.8" stroke-linejoin'
    assert rule in matching_drawing(make_run()).text
    assert rule not in matching_drawing(make_graph_run()).text


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
    for drawn in (map_drawing(still), error_map_drawing(still, run.stamps[:9], np.zeros(9))):
        assert drawn.height >= 200
        assert "nan" not in drawn.text
        ElementTree.fromstring(drawn.text)


def strokes(text: str, colour: str) -> list[str]:
    """Paths drawn in a colour."""
    return re.findall(rf'<path d="([^"]*)" fill="none" stroke="{colour}"', text)


def points(path: str) -> np.ndarray:
    """Where the points of a path are: each is written as the way from the one before."""
    numbers = re.findall(r"-?(?:\d*\.\d+|\d+)", path.replace("h0", ""))
    return np.cumsum(np.array(numbers, dtype=float).reshape(-1, 2), axis=0)


def test_a_loop_is_drawn_from_pose_to_pose(make_graph_run: Make) -> None:
    run = make_graph_run(loops=3)
    run = replace(
        run,
        loops=tuple(replace(loop, shift=np.array([x, 0.0, 0.0])) for loop, x in zip(run.loops, (1, 3, 9), strict=True)),
    )
    text = map_drawing(run).text
    lines = [path for shade in SHADES for path in strokes(text, shade) if "l" in path]
    assert len(lines) == 3  # three shifts, three colours, the largest shift last
    ends = np.array([points(path) for path in lines])
    poses = np.array(
        [[run.poses[run.stamps == t][0, :2] for t in (loop.earlier_stamp, loop.later_stamp)] for loop in run.loops]
    )
    scale = np.abs(ends[:, 1] - ends[:, 0]) / np.abs(poses[:, 1] - poses[:, 0])  # px a metre, the same for all
    np.testing.assert_allclose(scale, np.median(scale), rtol=0.05)


def test_a_pose_is_looked_up_at_the_nearest_stamp_of_a_clock_that_runs_backwards(make_run: Make) -> None:
    run = make_run(scans=5)
    run = replace(run, stamps=np.array([10.0, 12.0, 11.0, 13.0, 14.0]))
    found = poses_at(run, np.array([9.0, 11.2, 12.4, 99.0]))
    np.testing.assert_array_equal(found, run.poses[[0, 2, 1, 4]])


def test_errors_lie_where_the_robot_was_and_the_largest_is_on_top(make_run: Make) -> None:
    run = make_run()
    errors = np.linspace(0.5, 0.001, 50)
    text = error_map_drawing(run, run.stamps[:50], errors).text
    shades = re.findall(r'h0" fill="none" stroke="(#\w+)"', text)
    assert shades == [shade for shade in SHADES if shade in shades]
    assert shades[-1] == SHADES[-1]
    last = strokes(text, SHADES[-1])[-1]
    assert last.endswith("h0")


def test_medians_over_time_are_drawn_on_a_logarithmic_scale() -> None:
    times = np.arange(600.0)
    text = relation_drawing(times, {"estimate": np.full(600, 0.01), "raw odometry": np.zeros(600)}).text
    heights = {}
    for name, colour in (("estimate", "#0072b2"), ("raw odometry", "#e69f00")):
        line = next(path for path in strokes(text, colour) if "h0" not in path and len(path) > 100)
        heights[name] = set(points(line)[:, 1].round(6).tolist())
        assert len(heights[name]) == 1
    # A logarithm knows no zero: it is drawn at 0.001, a decade below; the axis says where a decade is.
    grid = {value: float(y) for y, value in re.findall(r'y="([\d.]+)" text-anchor="end">([\d.]+)<', text)}
    (high,), (low,) = heights["estimate"], heights["raw odometry"]
    assert low - high == pytest.approx(grid["0.001"] - grid["0.01"], abs=0.2)


def test_quality_and_innovation_have_a_panel_each_where_they_are_known(make_run: Make, make_graph_run: Make) -> None:
    unmatched = replace(make_graph_run(), nis_dof=np.zeros(300, dtype=np.int64))
    for run, panels in ((make_graph_run(), 2), (make_run(), 1), (unmatched, 1)):
        assert matching_drawing(run).text.count('<g data-panel=""') == panels + 1  # and the stated uncertainty


def test_a_line_has_a_gap_where_a_value_is_not_known() -> None:
    axes = Axes((0.0, 4.0), (0.0, 1.0), 400.0, 100.0)
    axes.line(np.arange(5.0), np.array([0.0, 1.0, np.nan, 1.0, 0.5]), "#123456")
    (path,) = strokes(axes.svg(), "#123456")
    assert path.count("m") == 2
    assert len(points(path)) == 4


@given(st.floats(-1e6, 1e6), st.floats(1e-3, 1e6))
def test_ticks_are_few_and_inside(low: float, span: float) -> None:
    found = ticks(low, low + span)
    assert 3 <= len(found) <= 11
    assert all(low - 1e-6 * span <= tick <= low + span * (1 + 1e-6) for tick in found)


def test_the_page_loads_no_plotting_library() -> None:
    code = "import contourslam.report.run_page, contourslam.report.result_folder, sys; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = done.stdout.split()
    assert "contourslam.report.svg.way" in loaded
    assert not {"matplotlib", "evo"} & set(loaded)  # Numba itself loads scipy where it is


def test_a_long_run_has_its_page_within_seconds_and_a_megabyte(tmp_path: Path, make_graph_run: Make) -> None:
    run = make_graph_run(scans=10_000, loops=300)
    found = judged(run)
    metrics = run_metrics(run, relations=found)
    begin = time.process_time()
    write_run_page(tmp_path, run, Config(), metrics, found)
    assert time.process_time() - begin < 2.0  # measured: about 0.3
    assert (tmp_path / "index.html").stat().st_size < 1_000_000


def test_the_same_figure_gives_the_same_bytes(make_graph_run: Make) -> None:
    assert map_drawing(make_graph_run(scans=40)) == map_drawing(make_graph_run(scans=40))


def test_a_real_browser_shows_the_page_and_asks_for_nothing(full: Path, browse, parsed) -> None:
    images = len(parsed((full / "index.html").read_text()).all("img"))
    for width in (360, 1280):
        seen = browse(full / "index.html", width=width)
        assert seen.broken == seen.errors == []
        assert seen.images == images
        assert seen.overflow <= 0
        assert all(request.startswith("data:") for request in seen.requests)
