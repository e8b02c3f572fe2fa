"""What the page of a run answers in a real browser: skipped where Chromium or playwright is not there."""

import re
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from contourslam.config import Config
from contourslam.evaluation.metrics import run_metrics
from contourslam.evaluation.relations import JudgedRelations, RelationErrors, judge
from contourslam.geometry.poses import between
from contourslam.report.run_page import write_run_page
from contourslam.report.scan_table import EMPTY_CORNERS, EMPTY_WALLS
from contourslam.report.svg.series import pieces
from contourslam.slam.result import RunResult

NASTY = '</script><img src=x onerror="document.title=1"><b>&'
MAP, CHART = 'figure[data-name="map"]', 'figure[data-name="matching"]'
FIGURES = "figures.map((figure) => figure.figure.dataset.name)"


@pytest.fixture(scope="module")
def run(make_graph_run: Callable[..., RunResult]) -> RunResult:
    """A run with all there is, some of it named by someone who means ill."""
    made = make_graph_run(loops=6)
    last = replace(made.loops[-1], method=NASTY)
    return replace(made, loops=(*made.loops[:-1], last), detector=NASTY)


@pytest.fixture(scope="module")
def page_file(run: RunResult, tmp_path_factory: pytest.TempPathFactory) -> Path:
    assert run.truth is not None
    stamps = np.stack([run.stamps[:-20], run.stamps[20:]], axis=-1)
    relations: JudgedRelations = judge(run, stamps, between(run.truth[:-20], run.truth[20:]))
    folder = tmp_path_factory.mktemp("run")
    metrics = run_metrics(run, relations=relations)
    write_run_page(folder, run, Config(), metrics, relations, command=NASTY, name=f"drive {NASTY}")
    return folder / "index.html"


@pytest.fixture
def opened(browser: Any, page_file: Path) -> Iterator[Callable[..., Any]]:
    """Open a page; whatever it asks for elsewhere, or complains of, fails the test."""
    contexts, wrong = [], []

    def open_page(file: Path = page_file, *, width: int = 1280, **more: Any) -> Any:
        context = browser.new_context(viewport={"width": width, "height": 900}, **more)
        contexts.append(context)
        page = context.new_page()
        page.on("console", lambda message: wrong.append(message.text))
        page.on("pageerror", lambda error: wrong.append(str(error)))
        own = (file.as_uri(), "data:", "blob:")
        page.on("request", lambda request: None if request.url.startswith(own) else wrong.append(request.url))
        page.goto(file.as_uri())
        return page

    yield open_page
    for context in contexts:
        context.close()
    assert wrong == []


def wait(page: Any, true: str, seconds: float = 20.0) -> None:
    """Wait for an expression to hold; the page's own policy lets none be evaluated inside it by playwright's way."""
    end = time.monotonic() + seconds
    while not page.evaluate(f"Boolean({true})"):
        assert time.monotonic() < end, f"never: {true}"
        page.wait_for_timeout(20)


def settled(page: Any) -> None:
    """Wait until what was asked for is drawn: drawing waits for the next frame."""
    page.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")


def on_screen(page: Any, x: float, y: float) -> tuple[float, float]:
    """Where a place of the map, m, is in the window, px; the map is brought into sight."""
    page.locator(f"{MAP} .stage > svg").scroll_into_view_if_needed()
    settled(page)
    return tuple(
        page.evaluate(
            "([x, y]) => { const { panel, svg } = figures[0], box = svg.getBoundingClientRect();"
            "const [u, v] = panel.toPage(panel.drawingX(x), panel.drawingY(y)); return [box.left + u, box.top + v]; }",
            [x, y],
        )
    )


def facts(page: Any) -> dict[str, str]:
    """What the map's card tells."""
    names, values = (page.locator(f"{MAP} .card {part}").all_inner_texts() for part in ("dt", "dd"))
    return dict(zip(names, values, strict=True))


