import csv
import json
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import get_type_hints
from xml.etree import ElementTree

import matplotlib
import numpy as np
import pytest
import tyro

from contourslam.cli import main
from contourslam.cli.drive import Drive
from contourslam.cli.run import Run
from contourslam.config import Config, SlamConfig
from contourslam.errors import ConfigError, ContourslamError, ResultError
from contourslam.evaluation.metrics import run_metrics
from contourslam.evaluation.relations import judge
from contourslam.geometry.poses import between, compose
from contourslam.report.figures.of_runs import figures_of
from contourslam.report.figures.paper_errors import (
    differences_figure,
    distribution_figure,
    nis_figure,
    truth_figure,
)
from contourslam.report.figures.paper_maps import maps_figure, ways_figure
from contourslam.report.figures.save import save_figure
from contourslam.report.page.runs.differs import other_options
from contourslam.report.page.runs.values import RunsReport, differing
from contourslam.report.relation_table import RELATIONS, read_relation_table, write_relation_table
from contourslam.report.result_folder import write_result_folder
from contourslam.report.runs_groups import Errors, grouped
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
    assert table["recordings"][0] == "2"
    mean, spread = map(float, table["relation error, mean, m"][:2])
    both = [float(rows(report / "tables" / f"measures_{i}.csv")["relation error, mean, m"][0]) for i in (1, 2)]
    assert mean == pytest.approx(np.mean(both), abs=1e-4)
    assert spread == pytest.approx(np.std(both, ddof=1), abs=1e-4)


@pytest.mark.usefixtures("undrawn")
def test_a_recording_that_was_mapped_more_often_counts_no_more(folders, tmp_path, make_run) -> None:
    again = written(tmp_path / "again", noisier(make_run(), 2.0), truth=False)
    runs = read_runs([folders[0], again, folders[3]])
    write_runs_report(tmp_path / "out", runs)
    table = rows(tmp_path / "out" / "tables" / "spread.csv")
    assert (table["recordings"][0], table["runs"][0]) == ("2", "3")
    one, two, other = (run.metrics["relations"]["translation"]["mean"] for run in runs)
    mean, spread = map(float, table["relation error, mean, m"][:2])
    assert mean == pytest.approx(np.mean([(one + two) / 2, other]), abs=1e-4)
    assert spread == pytest.approx(np.std([(one + two) / 2, other], ddof=1), abs=1e-4)


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


@pytest.mark.usefixtures("undrawn")
def test_an_earlier_comparisons_figures_do_not_stay(report, folders, tmp_path) -> None:
    own = ("figures/robot.pdf", "figures/maps_of_mine.svg", "tables/results.csv", "tables/settings.txt")
    for name in ("figures/maps_9.pdf", "tables/measures_9.tex", *own):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text("not this one's")
    write_runs_report(tmp_path, read_runs(folders[3:]))
    written = {"tables/measures.csv", "tables/measures.tex", "tables/settings.csv", "tables/settings.tex"}
    assert {str(path.relative_to(tmp_path)) for path in tmp_path.glob("*/*")} == {*own, *written}


def test_all_that_a_comparison_writes_is_known_as_its_own(report, folders, tmp_path, make_run) -> None:
    truth = [written(tmp_path / "a", make_run()), written(tmp_path / "b", noisier(make_run(), 2.0))]
    write_runs_report(tmp_path / "out", read_runs(truth))
    for folder in (report, tmp_path / "out"):
        known = RunsReport(folder, tuple(grouped(read_runs(folders))), "")
        for part in ("figures", "tables"):
            assert sorted(known.own_files(part)) == sorted((folder / part).iterdir()) != []


@pytest.mark.usefixtures("undrawn")
@pytest.mark.parametrize("truth", [True, False])
def test_the_opening_words_quote_what_the_page_tables(tmp_path, make_run, truth) -> None:
    runs = [
        written(tmp_path / name, one, truth=truth) for name, one in (("a", make_run()), ("b", noisier(make_run(), 2.0)))
    ]
    metrics = write_runs_report(tmp_path / "out", read_runs(runs))
    lead = re.search(r'<p class="lead">(.*?)</p>', (tmp_path / "out" / "index.html").read_text())[1]
    what, pair = ("Absolute trajectory error, RMS", "position error") if truth else ("Relation error, mean",) * 2
    assert f"{what}: from 0.0" in lead
    assert lead.endswith("(b); how sure that is, stands below.")
    pairs = metrics["recordings"]["hall.bag"]["pairs"]
    assert pair.split(",")[0].lower() in [one["measure"] for one in pairs]


@pytest.mark.usefixtures("undrawn")
def test_too_few_pairs_are_said_to_be(tmp_path, make_run) -> None:
    run = make_run(scans=24)
    runs = [written(tmp_path / name, noisier(run, by), truth=False) for name, by in (("a", 1.0), ("b", 5.0))]
    write_runs_report(tmp_path / "out", read_runs(runs))
    table = rows(tmp_path / "out" / "tables" / "difference_of_relation_error.csv")
    mean, low, high, _, pairs, verdict = table["a − b"]
    assert float(mean) < 0.0
    assert (low, high, pairs, verdict) == ("", "", "4", "too few pairs")
    assert (
        json.loads((tmp_path / "out" / "metrics.json").read_text())["recordings"]["hall.bag"]["pairs"][0]["difference"][
            "low"
        ]
        is None
    )


