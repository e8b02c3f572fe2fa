import csv
import json
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from contourslam.cli import main
from contourslam.config import Config, SlamConfig
from contourslam.errors import ConfigError, ContourslamError, ResultError
from contourslam.evaluation.metrics import run_metrics
from contourslam.evaluation.relations import judge
from contourslam.geometry.poses import between, compose
from contourslam.report.figures.of_runs import figures_of
from contourslam.report.figures.save import save_figure
from contourslam.report.page.runs.differs import other_options
from contourslam.report.page.runs.values import differing
from contourslam.report.relation_table import RELATIONS, read_relation_table, write_relation_table
from contourslam.report.result_folder import write_result_folder
from contourslam.report.runs_groups import fit, grouped
from contourslam.report.runs_page import write_runs_report
from contourslam.report.runs_reading import distinct_names, read_runs


def judged(run, gap=20):
    """Hold a run against relations made from its true poses."""
    stamps = np.stack([run.stamps[:-gap], run.stamps[gap:]], axis=-1)
    return judge(run, stamps, between(run.truth[:-gap], run.truth[gap:]))


def written(folder: Path, run, *, truth=True, recording="hall.bag", **settings) -> Path:
    """Leave what `contourslam run` would, judged by relations where the truth is not to be kept."""
    relations = None if truth else judged(run)
    run = run if truth else replace(run, truth=None)
    config = Config(detector=run.detector, **settings)
    metrics = {"recording": recording} | run_metrics(run, relations=relations)
    write_result_folder(folder, run, config, metrics, command=f"contourslam run {recording}")
    if relations is not None:
        write_relation_table(folder / RELATIONS, relations)
    return folder


def noisier(run, by):
    return replace(run, poses=run.truth + by * (run.poses - run.truth))


@pytest.fixture(scope="module")
def folders(tmp_path_factory, make_run):
    """Three runs of one recording, of which one is incomplete, and one of another drive with the same stamps."""
    root = tmp_path_factory.mktemp("runs")
    run = make_run()
    turned = replace(noisier(run, 3.0), poses=compose(np.array([2.0, -1.0, 0.5]), noisier(run, 3.0).poses))
    rows = ("stamps", "poses", "covariances", "odometry", "truth", "nis", "nis_dof", "matched_count", "corner_count")
    cut = {name: getattr(run, name)[:200] for name in (*rows, "wall_count")}
    odometry = run.odometry * np.array([1.01, 1.0, 1.0])
    return [
        written(root / "a" / "out", run, truth=False),
        written(root / "b" / "out", turned, truth=False, back_end="graph"),
        written(root / "c", replace(run, **cut, complete=False), truth=False),
        written(root / "d", replace(run, odometry=odometry), truth=False, recording="yard.bag"),
    ]


@pytest.fixture(scope="module")
def report(folders, tmp_path_factory):
    folder = tmp_path_factory.mktemp("report")
    write_runs_report(folder, read_runs(folders), command="contourslam compare <&>")
    return folder


def test_folders_of_one_name_are_told_apart_by_where_they_are() -> None:
    assert distinct_names([Path("x/ekf"), Path("x/graph")]) == ["ekf", "graph"]
    assert distinct_names([Path("x/a/out"), Path("x/b/out"), Path("c")]) == ["a/out", "b/out", "c"]
    with pytest.raises(ConfigError, match="twice"):
        distinct_names([Path("x"), Path("y/../x")])


def test_runs_are_of_one_recording_where_stamps_and_wheels_agree(folders) -> None:
    groups = grouped(read_runs(folders))
    assert [[run.name for run in group.runs] for group in groups] == [["a/out", "b/out", "c"], ["d"]]
    assert [group.recording for group in groups] == ["hall.bag", "yard.bag"]
    assert groups[0].competing == {"a/out", "b/out"}
    assert groups[1].competing == frozenset()


def test_a_run_in_another_frame_is_laid_upon_the_first(folders) -> None:
    group = grouped(read_runs(folders))[0]
    np.testing.assert_allclose(compose(group.motions[1], np.array([2.0, -1.0, 0.5])), np.zeros(3), atol=0.01)
    apart = group.differences()["b/out"]
    assert len(apart.times) == 300
    assert apart.position.max() < 0.2
    assert len(group.differences()["c"].times) == 200


def test_runs_with_the_recordings_own_truth_are_left_where_they_are(tmp_path, make_run) -> None:
    run = make_run()
    shifted = replace(run, poses=run.poses + np.array([0.5, 0.0, 0.0]))
    folders = [written(tmp_path / "a", run), written(tmp_path / "b", shifted)]
    (group,) = grouped(read_runs(folders))
    assert not group.motions[1].any()
    np.testing.assert_allclose(group.differences()["b"].position, 0.5)
    (pair,) = group.pairs()
    assert pair.measure == "position error"
    assert pair.difference.high < -0.4