def metres_across(page: Any) -> float:
    return float(page.evaluate("figures[0].panel.view.w / figures[0].panel.base.w")) * 6.0


def test_a_corner_under_the_mouse_tells_its_story_and_a_click_holds_it(opened: Callable[..., Any], run) -> None:
    page, corners = opened(), run.corner_map
    for i in range(len(corners.ids)):
        page.mouse.move(*on_screen(page, *corners.positions[i]))
        told = facts(page)
        kind = "convex" if corners.convex[i] else "concave"
        assert page.inner_text(f"{MAP} .card strong") == f"Corner c{corners.ids[i]}, {kind}"
        at = [float(number) for number in re.findall(r"-?\d+\.\d+", told["place"])]
        np.testing.assert_allclose(at, corners.positions[i], atol=2e-3)
        o, f = int(corners.observed[i]), int(corners.failed[i])
        assert (told["seen, o"], told["missed, f"]) == (str(o), str(f))
        assert told["f / (f + o)"] == f"{f / (f + o):.3f}"
        assert told["opening"] == "90°"
        scales = {"mm": 1e-3, "cm": 1e-2, "m": 1.0}
        sigmas = [float(n) * scales[unit] for n, unit in re.findall(r"([\d.]+) (mm|cm|m)", told["σ along its axes"])]
        expected = np.sqrt(np.linalg.eigvalsh(corners.covariances[i]))[::-1]
        np.testing.assert_allclose(sigmas, expected, rtol=6e-3)
    page.mouse.click(*on_screen(page, *corners.positions[0]))
    page.mouse.move(*on_screen(page, 3.0, 1.9))
    assert page.inner_text(f"{MAP} .card strong").startswith(f"Corner c{corners.ids[0]}")
    page.keyboard.press("Escape")
    assert page.locator(f"{MAP} .card").is_hidden()


def test_walls_poses_and_loops_tell_theirs(opened: Callable[..., Any], run) -> None:
    page = opened()
    page.mouse.move(*on_screen(page, *run.wall_map.end_points[0].mean(axis=0)))
    assert page.inner_text(f"{MAP} .card strong") == "Wall w1"
    assert facts(page)["length"].startswith("6") or facts(page)["length"].startswith("5.9")
    assert facts(page)["seen, o"] == "900"
    page.locator('button[data-layer="loops"]').click()
    page.mouse.move(*on_screen(page, *run.poses[40, :2]))
    told = facts(page)
    assert re.fullmatch(r"Pose at 0:0[34]\.\d min", page.inner_text(f"{MAP} .card strong"))
    assert told["σ of the place"] == "8 mm"
    assert float(told["NIS per d. o. f."]) > 0.0
    page.locator('button[data-layer="loops"]').click()
    page.locator(f"{MAP} .stage").focus()
    page.keyboard.press("Shift+l")  # the last that is drawn has the largest shift
    largest = max(run.loops, key=lambda loop: float(np.hypot(*loop.shift[:2])))
    assert facts(page)["pairs"] == str(largest.pairs)
    assert facts(page)["found by"] == largest.method


def test_the_wheel_zooms_about_the_mouse_only_where_it_is_meant_to(opened: Callable[..., Any], run) -> None:
    page = opened()
    place = run.corner_map.positions[2]
    at = on_screen(page, *place)
    page.mouse.move(*at)
    before = page.evaluate("scrollY")
    page.mouse.wheel(0, 100)
    wait(page, f"scrollY > {before}")  # the reader was scrolling the page
    assert metres_across(page) == pytest.approx(6.0, rel=0.3)
    at = on_screen(page, *place)
    page.mouse.click(*at)
    wide, begin = metres_across(page), page.evaluate("scrollY")
    for _ in range(5):
        page.mouse.wheel(0, -100)
    settled(page)
    wait(page, f"figures[0].closeness() > {0.99 * np.exp(500 / 300)}")
    assert metres_across(page) < wide / 4
    assert page.evaluate("scrollY") == begin
    grown = wide / metres_across(page)
    np.testing.assert_allclose(on_screen(page, *place), at, atol=grown)  # a mouse's px are whole: the rest is cut off


