"""What the live page costs the mapping, and how far it is behind: in headless Chromium, on this machine; 15 minutes.

Needs Chromium and playwright. ``bench_view.py --short`` tries it all on a small part of the log, for nothing but to see
that it runs; ``--cost`` measures what it costs alone. Mapping and browser share the machine's processors, so let
nothing else run beside it.
"""

import json
import shutil
import statistics
import subprocess
import sys
import time
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Self

import numpy as np
from playwright.sync_api import Browser, Page, sync_playwright

from listeners import Listeners
from logs import find_logs
from table import Table, publish

SHORT = "--short" in sys.argv[1:]
COST = "--cost" in sys.argv[1:]
WHOLE = 1000 if SHORT else 10**9  # scans that are shown at ten times real time
PART = 1500 if SHORT else 9000  # scans that are mapped as fast as possible
REPEATS = 1 if SHORT else 5
RECONNECTS = 100
SPEED = 10.0
OPTIONS = ["--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"]
CONNECTED = "contourslam.model.frame !== null && document.querySelector('#link').dataset.on === 'yes'"
# The page's own link is broken as a network breaks it, and opened again at once, not after the page's usual pause.
RECONNECT = """async () => {
  const { link } = contourslam;
  link.pause = 0;
  link.socket.close();
  const again = (done) => link.socket.readyState === WebSocket.OPEN ? done() : setTimeout(again, 2, done);
  await new Promise((done) => setTimeout(again, 4, done));
}"""


class Drive:
    """``view_drive.py`` in a process of its own."""

    def __init__(self, log: Path, scans: int, speed: float, how: str) -> None:
        script = Path(__file__).with_name("view_drive.py")
        words = [sys.executable, str(script), str(log), str(scans), str(speed), how]
        self._process = subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.url: str = self._answer()["url"]

    def _answer(self) -> dict[str, Any]:
        assert self._process.stdout is not None
        answer: dict[str, Any] = json.loads(self._process.stdout.readline())
        return answer

    def say(self, word: str) -> None:
        """Give it a command that it does not answer."""
        assert self._process.stdin is not None
        self._process.stdin.write(word + "\n")
        self._process.stdin.flush()

    def ask(self, word: str) -> dict[str, Any]:
        """Give it a command and read the answer."""
        self.say(word)
        return self._answer()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._process.terminate()
        self._process.communicate()


class Pages:
    """Pages of one browser, each in a window of its own."""

    def __init__(self, browser: Browser) -> None:
        self._browser, self._stack = browser, ExitStack()
        self._session = browser.new_browser_cdp_session()

    def open(self, url: str) -> Page:
        """Open one and wait for its link."""
        page = self._stack.enter_context(self._browser.new_context(viewport={"width": 1280, "height": 800})).new_page()
        page.goto(url)
        wait(page, "document.querySelector('#link').dataset.on === 'yes'")
        return page

    def close(self) -> None:
        """Close them all."""
        self._stack.close()

    def cpu(self) -> float:
        """CPU seconds of all the browser's processes until now."""
        told = self._session.send("SystemInfo.getProcessInfo")
        return float(sum(process["cpuTime"] for process in told["processInfo"]))


@dataclass
class Cost:
    """What one way of being watched cost, of each repetition."""

    cpu: list[float] = field(default_factory=list)
    own: list[float] = field(default_factory=list)
    wall: list[float] = field(default_factory=list)
    process: list[float] = field(default_factory=list)
    browser: list[float] = field(default_factory=list)
    frames: list[int] = field(default_factory=list)
    memory: list[float] = field(default_factory=list)


def wait(page: Page, true: str) -> None:
    end = time.monotonic() + 60.0
    while not page.evaluate(f"Boolean({true})"):
        if time.monotonic() > end:
            raise SystemExit(f"the page never got there: {true}")
        page.wait_for_timeout(20)


