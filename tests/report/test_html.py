import json
import re

import pytest

from contourslam.experiments.study import Study
from contourslam.report.html import headline, write_report
from contourslam.report.page.markup import Cell, Row, definitions, paragraph, table, verbatim
from contourslam.report.paper import TABLE_I

# One grey pixel.
PNG = bytes.fromhex(
    "89504e470d0a1a0a0000000d49484452000000010000000108000000003a7e9b55"
    "0000000a49444154789c6368000000820081777f1a210000000049454e44ae426082"
)


def no_renderer(patch):
    """The picture of the room needs a renderer, and is tested where it is made."""
    patch.setattr("contourslam.report.page.room.render_room", lambda room, path, **size: path.write_bytes(PNG))


@pytest.fixture(scope="module")
def report(tmp_path_factory, make_study):
    folder = tmp_path_factory.mktemp("report")
    with pytest.MonkeyPatch.context() as patch:
        no_renderer(patch)
        write_report(folder, make_study(), command="contourslam compare --seeds 3 <&>")
    return folder


def test_the_page_is_whole_accessible_and_refers_to_nothing_outside(report, parsed):
    text = (report / "index.html").read_text()
    page = parsed(text)
    assert page.all("html")[0]["lang"] == "en"
    assert any(meta.get("name") == "viewport" for meta in page.all("meta"))
    assert not re.search(r"https?://|//cdn|@import|url\(", text)
    assert [script for script in page.all("script") if "src" in script] == []
    ids = [attributes["id"] for _, attributes in page.tags if "id" in attributes]
    assert len(ids) == len(set(ids))
    for link in page.all("a"):
        target = link["href"]
        assert target[1:] in ids if target.startswith("#") else (report / target).is_file()
    images = page.all("img")
    assert len(images) > 15
    for image in images:
        assert (report / image["src"]).is_file()
        assert len(image["alt"]) > 15
        assert int(image["width"]) > 0
        assert int(image["height"]) > 0
    headers = page.all("th")
    assert headers
    assert all(header.get("scope") in ("row", "col") for header in headers)
    assert len(page.all("caption")) == len(page.all("table"))


def test_every_figure_that_was_drawn_is_on_the_page_and_each_drawing_to_be_had_as_pdf(report, parsed):
    page = parsed((report / "index.html").read_text())
    shown = {image["src"] for image in page.all("img")}
    linked = {link["href"] for link in page.all("a") if link["href"].startswith("figures/")}
    assert {f"figures/{path.name}" for path in (report / "figures").iterdir()} == shown | linked
    drawn = {name.removesuffix(".svg") for name in shown if name.endswith(".svg")}
    assert drawn == {name.removesuffix(".pdf") for name in linked if name.endswith(".pdf")}
    for name in drawn:
        assert (report / f"{name}.pdf").read_bytes().startswith(b"%PDF-")


def test_the_figures_load_nothing_from_outside(report):
    for path in (report / "figures").glob("*.svg"):
        links = re.findall(r'(?:href|src)="([^"]*)"', path.read_text())
        assert all(link.startswith(("#", "data:")) for link in links), path.name


def test_table_one_has_our_numbers_and_the_papers(report, make_study):
    text = (report / "index.html").read_text()
    ours = make_study().comparison.table("corners")["teh_chin"]["rmse"]["x"]
    assert f"{ours['mean']:.4f} <small>± {ours['sd']:.4f}</small>" in text
    for value in TABLE_I["teh_chin"].values():
        assert f"<td>{value:.3f}</td>" in text
    assert "raw odometry" in text


def test_metrics_hold_what_the_issue_asks_for(report, make_study):
    metrics = json.loads((report / "metrics.json").read_text())
    runs = make_study().comparison.runs("matched_filter", "corners")
    found = metrics["detectors"]["matched_filter"]
    for name in ("x", "y", "theta"):
        values = [run["rmse"][name] for run in runs]
        assert found["rmse"][name]["mean"] == pytest.approx(sum(values) / 3)
        assert found["rmse"][name]["sd"] > 0
        assert found["rmse"][name]["n"] == 3
    assert found["nees"] == pytest.approx(sum(run["nees"] for run in runs) / 3)
    assert found["fnr"] == pytest.approx(runs[0]["fnr"])
    assert found["scans_per_second"] > 0
    assert metrics["complete"] is True
    assert metrics["seeds"] == [0, 1, 2]
    assert metrics["command"] == "contourslam compare --seeds 3 <&>"
    assert set(metrics["with_walls"]["detectors"]) == {"matched_filter", "teh_chin"}
    assert metrics["noise"]["levels"] == [0.0, 0.02]
    assert len(metrics["runs"]) == 3
    assert metrics["config"]["lidar"]["sigma_range"] == 0.01


@pytest.mark.usefixtures("undrawn")
def test_an_interrupted_study_is_marked_on_the_page_and_in_the_numbers(tmp_path, make_study, monkeypatch):
    no_renderer(monkeypatch)
    study = make_study(detectors=("wu",), seeds=1, complete=False)
    write_report(tmp_path, Study(study.comparison, complete=False))
    assert "INCOMPLETE" in (tmp_path / "index.html").read_text()
    metrics = json.loads((tmp_path / "metrics.json").read_text())
    assert metrics["complete"] is False
    assert metrics["detectors"]["wu"]["rmse"]["x"]["sd"] is None


@pytest.mark.usefixtures("undrawn")
def test_a_study_in_which_nothing_was_finished_still_gives_a_page(tmp_path, make_study, parsed):
    study = make_study(seeds=0, complete=False)
    write_report(tmp_path, Study(study.comparison, complete=False))
    assert "No replay was finished." in (tmp_path / "index.html").read_text()
    parsed((tmp_path / "index.html").read_text())


def test_the_headline_says_what_came_out(make_study):
    said = headline(make_study())
    assert "3 simulated drives through the furnished room" in said
    assert "0.8 cm in x and 0.6 cm in y (the paper: 7.1 and 7.1 cm)" in said


def test_text_from_outside_cannot_become_markup():
    nasty = '<script>alert("x")</script>&'
    pieces = [
        paragraph(nasty, nasty),
        verbatim(nasty),
        definitions({nasty: nasty}),
        table(nasty, [nasty], [Row(nasty, [Cell(nasty, nasty)])]),
    ]
    for piece in pieces:
        assert "<script" not in piece
        assert 'alert("' not in piece


def test_a_real_browser_shows_every_picture_and_asks_for_nothing_else(report, browse, parsed):
    images = len(parsed((report / "index.html").read_text()).all("img"))
    for width in (360, 1280):
        seen = browse(report / "index.html", width=width)
        assert seen.broken == seen.errors == []
        assert seen.images == images
        assert seen.overflow <= 0
        assert all(request.startswith((report.as_uri(), "data:")) for request in seen.requests)