def test_simulated_drives_of_other_seeds_are_other_recordings(tmp_path, make_run) -> None:
    run = make_run()
    other = replace(run, truth=run.truth[::-1].copy())
    folders = [written(tmp_path / "a", run), written(tmp_path / "b", other)]
    assert [group.recording for group in grouped(read_runs(folders))] == ["hall.bag", "hall.bag (2)"]


def test_the_rigid_motion_that_fits_best_is_found() -> None:
    rng = np.random.default_rng(0)
    points, motion = rng.normal(size=(50, 2)), np.array([3.0, -2.0, 2.5])
    moved = compose(motion, np.column_stack([points, np.zeros(50)]))
    np.testing.assert_allclose(fit(points, moved[:, :2]), motion, atol=1e-9)
    np.testing.assert_allclose(fit(points[:1], moved[:1, :2])[:2], moved[0, :2] - points[0])


def test_the_errors_of_relations_come_back_from_their_table(tmp_path, make_graph_run) -> None:
    found = judged(make_graph_run())
    write_relation_table(tmp_path / RELATIONS, found)
    back = read_relation_table(tmp_path / RELATIONS, {"relations": {"outside": 7}})
    np.testing.assert_array_equal(back.stamps, found.stamps)
    for name in ("estimate", "online", "odometry"):
        for part in ("translation", "rotation"):
            expected = getattr(getattr(found, name), part)
            np.testing.assert_allclose(getattr(getattr(back, name), part), expected, rtol=1e-5)
    assert back.estimate.outside == 7
    for damage in ("", "stamp\n1\n", (tmp_path / RELATIONS).read_text()[:-20]):
        (tmp_path / "damaged.csv").write_text(damage)
        with pytest.raises(ResultError, match=r"damaged\.csv: "):
            read_relation_table(tmp_path / "damaged.csv", {})


@pytest.mark.parametrize("missing", ["metrics.json", "config.yaml", "scans.csv", "map.geojson"])
def test_a_missing_file_is_named_with_what_to_do(tmp_path, make_run, missing) -> None:
    folder = written(tmp_path / "out", make_run(scans=20))
    (folder / missing).unlink()
    with pytest.raises(ResultError, match=f"{re.escape(missing)} is missing; .*contourslam run RECORDING"):
        read_runs([folder])


def test_what_is_no_result_says_so(tmp_path) -> None:
    with pytest.raises(ResultError, match="is no result folder"):
        read_runs([tmp_path])
    with pytest.raises(ContourslamError, match="there is no such result folder"):
        read_runs([tmp_path / "nothing"])


def test_relations_that_a_folder_has_lost_are_missed_aloud(folders, tmp_path, make_run) -> None:
    folder = written(tmp_path / "out", make_run(), truth=False)
    (folder / RELATIONS).unlink()
    (run,) = read_runs([folder])
    assert run.relations is None
    assert "give --relations FILE" in run.notes[0]


def test_the_page_has_its_sections_and_marks_what_is_incomplete(report, parsed) -> None:
    text = (report / "index.html").read_text()
    assert re.findall(r'<h2 id="([\w-]+)">', text) == ["settings", "measures", "together_1", "reproduce"]
    assert "INCOMPLETE: c stopped early." in text
    assert "contourslam compare &lt;&amp;&gt;" in text
    page = parsed(text)
    for link in [*page.all("a"), *({"href": image["src"]} for image in page.all("img"))]:
        assert link["href"].startswith("#") or (report / link["href"]).is_file()
    assert all(len(image["alt"]) > 15 for image in page.all("img"))


def rows(path: Path) -> dict[str, list[str]]:
    with path.open(newline="") as file:
        return {name: values for name, *values in csv.reader(file)}


def test_only_runs_of_the_whole_recording_compete_for_the_best(report, folders) -> None:
    text = (report / "index.html").read_text()
    table = rows(report / "tables" / "measures_1.csv")
    assert table["measure"] == ["a/out", "b/out", "c (INCOMPLETE)"]
    first, second, _ = (float(value) for value in table["relation error, mean, m"])
    assert first == pytest.approx(read_runs(folders)[0].relations.estimate.translation.mean(), abs=1e-4)
    assert first < second
    assert f'<td class="better">{first:.4f}</td><td>{second:.4f}</td><td>' in text
    alone = rows(report / "tables" / "measures_2.csv")
    part = text[text.index("Runs of yard.bag") : text.index("Each setting over its recordings")]
    assert alone["measure"] == ["d"]
    assert 'class="better"' not in part


def test_what_differs_and_nothing_else_is_told_of_the_settings(report) -> None:
    table = rows(report / "tables" / "settings.csv")
    assert table["recording"] == ["hall.bag", "hall.bag", "hall.bag", "yard.bag"]
    assert table["back_end"] == ["ekf", "graph", "ekf", "ekf"]
    assert set(table) == {"setting", "recording", "scans", "back_end"}


def test_a_setting_over_two_recordings_has_mean_and_spread(report) -> None:
    table = rows(report / "tables" / "spread.csv")
    assert table["runs"][0] == "2"
    mean, spread = map(float, table["relation error, mean, m"][:2])
    both = [float(rows(report / "tables" / f"measures_{i}.csv")["relation error, mean, m"][0]) for i in (1, 2)]
    assert mean == pytest.approx(np.mean(both), abs=1e-4)
    assert spread == pytest.approx(np.std(both, ddof=1), abs=1e-4)


