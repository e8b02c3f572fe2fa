"""The live page of the node slam, as a browser meets it."""

import http.client
import json
import re
import signal
import socket
import subprocess
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from observer import wait_for
from websockets.sync.client import ClientConnection, connect

from conftest import Processes


def free_port() -> int:
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        port: int = found.getsockname()[1]
        return port


def read_until(page: ClientConnection, kind: str, fits: Callable[[Any], object]) -> Any:
    """Read until a message fits, and say of each frame that it is drawn."""
    until = time.monotonic() + 120.0
    while time.monotonic() < until:
        message = page.recv(timeout=120)
        assert isinstance(message, bytes)
        head = json.loads(message[4 : 4 + int.from_bytes(message[:4], "little")])
        if head["kind"] == "frame":
            page.send(json.dumps({"do": "drawn", "value": head["index"]}))
        if head["kind"] == kind and fits(head):
            return head
    raise AssertionError(f"no such {kind} came")


@dataclass
class Started:
    """A node with a page."""

    port: int
    node: "subprocess.Popen[str]"
    log: Path


@pytest.fixture(scope="module")
def started(processes: Processes, tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, Started]]:
    """One that serves its page, and one whose port is taken; at the same time, for a node takes seconds to start."""
    found = {}
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        for name, port in {"watched": free_port(), "second": taken.getsockname()[1]}.items():
            log = tmp_path_factory.mktemp(name) / "log"
            host = "0.0.0.0" if name == "watched" else "127.0.0.1"
            node = processes.start("slam", namespace=name, log=log, view_port=port, view_host=host)
            found[name] = Started(port, node, log)
        yield found


def test_the_node_serves_its_page_to_those_who_have_the_link_that_it_logs(
    started: dict[str, Started], processes: Processes
) -> None:
    watched = started["watched"]
    port, node, log = watched.port, watched.node, watched.log
    wait_for(lambda: "the live page is at" in log.read_text() or node.poll() is not None, 200.0)
    link = re.search(rf"the live page is at http://[^/]+:{port}/([\w-]{{20,}})/", log.read_text())
    assert link is not None
    stranger = http.client.HTTPConnection("127.0.0.1", port, timeout=30)
    stranger.request("GET", "/")
    assert stranger.getresponse().status == 404
    stranger.close()
    with connect(f"ws://127.0.0.1:{port}/{link[1]}/ws", max_size=None) as page:
        about = read_until(page, "hello", lambda head: True)["about"]
        assert about["title"] == "watched/slam" and about["back_end"] == "graph" and about["live"]
        waiting = read_until(page, "status", lambda head: head["health"])
        assert waiting["state"] == "starting" and "no scan has come on /watched/scan" in waiting["health"][0]["message"]
        playing = processes.play(namespace="watched")
        about = read_until(page, "hello", lambda head: True)["about"]
        assert about["mount"] != [0.0, 0.0, 0.0]  # where the transforms have the lidar
        status = read_until(page, "status", lambda head: head["scans"] > 30)
        assert status["state"] == "live" and status["trouble"] == ""
        assert {row["name"] for row in status["health"]} >= {"scans", "odometry", "clock", "latency", "map"}
        assert read_until(page, "map", lambda head: True)["arrays"]["corner_ids"][2] > 0
        frame = read_until(page, "frame", lambda head: head["index"] > 30)
        assert frame["lanes"][0]["localized"] and frame["lanes"][0]["stages"]
        playing.kill()
        node.send_signal(signal.SIGINT)  # while the page is open
        assert node.wait(30.0) == 0


def test_a_port_that_is_taken_ends_the_node_with_a_line(started: dict[str, Started]) -> None:
    assert started["second"].node.wait(200.0) == 1
    said = [line for line in started["second"].log.read_text().splitlines() if "FATAL" in line]
    assert len(said) == 1 and "cannot be served" in said[0] and "another view_port" in said[0]