def test_page_and_figures_show_the_same_errors(folders) -> None:
    group = grouped(read_runs(folders))[0]
    assert {errors.name: list(errors.of) for errors in group.errors()} == {
        "relation_errors": ["a/out", "b/out"],  # the incomplete run has errors of another drive
        "relation_turns": ["a/out", "b/out"],
    }
    figures = dict(figures_of([group], 3.5))
    for errors in group.errors():
        assert [line.get_label() for line in figures[errors.name].axes[0].lines] == list(errors.of)


def test_figures_of_runs_whose_names_look_alike_do_not_replace_each_other(tmp_path, make_run) -> None:
    names = ("a b", "a_b", "A_B", "relation", "b")
    folders = [written(tmp_path / name, replace(make_run(), odometry=make_run(seed=3).odometry)) for name in names]
    made = [name.lower() for name, _ in figures_of(grouped(read_runs(folders)), 3.5)]
    assert len(made) == len(set(made))
    assert {"a_b_map", "a_b_2_map", "a_b_3_map", "relation_2_map", "b_map"} < set(made)


HOSTILE = ("_ekf", "__", r"$\frac$", "$a$", "a$b", r"\$", "100 %", "{x}^2_3", "<b>&")


def test_a_runs_name_stands_in_figures_as_it_is(make_run, tmp_path) -> None:
    run = make_run(scans=50)
    walls, ways = run.wall_map.end_points, dict.fromkeys(HOSTILE, run.poses)
    apart = dict.fromkeys(HOSTILE, (run.stamps, run.nis, run.nis))
    drawn = {
        "ways": ways_figure(ways, walls),
        "maps": maps_figure(dict.fromkeys(HOSTILE, (run.wall_map, run.corner_map, run.poses))),
        "differences": differences_figure(apart),
        "errors": distribution_figure(Errors("", "error", "m", dict.fromkeys(HOSTILE, run.nis))),
        "nis": nis_figure(dict.fromkeys(HOSTILE, run)),
    }
    for name, figure in drawn.items():
        path = tmp_path / f"{name}.svg"
        with matplotlib.rc_context({"svg.fonttype": "none"}):  # letters stay text
            figure.savefig(path)
        texts = [
            "".join(element.itertext()).strip() for element in ElementTree.parse(path).iter() if "}text" in element.tag
        ]
        assert set(HOSTILE) <= set(texts), name


def test_the_band_of_a_consistent_filter_is_the_filters(make_run, make_graph_run) -> None:
    ekf, graph = make_run(), make_graph_run()
    assert len(nis_figure({"ekf": ekf}).axes[0].collections) == 1
    axes = nis_figure({"graph": graph}).axes[0]
    assert (len(axes.collections), len(axes.lines)) == (0, 1)
    assert axes.lines[0].get_label() == "graph: contours against wheels"
    assert len(nis_figure({"graph": graph, "ekf": ekf}).axes[0].collections) == 1


def test_the_errors_of_a_long_run_stay_a_small_figure(make_run) -> None:
    figure = truth_figure(make_run(scans=20_000))
    assert all(len(axes.lines[0].get_xdata()) <= 2000 for axes in figure.axes)


def test_the_page_fits_a_phone_in_a_real_browser(report, browse) -> None:
    captions = re.findall(r'role="region" aria-label="([^"]+)"', (report / "index.html").read_text())
    assert len(captions) == len(set(captions))
    seen = browse(report / "index.html", width=360)
    assert seen.broken == seen.errors == []
    assert seen.overflow <= 0


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


def test_every_flag_of_a_run_is_known_to_take_no_value(tmp_path, make_run) -> None:
    folders = [written(tmp_path / name, make_run()) for name in ("a", "b")]
    one, two = read_runs(folders)
    flags = [
        name
        for command in (Run, Drive)
        for name, hint in get_type_hints(command, include_extras=True).items()
        if tyro.conf.FlagCreatePairsOff in getattr(hint, "__metadata__", ())
    ]
    assert {"ignore_odometry", "keys", "json"} <= set(flags)
    for option in ("--" + name.replace("_", "-") for name in flags):
        command = {"command": f"contourslam run {option} x.bag"}
        assert other_options([replace(one, about=command), replace(two, about={})])[0] in ([option], []), option


def test_options_that_are_no_settings_are_told_apart_too(tmp_path, make_run) -> None:
    folders = [written(tmp_path / name, make_run()) for name in ("a", "b")]
    commands = ("run x.bag --wheel-noise 1 --every 2 --max-scans=9 -o a", "run x.bag --every 2 --detector wu -o b")
    runs = [
        replace(run, about=run.about | {"command": f"contourslam {command}"})
        for run, command in zip(read_runs(folders), commands, strict=True)
    ]
    assert other_options(runs) == [["--wheel-noise 1", "--max-scans 9"], []]
    commands = ("run --ignore-odometry x.bag --view -o a", "run --every 2 x.bag -o b")
    runs = [
        replace(run, about={"command": f"contourslam {command}"}) for run, command in zip(runs, commands, strict=True)
    ]
    assert other_options(runs) == [["--ignore-odometry"], ["--every 2"]]
    broken = [replace(run, about={"command": "contourslam run 'x"}) for run in runs]
    assert other_options(broken) == [[], []]
