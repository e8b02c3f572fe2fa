"""A real recording in a real browser, skipped where either is not there; benchmarks/bench_view.py has all of it."""

import asyncio
import math
import socket
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from contourslam.cli.run import DEFAULTS
from contourslam.recordings import Message, open_recording
from contourslam.scan import LaserScan
from contourslam.view.lag import Lag
from contourslam.view.pace import Pace
from contourslam.view.replayed import Replayed
from contourslam.view.server import ViewServer
from contourslam.view.spectator import UNDRAWN

LOG = Path(__file__).parents[3] / "shared" / "data" / "intel" / "intel.log.xz"
SCANS = 900  # three minutes
SPEED = 20.0
STATE = "contourslam.model.status?.state"
RECONNECT = """async () => {
  const { link } = contourslam, old = link.socket;
  link.pause = 0;
  old.close();
  const again = (done) => link.socket !== old && link.socket.readyState === 1 ? done() : setTimeout(again, 2, done);
  await new Promise((done) => again(done));
}"""


@pytest.fixture(scope="module")
def beginning() -> list[Message]:
    """The first minutes of the recording."""
    if not LOG.exists():
        pytest.skip("the real recordings are not here: no intel/intel.log.xz in ../shared/data")
    messages: list[Message] = []
    scans = 0
    for message in open_recording(LOG).messages():
        messages.append(message)
        scans += isinstance(message, LaserScan)
        if scans == SCANS:
            break
    return messages


@pytest.fixture
def intel(beginning) -> Iterator[Callable[..., Replayed]]:
    """Players over the beginning; they end with the test."""
    made: list[Replayed] = []

    def make(pace: Pace, detectors=(), *, messages: int | None = None) -> Replayed:
        one = Replayed(beginning[:messages], DEFAULTS, detectors, title="intel", duration=190.0, pace=pace)
        one.player.start()
        made.append(one)
        return one

    yield make
    for one in made:
        one.pace.stop()
        one.player.join()


class Diary(Lag):
    """Keeps of each frame how far it was behind, s."""

    def __init__(self) -> None:
        super().__init__()
        self.rows: list[float] = []

    def count(self, on_the_way: float, waited: float) -> None:
        super().count(on_the_way, waited)
        self.rows.append(on_the_way + waited)


def test_it_is_drawn_at_speed_without_a_backlog_and_can_be_scrubbed_and_asked(intel, opened, wait, inked) -> None:
    one = intel(Pace(SPEED))
    one.lag = diary = Diary()
    with ViewServer(one.show, lag=diary) as server:
        page = opened(server)
        wait(page, f"{STATE} === 'mapping' && contourslam.drawn > {SCANS // 2}")
        one.pace.pause()
        then = len(diary.rows)
        wait(page, "contourslam.model.status.paused && contourslam.drawn === contourslam.model.status.scans - 1")
        assert inked(page) > 10
        # Nothing had been queued: what was on its way, a scan that was being mapped, and the newest.
        assert len(diary.rows) - then <= UNDRAWN + 2

        page.evaluate("const s = document.querySelector('#time'); s.value = 30; s.dispatchEvent(new Event('input'))")
        wait(page, "Math.abs(contourslam.model.frame.elapsed - 30) < 1")
        assert page.evaluate("contourslam.model.shown") < len(one.show.memory.knots(0))
        page.click("#latest")
        one.pace.set_speed(math.inf)
        one.pace.play()
        wait(page, f"{STATE} === 'finished' && contourslam.model.maps[0] && contourslam.drawn === {SCANS - 1}")
        page.locator("figure.lane canvas").focus()
        page.keyboard.press("Enter")  # the corner nearest to the middle
        wait(page, "contourslam.model.story?.times.length > 0")
        assert "f / (f + o)" in page.inner_text("#cornerfacts")


def test_four_detectors_are_shown_and_the_server_leaves_nothing_behind(intel, opened, wait, inked) -> None:
    names = ("matched_filter", "wu", "teh_chin", "curvature_scale_space")
    one = intel(Pace(math.inf), names, messages=400)
    before = set(threading.enumerate())
    with ViewServer(one.show, lag=one.lag) as server:
        page = opened(server)
        wait(page, f"{STATE} === 'finished' && contourslam.model.maps.length === 4")
        wait(page, "contourslam.drawn === contourslam.model.status.scans - 1")
        assert all(inked(page, lane) > 10 for lane in range(4))
        page.context.close()
    assert set(threading.enumerate()) <= before
    with socket.socket() as free:
        free.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        free.bind(("127.0.0.1", server.port))


def test_a_page_that_stops_reading_and_a_hundred_reconnects_leave_nothing_behind(intel, opened, wait, until) -> None:
    one = intel(Pace(SPEED))
    with ViewServer(one.show, lag=one.lag) as server:
        asleep, awake = opened(server), opened(server)
        for page in (asleep, awake):
            wait(page, "contourslam.model.frame")
        halt = asleep.context.new_cdp_session(asleep)
        halt.send("Debugger.enable")
        halt.send("Debugger.pause")
        tasks = len(asyncio.all_tasks(server._loop))
        for _ in range(100):
            awake.evaluate(RECONNECT)
        until(lambda: one.lag.pages == 2, 30.0)
        assert len(asyncio.all_tasks(server._loop)) <= tasks + 4  # a connection has four
        one.pace.set_speed(math.inf)
        wait(awake, f"{STATE} === 'finished' && contourslam.drawn === {SCANS - 1}")
        assert awake.evaluate("contourslam.model.knots") == len(one.show.memory.knots(0))
        halt.send("Debugger.disable")
        for page in (asleep, awake):
            page.context.close()
        until(lambda: one.lag.pages == 0, 30.0)