def test_buttons_keys_drag_and_double_click_move_the_map_and_fit_brings_it_back(opened: Callable[..., Any]) -> None:
    page = opened()
    whole, begin = metres_across(page), on_screen(page, 3.0, 2.0)
    page.click(f"{MAP} button[aria-label='Zoom in']")
    assert metres_across(page) == pytest.approx(whole / 1.6)
    page.click(f"{MAP} button[aria-label='Zoom out']")
    assert metres_across(page) == pytest.approx(whole)
    page.mouse.dblclick(*begin)
    assert metres_across(page) == pytest.approx(whole / 2)
    page.mouse.move(*begin)
    page.mouse.down()
    page.mouse.move(begin[0] + 50, begin[1] + 30, steps=4)
    page.mouse.up()
    np.testing.assert_allclose(on_screen(page, 3.0, 2.0), np.add(begin, (50, 30)), atol=1.0)
    page.locator(f"{MAP} .stage").focus()
    page.keyboard.press("ArrowLeft")
    np.testing.assert_allclose(on_screen(page, 3.0, 2.0), np.add(begin, (110, 30)), atol=1.0)
    page.keyboard.press("+")
    assert metres_across(page) == pytest.approx(whole / 3.2)
    page.keyboard.press("0")
    assert metres_across(page) == pytest.approx(whole)
    np.testing.assert_allclose(on_screen(page, 3.0, 2.0), begin, atol=1.0)


def test_keys_go_from_corner_to_corner_and_each_is_said(opened: Callable[..., Any], run) -> None:
    page, order = opened(), [5, 3, 8, 13]  # as they are drawn: the convex one first
    page.locator(f"{MAP} .stage").focus()
    for number in order:
        page.keyboard.press("c")
        assert page.inner_text(f"{MAP} .spoken").startswith(f"Corner c{number}, ")
    page.keyboard.press("Shift+C")
    assert page.inner_text(f"{MAP} .spoken").startswith(f"Corner c{order[-2]}, ")
    for _ in range(8):
        page.keyboard.press("+")
    settled(page)
    at, box = on_screen(page, *run.corner_map.positions[2]), page.locator(f"{MAP} .stage").bounding_box()
    assert box["x"] < at[0] < box["x"] + box["width"]  # what is held stays in sight
    page.keyboard.press("c")
    settled(page)
    at, box = on_screen(page, *run.corner_map.positions[3]), page.locator(f"{MAP} .stage").bounding_box()
    assert box["x"] < at[0] < box["x"] + box["width"]  # brought into sight


def test_layers_are_switched_and_what_is_hidden_is_not_found(opened: Callable[..., Any], run) -> None:
    page = opened()
    shown = dict(page.evaluate("[...document.querySelectorAll('.layer')].map((b) => [b.dataset.layer, b.ariaPressed])"))
    assert [name for name, pressed in shown.items() if pressed == "false"] == ["odometry", "online"]
    assert set(shown) == {"odometry", "truth", "online", "way", "walls", "ellipses", "corners", "loops", "start"}
    for layer in shown:
        display = f"getComputedStyle(document.querySelector('{MAP} [data-inside] > [data-layer={layer}]')).display"
        before = page.evaluate(display)
        page.click(f'button[data-layer="{layer}"]')
        assert {before, page.evaluate(display)} == {"inline", "none"}, layer
    assert page.locator(f"{MAP} [data-scale]").is_hidden()  # nothing is left that it explains
    page.mouse.move(*on_screen(page, *run.corner_map.positions[0]))
    assert page.locator(f"{MAP} .card").is_hidden()


