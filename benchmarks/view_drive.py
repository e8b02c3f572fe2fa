"""A recording mapped in a process of its own, watched or not: give it the log, how many scans, the speed, and how.

"run" is the loop of ``contourslam run``, "alone" the player of the page without a server, and "served" the
same with one. It prints a line of JSON when it is ready, whose ``url`` is the page's; "go" on its standard input starts
it, "memory" asks for its resident memory, and "end" ends it, with the figures as the last line.
"""

import json
import sys
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from contourslam.cli.run import DEFAULTS
from contourslam.recordings import Message, open_recording
from contourslam.replay import make_mapper, replay
from contourslam.scan import LaserScan
from contourslam.slam.mapper import Mapper
from contourslam.view.lag import Lag
from contourslam.view.pace import Pace
from contourslam.view.replayed import Replayed
from contourslam.view.server import ViewServer

WARM_UP = 10_000  # messages, in which everything happens once


class Diary(Lag):
    """Keeps of each frame that a page has drawn when that was, and how far it was behind the mapping."""

    def __init__(self) -> None:
        super().__init__()
        self.rows: list[tuple[float, float]] = []

    def count(self, on_the_way: float, waited: float) -> None:
        """Count a frame, s."""
        super().count(on_the_way, waited)
        self.rows.append((time.monotonic(), on_the_way + waited))


def first_scans(log: Path, scans: int) -> tuple[list[Message], float]:
    """Read the beginning of a log; gives its length, s, too."""
    messages: list[Message] = []
    stamps: list[float] = []
    for message in open_recording(log).messages():
        messages.append(message)
        if isinstance(message, LaserScan):
            stamps.append(message.stamp)
            if len(stamps) == scans:
                break
    return messages, max(stamps) - stamps[0]


def memory() -> float:
    """Resident memory of this process, MB."""
    lines = Path("/proc/self/status").read_text().splitlines()
    (now,) = (line.split()[1] for line in lines if line.startswith("VmRSS"))
    return int(now) / 1000.0


def say(**values: Any) -> None:
    print(json.dumps(values), flush=True)


class Drive(threading.Thread):
    """Maps in its own thread, and learns what that takes."""

    def __init__(self, messages: Sequence[Message], duration: float, speed: float, how: str) -> None:
        super().__init__(name="drive")
        self._messages, self._watched = messages, how != "run"
        self.diary = Diary()
        self.replayed = Replayed(
            messages, DEFAULTS, title="benchmark", duration=duration, pace=Pace(speed), make=self._make
        )
        self.replayed.lag = self.diary
        self.began = self.cpu = self.wall = self.own = 0.0

    def run(self) -> None:
        """Map."""
        self.began, cpu = time.monotonic(), time.thread_time()
        if self._watched:
            self.replayed.player.run()
        else:
            replay(self._messages, DEFAULTS, make=self._make)
        self.wall, self.cpu = time.monotonic() - self.began, time.thread_time() - cpu

    def _make(self, *arguments: Any, **more: Any) -> Mapper:
        """Make a mapper whose own time is booked."""
        mapper = make_mapper(*arguments, **more)
        for name in ("push_odometry", "push_scan", "finish"):
            setattr(mapper, name, self._booked(getattr(mapper, name)))
        return mapper

    def _booked(self, work: Callable[..., Any]) -> Callable[..., Any]:
        def booked(*arguments: Any) -> Any:
            began = time.thread_time()
            result = work(*arguments)
            self.own += time.thread_time() - began
            return result

        return booked


def warm_up(messages: Sequence[Message]) -> None:
    """Load kernels and libraries."""
    beginning = Replayed(messages[:WARM_UP], DEFAULTS, title="warm-up", pace=Pace(float("inf")))
    beginning.player.run()
    newest = beginning.show.memory.newest
    assert newest is not None
    beginning.show.painter.paint(newest, 0)


def main() -> None:
    log, scans, speed, how = Path(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3]), sys.argv[4]
    messages, duration = first_scans(log, scans)
    warm_up(messages)
    drive = Drive(messages, duration, speed, how)
    with ExitStack() as stack:
        url = ""
        if how == "served":
            url = stack.enter_context(ViewServer(drive.replayed.show, lag=drive.diary)).url
        say(url=url)
        process_began = 0.0
        for line in sys.stdin:
            if line.strip() == "go":
                process_began = time.process_time()
                drive.start()
            elif line.strip() == "memory":
                say(memory=memory(), mapped=not drive.is_alive())
            else:
                break
        drive.join()
        process = time.process_time() - process_began
    rows = [(at - drive.began, lag) for at, lag in drive.diary.rows]
    say(own=drive.own, cpu=drive.cpu, wall=drive.wall, process=process, memory=memory(), duration=duration, rows=rows)


if __name__ == "__main__":
    main()
