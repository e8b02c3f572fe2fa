"""The page in a real browser: skipped where Chromium or playwright is not there."""

import math
import time

import pytest

from contourslam.view.pace import Pace
from contourslam.view.server import ViewServer

STATE = "contourslam.model.status?.state"


def test_it_draws_what_was_mapped_and_a_corner_tells_its_story(served, opened, wait, inked) -> None:
    _, server = served(40)
    page = opened(server)
    wait(page, f"{STATE} === 'finished' && contourslam.drawn === 39 && contourslam.model.maps[0]")
    assert inked(page) > 10
    wait(page, "document.querySelector('#state').innerText === 'mapped to the end'")
    assert "circle" in page.inner_text("#title")
    assert page.locator("#pose tbody tr").count() == 1
    assert page.locator("#errorcard").is_visible()  # the recording has true poses
    place = page.evaluate(
        "(() => { const m = contourslam.model.maps[0], c = contourslam.camera,"
        "at = m.observed.indexOf(Math.max(...m.observed)), box = contourslam.maps[0].canvas.getBoundingClientRect();"
        "return [box.left + box.width / 2 + (m.corners[2 * at] - c.x) * c.scale,"
        "box.top + box.height / 2 - (m.corners[2 * at + 1] - c.y) * c.scale, m.corner_ids[at], m.observed[at]]; })()"
    )
    page.mouse.click(*place[:2])
    wait(page, "contourslam.model.story")
    assert page.evaluate("contourslam.selected") == {"lane": 0, "id": place[2]}
    wait(page, "document.querySelector('#cornerfacts').textContent.includes('f / (f + o)')")
    facts = page.inner_text("#cornerfacts").replace("\n", " ")
    assert f"seen, o {place[3]} " in facts
    page.keyboard.press("Escape")
    assert page.evaluate("contourslam.selected") is None
    # A map drawn up anew at the same time and with as many knots, as the refined one is, is another to draw.
    assert page.evaluate(
        "(() => { const { model, maps } = contourslam, [map] = maps, before = map.ink.key;"
        "model.take({ kind: 'map', lane: 0, arrays: model.maps[0] });"
        "map.draw(model, { ink: true }, null); return map.ink.key !== before; })()"
    )


def test_four_detectors_stand_side_by_side(served, opened, wait, inked) -> None:
    names = ("matched_filter", "wu", "teh_chin", "curvature_scale_space")
    _, server = served(20, names)
    page = opened(server)
    wait(page, f"{STATE} === 'finished' && contourslam.drawn === 19 && contourslam.model.maps.length === 4")
    boxes = [page.locator("figure.lane").nth(i).bounding_box() for i in range(4)]
    assert len({(box["x"], box["y"]) for box in boxes}) == 4
    assert [text.split("\n")[0] for text in page.locator("figcaption").all_inner_texts()] == [
        name.replace("_", " ") for name in names
    ]
    assert all(inked(page, lane) > 10 for lane in range(4))
    # Another server with as many lanes at the same address: the connection is opened anew, and so are the maps.
    page.evaluate(
        "(() => { const { about, unit } = contourslam.model;"
        "const lanes = [...about.lanes].reverse();"
        "contourslam.link.handlers.message({ kind: 'hello', unit, about: { ...about, lanes } }); })()"
    )
    assert page.locator("figcaption b").all_inner_texts() == [name.replace("_", " ") for name in names[::-1]]


def test_the_time_line_goes_back_at_once_and_play_goes_on_from_there(served, opened, wait) -> None:
    one, server = served(60, pace=Pace(math.inf))
    page = opened(server)
    # The time line has its length once the frame is drawn.
    wait(page, f"{STATE} === 'finished' && contourslam.drawn === 59 && document.querySelector('#time').max > 10")
    one.pace.pause()
    page.evaluate("const s = document.querySelector('#time'); s.value = 2.0; s.dispatchEvent(new Event('input'))")
    began = time.monotonic()
    wait(page, "contourslam.model.frame.index === 10")
    assert time.monotonic() - began < 5.0
    page.evaluate("document.querySelector('#time').dispatchEvent(new Event('change'))")
    assert page.evaluate("contourslam.model.shown") < one.show.memory.knots_until(59)
    page.keyboard.press("ArrowRight")
    wait(page, "contourslam.model.frame.index === 11")
    page.keyboard.press("Shift+ArrowLeft")
    wait(page, "contourslam.model.frame.index === 1")
    page.select_option("#speed", "50")
    page.click("#play")
    wait(page, "contourslam.model.frame.index === 59")
    assert one.pace.speed == 50.0