def test_the_cursor_tells_values_and_marks_the_moment_in_all_figures(opened: Callable[..., Any], run) -> None:
    page = opened()
    page.locator(f"{CHART} .stage").scroll_into_view_if_needed()
    box = page.locator(f"{CHART} .stage > svg").bounding_box()
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + 60)
    moment = page.evaluate("moment.time")
    assert 10.0 < moment < 20.0
    assert page.locator("[data-live] .cursor").count() == 1 + 3 + 3  # relations, errors, matching
    assert page.locator(f"{MAP} [data-live] .robot").count() == 1
    assert page.locator('figure[data-name="relation-map"] [data-live] .robot').count() == 1
    texts = page.locator(f"{CHART} [data-live] .value").all_text_contents()
    assert all(re.match(rf"0:{int(moment):02d}\.\d min  ·  median ", text) for text in texts)
    at, middle, low, high = pieces(run.stamps - run.stamps.min(), run.quality, 250)
    i = int(np.abs(at - moment).argmin())
    told = [float(number) for number in re.findall(r"median ([\d.]+).* within ([\d.]+) … ([\d.]+)", texts[0])[0]]
    np.testing.assert_allclose(told, [middle[i], low[i], high[i]], atol=1.5e-3)
    page.mouse.move(5, 5)
    assert page.evaluate("moment.time") is None
    page.mouse.click(box["x"] + box["width"] / 2, box["y"] + 60)
    page.mouse.move(5, 5)
    assert page.evaluate("moment.time") == pytest.approx(moment)  # held, so that one can look for it on the map
    nearest = run.poses[np.abs(run.stamps - run.stamps.min() - moment).argmin(), :2]
    marked = page.locator(f"{MAP} .robot").bounding_box()
    expected = on_screen(page, *nearest)
    marked = page.locator(f"{MAP} .robot").bounding_box()
    assert (
        np.hypot(marked["x"] + marked["width"] / 2 - expected[0], marked["y"] + marked["height"] / 2 - expected[1]) < 8
    )
    page.locator(f"{CHART} .stage").focus()
    page.keyboard.press("ArrowRight")
    assert moment < page.evaluate("moment.time") < moment + 1.0
    assert "median" in page.inner_text(f"{CHART} .spoken")
    page.keyboard.press("Escape")
    assert page.evaluate("moment.time") is None


def test_a_figure_is_kept_as_a_drawing_that_stands_alone_on_light_paper(opened: Callable[..., Any]) -> None:
    page = opened(color_scheme="dark")
    page.locator(f"{MAP} .stage").focus()
    page.keyboard.press("c")
    for name in page.evaluate(FIGURES):
        with page.expect_download() as kept:
            page.click(f'figure[data-name="{name}"] .save')
        assert re.fullmatch(rf"[\w.-]+-{name}\.svg", kept.value.suggested_filename)
        text = Path(kept.value.path()).read_text()
        root = ElementTree.fromstring(text)
        assert root.tag == "{http://www.w3.org/2000/svg}svg"
        assert not re.search(r"data-live|var\(|light-dark|class=|display=", text)
        colours = set(re.findall(r'(?:fill|stroke)="([^"]*)"', text))
        assert all(re.fullmatch(r"#[0-9a-f]{6}|none", colour) for colour in colours), colours
        assert '<rect width="100%" height="100%" fill="#ffffff"' in text
        inside = [
            path for part in root.iter() if "data-inside" in part.attrib for path in part.iter() if "d" in path.attrib
        ]
        assert inside
        assert all(path.attrib["vector-effect"] == "non-scaling-stroke" for path in inside)


