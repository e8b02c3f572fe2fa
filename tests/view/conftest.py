"""A robot that drives a circle in a room with a box, without a simulator; players and servers over it."""

import math
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import replace

import numpy as np
import pytest

from contourslam.config import Config, LiveConfig, SlamConfig
from contourslam.live.session import Session
from contourslam.live.start import mapping
from contourslam.scan import LaserScan, Odometry, TruePose
from contourslam.view.access import new_token
from contourslam.view.followed import Followed
from contourslam.view.pace import Pace
from contourslam.view.replayed import Replayed
from contourslam.view.server import ViewServer

SETTINGS = Config(back_end="ekf", slam=SlamConfig(walls=True, contour_matching=True))


@pytest.fixture(scope="session")
def drive(room, scan_of):
    """Messages of so many scans, 5 a second, with odometry that drifts and true poses."""

    def make(scans: int = 40):
        outside, box = [(0, 0), (6, 0), (6, 5), (0, 5)], [(4, 2), (5, 2), (5, 2.8), (4, 2.8)]
        segments = room(outside, box)
        for i in range(scans):
            stamp, turn = 100.0 + 0.2 * i, 0.05 * i
            pose = (2.0 + 0.8 * math.sin(turn), 1.7 + 0.8 * (1.0 - math.cos(turn)), turn)
            drifted = (0.81 * math.sin(1.01 * turn), 0.81 * (1.0 - math.cos(1.01 * turn)), 1.01 * turn)
            yield Odometry(stamp, np.array(drifted))
            yield TruePose(stamp, np.array(pose))
            yield replace(scan_of(segments, pose, beams=240, sigma=0.01, seed=i), stamp=stamp)

    return make


@pytest.fixture(scope="session")
def until() -> Callable[..., None]:
    """Wait for something to come true, and fail where it does not in good time."""

    def wait(true: Callable[[], object], seconds: float = 60.0) -> None:
        end = time.monotonic() + seconds
        while not true():
            assert time.monotonic() < end, "it did not come true"
            time.sleep(0.01)

    return wait


@pytest.fixture
def replayed(drive) -> Iterator[Callable[..., Replayed]]:
    """Players over the drive; they end with the test."""
    made: list[Replayed] = []

    def make(scans: int = 40, detectors=(), *, config: Config = SETTINGS, **more) -> Replayed:
        more.setdefault("pace", Pace(math.inf))
        one = Replayed(drive(scans), config, detectors, title="circle", duration=0.2 * (scans - 1), **more)
        made.append(one)
        return one

    yield make
    for one in made:
        one.pace.stop()
        if one.player.ident is not None:
            one.player.join()


@pytest.fixture
def served(replayed) -> Iterator[Callable[..., tuple[Replayed, ViewServer]]]:
    """Players that are served; the server ends with the test."""
    with ExitStack() as stack:

        def make(scans: int = 40, detectors=(), *, host="127.0.0.1", secret=False, **more):
            one = replayed(scans, detectors, **more)
            token = new_token() if secret else ""
            server = stack.enter_context(ViewServer(one.show, host=host, token=token, lag=one.lag))
            one.player.start()
            return one, server

        yield make


class LiveRobot:
    """A live session that is watched, on a clock of its own; each message of the drive comes at its stamp.

    Attributes
    ----------
    now : float
        s.
    """

    def __init__(self, messages, *, session: Session | None = None, config: Config = SETTINGS, **more) -> None:
        self.now = 0.0
        self._messages = iter(messages)
        self.followed = Followed(config, title="robot", clock=lambda: self.now, **more)
        self.session = session or mapping(config, LiveConfig(), clock=lambda: self.now)
        self.followed.follow(self.session, np.zeros(3))

    def go(self, scans: int) -> None:
        """Let so many scans come, and be mapped."""
        while scans > 0:
            message = next(self._messages, None)
            if message is None:
                return
            if isinstance(message, TruePose):
                continue
            self.now = max(self.now, message.stamp - 100.0)
            if isinstance(message, LaserScan):
                self.session.push_scan(message, self.now)
                scans -= 1
            else:
                self.session.push_odometry(message, self.now)
            self.work()

    def wait(self, seconds: float) -> None:
        """Let time go by in which nothing comes."""
        self.now += seconds
        self.work()

    def work(self) -> None:
        """Do what the worker's thread does."""
        while done := self.session.poll(self.now, at_most=1):
            for processed in done:
                self.followed.take(processed)
        self.followed.rest()


@pytest.fixture
def live(drive) -> Callable[..., LiveRobot]:
    """Robots on the drive."""
    return lambda scans=40, **more: LiveRobot(drive(scans), **more)


@pytest.fixture
def opened(browser):
    """Open a page; whatever it asks for elsewhere, or complains of, fails the test."""
    contexts, wrong = [], []

    def open_page(server: ViewServer, *, width: int = 1280, **more):
        context = browser.new_context(viewport={"width": width, "height": 800}, **more)
        contexts.append(context)
        page = context.new_page()
        page.on("console", lambda message: wrong.append(message.text) if message.type in ("error", "warning") else None)
        page.on("pageerror", lambda error: wrong.append(str(error)))
        page.on("request", lambda request: None if request.url.startswith(server.url) else wrong.append(request.url))
        page.goto(server.url)
        return page

    open_page.wrong = wrong
    yield open_page
    for context in contexts:
        context.close()
    assert wrong == []


@pytest.fixture(scope="session", name="wait")
def _wait():
    """Wait for an expression to hold in a page."""
    return wait


def wait(page, true: str, seconds: float = 60.0) -> None:
    """Wait for an expression to hold; the page's own policy lets none be evaluated inside it by playwright's way."""
    end = time.monotonic() + seconds
    while not page.evaluate(f"Boolean({true})"):
        assert time.monotonic() < end, f"never: {true}"
        page.wait_for_timeout(30)


@pytest.fixture(scope="session", name="inked")
def _inked():
    """Count the colours of a map."""
    return inked


def inked(page, lane: int = 0) -> int:
    """How many colours the middle of a map has: an empty one has one."""
    return page.evaluate(
        "lane => { const c = contourslam.maps[lane].canvas, d = c.getContext('2d')"
        ".getImageData(c.width / 4, c.height / 4, c.width / 2, c.height / 2).data;"
        "return new Set(new Uint32Array(d.buffer)).size; }",
        lane,
    )
