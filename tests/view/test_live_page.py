"""The page of a robot that maps, in a real browser: skipped where Chromium or playwright is not there."""

import pytest

from contourslam.live.diagnostics import Diagnostic, Level
from contourslam.view.server import ViewServer

STATE = "contourslam.model.status?.state"
CHIP = "document.querySelector('#state').textContent"


@pytest.fixture
def watched(live):
    """A robot whose page is served."""
    with_servers = []

    def make(scans: int = 60, **more):
        robot = live(scans, **more)
        server = ViewServer(robot.followed.show, lag=robot.followed.lag)
        with_servers.append(server.__enter__())
        return robot, server

    yield make
    for server in with_servers:
        server.__exit__()


def test_the_page_shows_what_a_robot_knows_and_how_it_is(watched, opened, wait, inked) -> None:
    parts = [Diagnostic(Level.OK, "base", "0.30 m/s, battery 7.2 V", {"battery (V)": "7.20"})]
    robot, server = watched(60, health=lambda: parts)
    page = opened(server)
    wait(page, "document.querySelector('#state').innerText === 'waiting for a scan'")
    assert "Health says what is missing" in page.inner_text("#waiting")
    robot.go(30)
    wait(page, f"{STATE} === 'live' && contourslam.drawn === 29 && contourslam.model.maps[0]?.corner_ids.length > 3")
    wait(page, "document.querySelector('#state').innerText === 'live'")  # written some frames later
    assert not page.locator("#waiting").is_visible()
    assert page.inner_text("#title") == "robot · EKF"
    assert inked(page) > 10
    rows = page.locator("#diagnostics li")
    wait(page, "document.querySelectorAll('#diagnostics li').length === 8")
    assert {rows.nth(i).get_attribute("data-level") for i in range(8)} == {"ok"}
    parts[0] = Diagnostic(Level.WARN, "base", "the battery is low: charge it", {"battery (V)": "6.50"})
    robot.wait(4.4)
    wait(page, "document.querySelector('#diagnostics li').dataset.level === 'error'")
    assert "is the lidar's driver running" in rows.nth(0).inner_text()
    wait(page, "document.querySelector('#trouble').innerText.includes('is the lidar\\'s driver running')")
    wait(page, "document.querySelectorAll('#diagnostics li')[1].dataset.level !== 'ok'")
    battery = page.locator("#diagnostics li", has_text="the battery is low")
    battery.locator("summary").click()
    assert "6.50" in battery.inner_text()  # more figures of it
    robot.wait(0.6)
    wait(page, f"contourslam.model.status.head > {robot.now - 0.1}")
    assert "6.50" in battery.inner_text()  # what was opened stays open
    assert any("battery" in text for text in page.locator("#events li").all_inner_texts())


def test_a_corner_of_a_robots_map_tells_its_story_while_the_robot_goes_on(watched, opened, wait) -> None:
    robot, server = watched(60)
    robot.go(40)
    page = opened(server)
    wait(page, "contourslam.drawn === 39 && contourslam.model.maps[0]?.corner_ids.length > 3")
    number = page.evaluate("(() => { const m = contourslam.model.maps[0];"
                           "return m.corner_ids[m.observed.indexOf(Math.max(...m.observed))]; })()")  # fmt: skip
    page.fill("#goto", str(number))
    page.keyboard.press("Enter")
    wait(page, f"contourslam.model.story?.id === {number} && contourslam.model.story.times.length > 5")
    before = page.evaluate("contourslam.model.story.times.length")
    robot.go(20)
    wait(page, f"contourslam.model.story.times.length > {before}")
    assert "seen, o" in page.inner_text("#cornerfacts")