def test_dark_or_light_is_the_systems_until_it_is_switched_and_paper_is_always_light(
    opened: Callable[..., Any],
) -> None:
    page = opened(color_scheme="dark")
    paper = "getComputedStyle(document.body).backgroundColor"
    dark = page.evaluate(paper)
    sheet = f"getComputedStyle(document.querySelector('{MAP} svg > rect')).fill"
    assert max(map(int, re.findall(r"\d+", dark))) < 64
    assert page.evaluate(sheet) == dark
    page.click("button.theme")
    assert page.evaluate(paper) == "rgb(255, 255, 255)"
    end = time.monotonic() + 20.0
    page.reload()
    while page.evaluate(paper) == dark and time.monotonic() < end:  # a busy browser may write it down a little later
        page.reload()
    assert page.evaluate(paper) == page.evaluate(sheet) == "rgb(255, 255, 255)"  # it is remembered
    page.click("button.theme")
    assert page.evaluate(paper) == dark
    assert "theme" not in page.evaluate("document.documentElement.dataset")
    page.emulate_media(color_scheme="light")
    page.click("button.theme")
    assert page.evaluate(paper) == dark
    page.emulate_media(media="print")
    assert page.evaluate(paper) == page.evaluate(sheet) == "rgb(255, 255, 255)"


def test_prints_have_no_controls_and_their_folds_open(opened: Callable[..., Any]) -> None:
    page = opened(color_scheme="dark")
    page.locator(f"{MAP} .stage").focus()
    page.keyboard.press("c")
    assert not page.locator("details pre").is_visible()
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    page.emulate_media(media="print")
    assert page.locator("details pre").is_visible()
    for control in ("button", ".card", ".hint", "nav", "[data-live]"):
        assert not any(found.is_visible() for found in page.locator(control).all()), control
    assert page.locator(f"{MAP} [data-legend]").is_visible()
    assert page.locator(f"{MAP} .stage > svg").bounding_box()["width"] == 680
    unbroken = page.evaluate("[...document.querySelectorAll('figure')].map((f) => getComputedStyle(f).breakInside)")
    assert set(unbroken) == {"avoid"}
    page.emulate_media(media="screen")
    page.evaluate("dispatchEvent(new Event('afterprint'))")
    assert not page.locator("details pre").is_visible()
    assert page.locator(f"{MAP} .stage > svg").bounding_box()["width"] > 1000
    printed = page.pdf(format="A4")
    assert printed.startswith(b"%PDF")
    assert 3 <= len(re.findall(rb"/Type\s*/Page\b", printed)) <= 8


def test_without_scripts_the_pictures_are_there(opened: Callable[..., Any]) -> None:
    page = opened(java_script_enabled=False)
    pictures = page.locator("figure .stage > svg")
    assert pictures.count() == 5
    assert all(picture.bounding_box()["height"] > 200 for picture in pictures.all())
    assert page.locator(f'{MAP} [data-layer="walls"]').is_visible()
    assert page.locator(f"{MAP} [data-legend]").is_visible()
    assert not page.locator(f'{MAP} [data-layer="odometry"]').is_visible()
    assert not any(button.is_visible() for button in page.locator("button").all())


def test_on_a_phone_nothing_sticks_out_and_fingers_zoom(opened: Callable[..., Any], run) -> None:
    page = opened(width=360, has_touch=True, is_mobile=True)
    assert page.evaluate("document.documentElement.scrollWidth") <= 360
    size = "getComputedStyle(document.querySelector('[data-ticks] text')).fontSize"
    assert page.evaluate(size) == "12px"  # the drawing is laid out anew and not shrunk
    assert page.locator(f"{MAP} .stage > svg").bounding_box()["width"] <= 360
    at = on_screen(page, *run.corner_map.positions[1])
    page.touchscreen.tap(*at)
    assert page.inner_text(f"{MAP} .card strong").startswith("Corner c5")
    client = page.context.new_cdp_session(page)
    x, y = on_screen(page, 3.0, 2.0)
    before = metres_across(page)
    for kind, apart in (("touchStart", 20), ("touchMove", 40), ("touchMove", 60), ("touchEnd", 0)):
        points = [{"x": x - apart, "y": y, "id": 1}, {"x": x + apart, "y": y, "id": 2}] if apart else []
        client.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
    wait(page, "figures[0].closeness() > 2.5")
    assert metres_across(page) < before / 2.5


