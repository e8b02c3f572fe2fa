"""What one page is sent, and when."""

import asyncio
import json
import time
from concurrent.futures import ThreadPoolExecutor

from websockets.sync.client import connect

from contourslam.view import spectator
from contourslam.view.own_time import counted
from contourslam.view.server import ViewServer
from contourslam.view.spectator import UNDRAWN


def page(server: ViewServer):
    return connect(server.url.replace("http:", "ws:") + "ws", max_size=None, compression=None)


def read_until(client, kind: str, fits=lambda message: True, seconds: float = 30.0) -> dict:
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        message = client.recv(timeout=seconds)
        head = json.loads(message[4 : 4 + int.from_bytes(message[:4], "little")])
        if head["kind"] == kind and fits(head):
            return head
    raise AssertionError(f"no such {kind} came")


def run(work):
    """Run it in a thread of its own: in this one a browser's loop may run."""
    with ThreadPoolExecutor(1) as pool:
        return pool.submit(asyncio.run, work).result()


def draw(client, index: int) -> None:
    client.send(json.dumps({"do": "drawn", "value": index}))


def test_a_page_that_had_not_drawn_when_a_new_map_began_gets_the_new_one(live) -> None:
    robot = live(60)
    robot.go(10)
    with ViewServer(robot.followed.show, lag=robot.followed.lag) as server, page(server) as client:
        number = read_until(client, "hello")["about"]["map"]
        for i in range(UNDRAWN):
            read_until(client, "frame", lambda f, i=i: f["index"] == 9 + i)  # a hello makes a page forget them
            robot.go(1)
        robot.session.reset()
        robot.go(1)
        assert read_until(client, "hello")["about"]["map"] == number + 1
        assert read_until(client, "frame")["index"] == 0
        draw(client, 10)  # said late, of the map before: it makes no room for another frame of this one
        for i in range(1, UNDRAWN):
            robot.go(1)
            assert read_until(client, "frame")["index"] == i
        robot.go(1)
        for _ in range(3):
            read_until(client, "status")
        robot.go(1)
        draw(client, UNDRAWN - 1)
        assert read_until(client, "frame")["index"] == UNDRAWN + 1  # and never the one before it


def test_a_page_whose_first_frame_was_dear_learns_how_all_is_before_the_next(live, monkeypatch) -> None:
    monkeypatch.setattr(spectator, "PERIOD", 1e6)
    monkeypatch.setattr(spectator, "LONGEST", 1e6)
    robot = live(20)
    robot.go(10)
    with ViewServer(robot.followed.show, lag=robot.followed.lag) as server, page(server) as client:
        read_until(client, "frame")
        for scans in (11, 12):
            robot.go(1)
            read_until(client, "status", lambda status, scans=scans: status["scans"] == scans)


def test_only_a_tasks_own_steps_count() -> None:
    now, spent = [0.0], []

    async def busy(seconds: float) -> None:
        now[0] += seconds

    async def own() -> None:
        await busy(1.0)
        await asyncio.sleep(0)
        await busy(2.0)

    async def both() -> None:
        await asyncio.gather(counted(own(), spent.append, lambda: now[0]), busy(100.0))

    run(both())
    assert sum(spent) == 3.0


def test_work_that_is_counted_fails_and_ends_as_work_that_is_not() -> None:
    ended = []

    async def own() -> None:
        try:
            await asyncio.sleep(60.0)
        finally:
            ended.append(True)

    async def cut_off() -> str:
        task = asyncio.ensure_future(_awaited(counted(own(), lambda seconds: None)))
        await asyncio.sleep(0)
        task.cancel()
        try:
            await task
        except asyncio.CancelledError:
            return "cancelled"
        return "went on"

    assert run(cut_off()) == "cancelled" and ended == [True]


async def _awaited(work) -> None:
    await work