def test_a_dropped_connection_is_opened_again_and_everything_catches_up(replayed, opened, until, wait) -> None:
    one = replayed(60, pace=Pace(4.0))
    one.player.start()
    with ViewServer(one.show, lag=one.lag) as server:
        page = opened(server)
        wait(page, "contourslam.model.frame?.index > 5")
        port = server.port
    wait(page, "document.querySelector('#link').dataset.on === 'no'")
    wait(page, "document.querySelector('#state').innerText === 'not connected'")
    one.pace.set_speed(math.inf)
    until(lambda: one.player.state == "finished")
    assert page.evaluate("contourslam.model.frame.index") < 59
    with ViewServer(one.show, port=port, lag=one.lag):
        wait(page, "contourslam.model.frame?.index === 59 && contourslam.model.maps[0]")
        assert page.evaluate("contourslam.model.knots") == len(one.show.memory.knots(0))
        page.context.close()
    # The browser itself notes the server's absence; nothing else went wrong.
    assert all("ERR_CONNECTION_REFUSED" in text for text in opened.wrong)
    opened.wrong.clear()


def test_on_a_phone_nothing_sticks_out_and_fingers_move_the_map(served, opened, wait) -> None:
    _, server = served(20)
    page = opened(server, width=360, has_touch=True, color_scheme="dark")
    wait(page, f"{STATE} === 'finished' && contourslam.model.frame?.index === 19")
    wide = "[...document.querySelectorAll('body *')].filter(e => e.getBoundingClientRect().right > 360).map(e => e.id)"
    assert page.evaluate("document.documentElement.scrollWidth") <= 360, page.evaluate(wide)
    assert page.evaluate("document.documentElement.dataset.theme") == "dark"
    for name in ("#play", "#back", "#forward", "#speed", "#fit", "#follow", "#theme"):
        box = page.locator(name).bounding_box()
        assert box["x"] >= 0, name
        assert box["x"] + box["width"] <= 360, name
        assert box["height"] >= 28, name
    before = page.evaluate("contourslam.camera.scale")
    pinch(page)
    wait(page, f"contourslam.camera.scale > {1.5 * before}")
    assert page.evaluate("contourslam.camera.mode") == "free"
    page.click("#theme")
    assert page.evaluate("document.documentElement.dataset.theme") == "light"


def pinch(page) -> None:
    """Two fingers that part."""
    client = page.context.new_cdp_session(page)
    for kind, apart in (("touchStart", 30), ("touchMove", 60), ("touchMove", 90), ("touchEnd", 0)):
        points = [{"x": 180 - apart, "y": 300, "id": 1}, {"x": 180 + apart, "y": 300, "id": 2}] if apart else []
        client.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})


def test_every_control_has_a_name_and_can_be_reached_by_keys(served, opened, wait) -> None:
    _, server = served(10)
    page = opened(server)
    wait(page, f"{STATE} === 'finished'")
    nameless = page.evaluate(
        "[...document.querySelectorAll('button, input, select, canvas[role=img]')].filter(e => !(e.ariaLabel"
        " || e.textContent.trim() || e.closest('label')?.textContent.trim())).map(e => e.outerHTML)"
    )
    assert nameless == []
    reached = set()
    for _ in range(30):
        page.keyboard.press("Tab")
        reached.add(page.evaluate("document.activeElement.id || document.activeElement.tagName"))
    assert {"play", "time", "speed", "fit", "theme", "goto"} <= reached


def test_the_band_of_consistency_holds_what_an_honest_filter_gives(served, opened, wait) -> None:
    _, server = served(40)
    page = opened(server)
    wait(page, f"{STATE} === 'finished' && contourslam.drawn === 39")
    band = page.evaluate(
        "import('./series.js').then(({ honest }) => honest([Float32Array.of(24, 0), Float32Array.of(60, 0)])"
        ".map((line) => [...line].map((v) => Number.isNaN(v) ? null : v)))"
    )
    # Quantiles of chi square with 24 degrees of freedom at 2.5 and 97.5 %, 12.401 and 39.364.
    assert band == [[pytest.approx(12.401 / 24, abs=3e-3), None], [pytest.approx(39.364 / 24, abs=3e-3), None]]
    together = page.evaluate(
        "import('./series.js').then(({ together }) => { const { ratio, dof } = together("
        "Float32Array.of(1, NaN, 2, 3), Float32Array.of(2, 0, 6, 2), 2); return [[...ratio], [...dof]]; })"
    )
    assert together == [[1.0, 1.0, 2.0, 2.25], [2.0, 2.0, 6.0, 8.0]]