def test_a_page_can_be_held_and_drawn_back_and_the_robot_goes_on(watched, opened, wait) -> None:
    robot, server = watched(60)
    robot.go(30)
    page, other = opened(server), opened(server)
    wait(page, "contourslam.drawn === 29")
    assert not page.locator("#speed").is_visible()
    page.click("#play")
    wait(page, f"{CHIP} === 'held'")
    robot.go(30)
    wait(other, "contourslam.drawn === 59")
    wait(other, "document.querySelector('#state').innerText === 'live'")
    assert page.evaluate("contourslam.model.frame.index") == 29
    page.keyboard.press("Shift+ArrowLeft")
    wait(page, "contourslam.model.frame.index === 19")
    assert page.locator("#speed").is_visible()
    page.click("#latest")
    wait(page, f"contourslam.model.frame.index === 59 && {CHIP} === 'live'")
    page.evaluate("const s = document.querySelector('#time'); s.value = 2.0; s.dispatchEvent(new Event('input'))")
    wait(page, f"contourslam.model.frame.index < 20 && {CHIP} === 'looking back'")


def test_a_new_map_begins_the_page_anew_and_a_dropped_connection_catches_up(live, opened, wait) -> None:
    robot = live(60)
    robot.go(30)
    with ViewServer(robot.followed.show, lag=robot.followed.lag) as server:
        page = opened(server)
        wait(page, "contourslam.drawn === 29")
        wait(page, "contourslam.model.maps[0]?.corner_ids.length > 3")
        page.fill("#goto", str(page.evaluate("contourslam.model.maps[0].corner_ids[0]")))
        page.keyboard.press("Enter")
        wait(page, "contourslam.selected && contourslam.model.story?.times.length > 0")
        robot.session.reset()
        robot.go(10)
        wait(page, "contourslam.drawn === 9")
        assert page.evaluate("contourslam.selected") is None  # the new map's corner of that number is another
        wait(page, "document.querySelector('#cornercard').hidden")
        assert page.evaluate("contourslam.model.knots") == len(robot.followed.show.memory.knots(0))
        assert any("another map is begun" in text for text in page.locator("#events li").all_inner_texts())
        port = server.port
    wait(page, "document.querySelector('#link').dataset.on === 'no'")
    robot.go(20)
    with ViewServer(robot.followed.show, port=port, lag=robot.followed.lag):
        wait(page, "contourslam.drawn === 29 && contourslam.model.maps[0]")
        page.context.close()
    assert all("ERR_CONNECTION_REFUSED" in text for text in opened.wrong)
    opened.wrong.clear()


def test_a_robot_that_is_not_found_in_its_map_is_drawn_nowhere(watched, opened, wait) -> None:
    robot, server = watched(60)
    robot.go(20)
    keep = robot.followed._lane.take
    robot.followed._lane.take = lambda *what, localized: keep(*what, localized=False)
    robot.go(1)
    page = opened(server)
    wait(page, "contourslam.drawn === 20")
    assert "not found in the map yet" in page.inner_text("#waiting")
    wait(page, "document.querySelector('#state').innerText === 'looking for the robot'")
    robot.followed._lane.take = keep
    robot.go(1)
    wait(page, f"contourslam.drawn === 21 && {CHIP} === 'live'")
    assert not page.locator("#waiting").is_visible()


def test_on_a_phone_health_fits(watched, opened, wait) -> None:
    long = Diagnostic(Level.ERROR, "lidar", "/dev/serial/by-id/" + "x" * 90 + ": there is no such port")
    robot, server = watched(20, health=lambda: [long])
    robot.go(20)
    page = opened(server, width=360, has_touch=True, color_scheme="dark")
    wait(page, "contourslam.drawn === 19 && document.querySelector('#diagnostics li')")
    assert page.evaluate("document.documentElement.scrollWidth") <= 360
    chip = page.evaluate(
        "(() => { const c = document.querySelector('#state'); return c.scrollWidth <= c.clientWidth; })()"
    )
    assert chip and "no such port" in page.inner_text("#trouble")  # the one does not push the other out
    summary = page.locator("#diagnostics summary").first.bounding_box()
    assert summary["height"] >= 24 and summary["x"] + summary["width"] <= 360