def stop_reading(page: Page) -> None:
    """Halt a page's script, as a debugger does: its messages stay unread, and it takes no processor."""
    session = page.context.new_cdp_session(page)
    session.send("Debugger.enable")
    session.send("Debugger.pause")


def live(log: Path, pages: Pages) -> Table:
    """Show a log at ten times real time."""
    with Drive(log, WHOLE, SPEED, "served") as drive:
        page = pages.open(drive.url)
        before = pages.cpu()
        drive.say("go")
        while not drive.ask("memory")["mapped"]:
            page.wait_for_timeout(500)
        busy = pages.cpu() - before
        told = drive.ask("end")
        pages.close()
    rows = np.array(told["rows"])
    at, lag = rows[:, 0] / 60.0, 1e3 * rows[:, 1]
    slope, doubt = slope_of(at, lag)
    thirds = " / ".join(f"{np.median(part):.0f}" for part in np.array_split(lag, 3))
    return Table(
        "view",
        ["intel in the page, at ten times real time", "measured"],
        [
            ["recording, and the time it took", f"{told['duration']:,.0f} s, {told['wall']:.0f} s"],
            ["speed reached", f"{told['duration'] / told['wall']:.2f} times real time"],
            ["frames drawn", f"{len(rows):,}, {len(rows) / told['wall']:.1f} a second"],
            ["from the pose to its picture, median / 95 % / longest", "{:.0f} / {:.0f} / {:.0f} ms".format(
                *np.quantile(lag, (0.5, 0.95, 1.0)))],
            ["the same, median in the first, second and last third", f"{thirds} ms"],
            ["growth of that lag", f"{slope:+.2f} ± {doubt:.2f} ms a minute"],
            ["CPU of the mapping's thread", f"{told['cpu'] / told['wall']:.1%} of a core"],
            ["CPU of the server's", f"{(told['process'] - told['cpu']) / told['wall']:.1%} of a core"],
            ["CPU of the browser", f"{busy / told['wall']:.0%} of a core"],
        ],
    )  # fmt: skip


def slope_of(at: "np.ndarray[Any, Any]", lag: "np.ndarray[Any, Any]") -> tuple[float, float]:
    """Slope of lag over time, and twice its standard error.

    Lags of neighbouring frames are alike, so means of forty pieces are what the line is laid through.
    """
    pieces = [
        (x.mean(), y.mean()) for x, y in zip(np.array_split(at, 40), np.array_split(lag, 40), strict=True) if len(x)
    ]
    x, y = np.array(pieces).T
    (slope, _), covariance = np.polyfit(x, y, 1, cov=True)
    return float(slope), 2.0 * float(np.sqrt(covariance[0, 0]))


WAYS = {
    "the loop of `contourslam run`": ("run", 0, 0),
    "the page's player, without a server": ("alone", 0, 0),
    "server, no page": ("served", 0, 0),
    "one page read elsewhere": ("served", 0, 1),
    "four read elsewhere, one of which stops reading": ("served", 0, 4),
    f"one read elsewhere, {RECONNECTS} reconnects": ("served", 0, 1),
    "one page drawn here": ("served", 1, 0),
    "four drawn here, one of which stops reading": ("served", 4, 0),
    "one drawn here, reconnecting all the time": ("served", 1, 0),
}
"""How it is mapped, how many browser's pages are open, and how many links that are read and not drawn."""
BASE = "the page's player, without a server"