def test_names_from_outside_stay_text(opened: Callable[..., Any]) -> None:
    page = opened()
    assert page.title() == f"drive {NASTY}"
    assert page.inner_text("h1") == f"drive {NASTY}"
    page.locator(f"{MAP} .stage").focus()
    said = []
    for _ in range(6):
        page.keyboard.press("l")
        said.append(facts(page)["found by"])
    assert NASTY in said
    assert page.locator("img, b").count() == 0


def test_a_run_in_which_nothing_happened_has_a_page_that_answers(
    opened: Callable[..., Any], make_run: Callable[..., RunResult], tmp_path: Path
) -> None:
    run = make_run(scans=3)
    fields = ("stamps", "poses", "covariances", "odometry", "nis", "nis_dof")
    cut = replace(
        run,
        **{name: getattr(run, name)[:1] for name in fields},
        **{name: getattr(run, name)[:1] for name in ("matched_count", "corner_count", "wall_count")},
        truth=None,
        corner_map=EMPTY_CORNERS,
        wall_map=EMPTY_WALLS,
    )
    write_run_page(tmp_path, cut, Config(), run_metrics(cut))
    page = opened(tmp_path / "index.html")
    page.mouse.move(*on_screen(page, *cut.poses[0, :2]))
    assert page.inner_text(f"{MAP} .card strong") == "Pose at 0:00.0 min"
    page.locator(f"{MAP} .stage").focus()
    for key in ("c", "w", "l", "+", "0", "Escape"):
        page.keyboard.press(key)


def test_errors_of_two_shades_on_one_path_tell_each_its_own(
    opened: Callable[..., Any], make_run: Callable[..., RunResult], tmp_path: Path
) -> None:
    run = make_run()
    stamps = np.column_stack([run.stamps[[0, 1, 2]], run.stamps[[90, 90, 200]]])  # two end at one pose
    errors = np.array([0.001, 0.1, 0.5])
    one = RelationErrors(errors, errors, 0)
    relations = JudgedRelations(stamps, one, None, one)
    write_run_page(tmp_path, run, Config(), run_metrics(run, relations=relations), relations)
    page = opened(tmp_path / "index.html")
    page.evaluate("globalThis.dots = figures.find((one) => one.figure.dataset.name === 'relation-map')")
    paths = page.evaluate("[...dots.svg.querySelectorAll('[data-layer=errors] path')].map((p) => p.getAttribute('d'))")
    assert len(paths) == 3
    assert paths[0] == paths[1]
    assert page.evaluate("dots.members.errors.length") == len(errors)
    expected = page.evaluate("dots.facts.errors.error")
    np.testing.assert_allclose(expected, 1000.0 * errors)


def test_every_axis_has_three_numbers_or_more_and_room_for_them(opened: Callable[..., Any]) -> None:
    page = opened()
    for many in (1.0, 2.6, 3.3, 10.0):
        for span in np.geomspace(0.01, 500.0, 60):
            found = page.evaluate("([low, high, many]) => roundNumbers(low, high, many)", [-0.37, -0.37 + span, many])
            assert 3 <= len(found) <= max(6, many + 1), (span, many)
            assert all(-0.37 - 1e-6 <= value <= -0.37 + span * (1 + 1e-6) for value in found)


def test_every_figure_and_control_can_be_reached_by_keys_and_has_a_name(opened: Callable[..., Any]) -> None:
    page = opened()
    nameless = "[...document.querySelectorAll('button')].filter((b) => !(b.ariaLabel || b.textContent.trim())).length"
    assert page.evaluate(nameless) == 0
    reached, labels = set(), set()
    for _ in range(80):
        page.keyboard.press("Tab")
        figure, label = page.evaluate(
            "(() => { const one = document.activeElement;"
            "return [one.matches('.stage') ? one.closest('figure').dataset.name : '', one.ariaLabel]; })()"
        )
        if figure:
            reached.add(figure)
            labels.add(label)
    assert reached == set(page.evaluate(FIGURES))
    assert all(re.match("(Map|Chart): ", label) for label in labels)