def test_a_difference_that_is_sure_is_told_from_one_that_is_not(report) -> None:
    table = rows(report / "tables" / "difference_of_relation_error_1.csv")
    mean, low, high, share, pairs, verdict = table["a/out − b/out"]
    assert float(low) < float(mean) < float(high) < 0.0
    assert (verdict, pairs) == ("first smaller", "280")
    assert float(share) > 50.0
    assert len(table) == 2  # the incomplete run is held against no other


def test_the_numbers_hold_all_that_the_page_shows(report) -> None:
    metrics = json.loads((report / "metrics.json").read_text())
    assert metrics["recordings"]["hall.bag"]["competing"] == ["a/out", "b/out"]
    pair = metrics["recordings"]["hall.bag"]["pairs"][0]
    assert pair["difference"]["low"] < pair["difference"]["mean"] < pair["difference"]["high"]
    assert metrics["settings"] == {"back_end": {"a/out": "ekf", "b/out": "graph", "c": "ekf", "d": "ekf"}}
    assert metrics["runs"]["c"]["complete"] is False


def test_an_earlier_comparisons_figures_do_not_stay(report, folders, tmp_path) -> None:
    for name in ("figures/maps_9.pdf", "tables/measures_9.tex"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text("an earlier one's")
    write_runs_report(tmp_path, read_runs(folders[3:]))
    assert list((tmp_path / "figures").iterdir()) == []
    assert {path.stem for path in (tmp_path / "tables").iterdir()} == {"measures", "settings"}


def test_the_page_fits_a_phone_in_a_real_browser(report, browse) -> None:
    captions = re.findall(r'role="region" aria-label="([^"]+)"', (report / "index.html").read_text())
    assert len(captions) == len(set(captions))
    seen = browse(report / "index.html", width=360)
    assert seen["data-broken"] == ""
    assert "data-errors" not in seen
    assert int(seen["data-overflow"]) <= 0


def test_figures_for_a_paper_embed_their_fonts_and_are_as_wide_as_asked(folders, tmp_path) -> None:
    width = 3.5
    for name, figure in figures_of(grouped(read_runs(folders[:1])), width):
        save_figure(figure, tmp_path / f"{name}.pdf", tmp_path / f"{name}.svg")
        assert not any(axes.get_title() for axes in figure.axes), name
    pdfs = sorted(tmp_path.glob("*.pdf"))
    assert [path.stem for path in pdfs] == ["map", "nis", "relation_errors", "relation_turns", "relations"]
    for path in pdfs:
        text = path.read_bytes()
        assert b"/FontFile2" in text  # TrueType, in the file
        assert b"/Type3" not in text
        assert b"/Subtype /Image" not in text  # lines stay lines
        left, bottom, right, top = map(float, re.search(rb"/MediaBox \[ ([\d. ]+) \]", text)[1].split())
        assert right - left == pytest.approx(72.0 * width)
        assert top - bottom < 72.0 * 9.0
        svg = path.with_suffix(".svg").read_text()
        assert re.search(r'width="252pt"', svg)
        assert "<image" not in svg


def test_the_same_run_gives_the_same_bytes_in_another_process(folders, tmp_path) -> None:
    one, two = tmp_path / "one", tmp_path / "two"
    assert main(["figures", str(folders[0]), "-o", str(one)]) == 0
    code = "import sys; from contourslam.cli import main; sys.exit(main(sys.argv[1:]))"
    command = [sys.executable, "-c", code, "figures", str(folders[0]), "-o", str(two)]
    subprocess.run(command, check=True, capture_output=True, env={"PYTHONHASHSEED": "7"})
    files = sorted(path.name for path in one.iterdir())
    assert len(files) == 10
    for name in files:
        assert (one / name).read_bytes() == (two / name).read_bytes(), name


def test_settings_of_the_walls_are_settings_too(tmp_path, make_run) -> None:
    folders = [written(tmp_path / "a", make_run()), written(tmp_path / "b", make_run(), slam=SlamConfig(walls=True))]
    runs = read_runs(folders)
    assert differing(runs) == {"slam.walls": ["False", "True"]}


def test_options_that_are_no_settings_are_told_apart_too(tmp_path, make_run) -> None:
    folders = [written(tmp_path / name, make_run()) for name in ("a", "b")]
    commands = ("run x.bag --wheel-noise 1 --every 2 --max-scans=9 -o a", "run x.bag --every 2 --detector wu -o b")
    runs = [
        replace(run, about=run.about | {"command": f"contourslam {command}"})
        for run, command in zip(read_runs(folders), commands, strict=True)
    ]
    assert other_options(runs) == [["--wheel-noise 1", "--max-scans 9"], []]
    broken = [replace(run, about={"command": "contourslam run 'x"}) for run in runs]
    assert other_options(broken) == [[], []]