def watched(log: Path, pages: Pages, way: str, cost: Cost) -> None:
    """Map once as fast as possible, watched in one way."""
    how, count, links = WAYS[way]
    with Drive(log, PART, float("inf"), how) as drive, ExitStack() as stack:
        opened = [pages.open(drive.url) for _ in range(count)]
        if count == 4:
            stop_reading(opened[0])
        halted = int(links == 4)
        listeners = stack.enter_context(Listeners(drive.url, links - halted, halted)) if links else None
        before = pages.cpu()
        drive.say("go")
        done = 0
        while not drive.ask("memory")["mapped"]:
            time.sleep(0.05)
            if "reconnect" in way and done < RECONNECTS:
                if listeners is None:
                    opened[0].evaluate(RECONNECT)
                else:
                    listeners.reconnect()
                done += 1
        browser = pages.cpu() - before
        told = drive.ask("end")
        pages.close()
    if "reconnect" in way:
        print(f"{done} reconnects while it was mapped", file=sys.stderr)
    cost.cpu.append(told["cpu"])
    cost.own.append(told["own"])
    cost.wall.append(told["wall"])
    cost.process.append(told["process"] - told["cpu"])
    cost.browser.append(browser)
    cost.frames.append(len(told["rows"]) if listeners is None else listeners.frames)
    cost.memory.append(told["memory"])


def side_by_side(log: Path, pages: Pages) -> Table:
    """Map as fast as possible in all ways, in turn, several times."""
    costs = {way: Cost() for way in WAYS}
    for _ in range(REPEATS):
        for way, cost in costs.items():
            watched(log, pages, way, cost)
            print(f"{way}: {cost.cpu[-1]:.2f} s of CPU, {cost.wall[-1]:.2f} s", file=sys.stderr, flush=True)
    base = costs[BASE]
    rows = []
    for way, cost in costs.items():
        rows.append(
            [
                way, ratio(cost.own, base.own), ratio(cost.cpu, base.cpu), ratio(cost.wall, base.wall),
                f"{statistics.median(cost.cpu):.2f}", f"{statistics.median(cost.process):.2f}",
                f"{statistics.median(cost.browser):.1f}", int(statistics.median(cost.frames)),
                f"{statistics.median(cost.memory):.0f}",
            ]
        )  # fmt: skip
    columns = [
        "mapping as fast as possible", "CPU of SLAM itself", "CPU of the thread that maps", "wall time",
        "CPU of that thread, s", "of the server, s", "of the browser, s", "frames drawn", "memory at the end, MB",
    ]  # fmt: skip
    return Table("view_cost", columns, rows)


def ratio(values: list[float], base: list[float]) -> str:
    """Ratios of each repetition: their median and extent."""
    ratios = [value / one for value, one in zip(values, base, strict=True)]
    return f"{statistics.median(ratios):.3f} ({min(ratios):.2f} to {max(ratios):.2f})"


def reconnects(log: Path, pages: Pages) -> Table:
    """Break and open the link again and again where nothing else happens, and see what memory does."""
    with Drive(log, PART // 3, float("inf"), "served") as drive:
        page = pages.open(drive.url)
        drive.say("go")
        while not drive.ask("memory")["mapped"]:
            page.wait_for_timeout(50)
        wait(page, CONNECTED)
        kept = []
        for done in range(2 * RECONNECTS + 1):
            if done % (RECONNECTS // 2) == 0:
                kept.append(drive.ask("memory")["memory"])
            page.evaluate(RECONNECT)
            wait(page, CONNECTED)
        drive.ask("end")
        pages.close()
    return Table(
        "view_memory",
        ["reconnects", *(str(RECONNECTS // 2 * i) for i in range(len(kept)))],
        [["memory of the process, MB", *(f"{value:.1f}" for value in kept)]],
    )


def main() -> None:
    chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    logs = {log.name: log for log in find_logs()}
    if chromium is None or "intel" not in logs:
        raise SystemExit("needs Chromium, and the log intel in the folder of logs")
    log = logs["intel"].path
    with sync_playwright() as playwright, playwright.chromium.launch(executable_path=chromium, args=OPTIONS) as browser:
        pages = Pages(browser)
        parts = [side_by_side] if COST else [side_by_side, reconnects, live]
        tables = [part(log, pages) for part in parts]
    for table in tables:
        publish(table)


if __name__ == "__main__":
    main()
