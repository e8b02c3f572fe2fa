"""The server as any client meets it, with real sockets."""

import asyncio
import http.client
import json
import socket
import threading
import time
from contextlib import ExitStack, closing
from urllib.parse import urlsplit

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from contourslam.view.access import is_loopback
from contourslam.view.lag import Lag
from contourslam.view.memory import Memory
from contourslam.view.pace import Pace
from contourslam.view.server import ServeError, ViewServer


def fetch(server: ViewServer, path: str = "/", **headers: str) -> http.client.HTTPResponse:
    with closing(http.client.HTTPConnection("127.0.0.1", server.port, timeout=30)) as connection:
        connection.request("GET", path, headers=headers)
        response = connection.getresponse()
        response.content = response.read()
        return response


def page(server: ViewServer, **more):
    return connect(server.url.replace("http:", "ws:") + "ws", max_size=None, compression=None, **more)


def read(client) -> dict:
    message = client.recv(timeout=60)
    return json.loads(message[4 : 4 + int.from_bytes(message[:4], "little")])


def read_until(client, kind: str, fits=lambda message: True) -> dict:
    """Read until a message fits, and say of each frame that it is drawn."""
    end = time.monotonic() + 60.0
    while time.monotonic() < end:
        message = read(client)
        if message["kind"] == "frame":
            client.send(json.dumps({"do": "drawn", "value": message["index"]}))
        if message["kind"] == kind and fits(message):
            return message
    raise AssertionError(f"no such {kind} came")


def ask(client, do: str, value=None, **more) -> None:
    client.send(json.dumps({"do": do, "value": value, **more}))


def test_the_page_has_all_its_files_and_may_load_nothing_else(served) -> None:
    _, server = served(3)
    found = fetch(server)
    assert found.status == 200
    assert "default-src 'none'" in found.headers["Content-Security-Policy"]
    assert "http" not in found.headers["Content-Security-Policy"]
    text = found.content.decode()
    assert "http" not in text
    for name in ("main.js", "style.css", "icon.svg"):
        assert f'"{name}"' in text
        file = fetch(server, "/" + name)
        assert file.status == 200
        assert file.headers["X-Content-Type-Options"] == "nosniff"
        assert b"://" not in file.content.replace(b"http://www.w3.org/2000/svg", b"")


@pytest.mark.parametrize(
    "path", ["/../server.py", "/page/main.js", "/..%2f..%2fetc/passwd", "/main.py", "//etc/passwd"]
)
def test_nothing_but_the_page_can_be_had(served, path: str) -> None:
    _, server = served(3)
    assert fetch(server, path).status == 404


def test_a_page_of_another_site_gets_nothing(served) -> None:
    _, server = served(3)
    assert fetch(server, Host="evil.example").status == 403
    for more in ({"origin": "http://evil.example"}, {"additional_headers": {"Host": "evil.example"}}):
        with pytest.raises((InvalidStatus, ConnectionClosed)) as refused, page(server, **more):
            pass
        assert "403" in str(refused.value) or isinstance(refused.value, ConnectionClosed)


def test_beyond_this_machine_the_link_has_a_secret(served) -> None:
    _, server = served(3, host="0.0.0.0", secret=True)
    assert fetch(server).status == 404
    assert fetch(server, "/main.js").status == 404
    secret = "/" + server.url.split("/")[3] + "/"
    assert len(secret) > 20
    assert not is_loopback(urlsplit(server.url).hostname or "")  # a link for others
    assert fetch(server, secret, Host="robot.local").status == 200
    for host in (urlsplit(server.url).netloc, f"127.0.0.1:{server.port}"):
        assert fetch(server, secret, Host=host).status == 200
        way = socket.create_connection(("127.0.0.1", server.port))
        with connect(f"ws://{host}{secret}ws", sock=way, origin=f"http://{host}", max_size=None) as client:
            assert read(client)["kind"] == "hello"
    with pytest.raises(InvalidStatus), connect(f"ws://127.0.0.1:{server.port}/ws"):
        pass


def test_what_is_no_request_ends_the_connection_and_nothing_else(served) -> None:
    _, server = served(3)
    for nonsense in ("{", json.dumps({"do": "quit"}), b"\x00\xff", "x" * 5000):
        with page(server) as client, pytest.raises(ConnectionClosed):
            client.send(nonsense)
            while True:
                client.recv(timeout=30)
    with page(server) as client:
        assert read(client)["kind"] == "hello"


def test_a_page_that_comes_late_gets_everything_at_once(served, until) -> None:
    one, server = served(40, ("matched_filter", "wu"))
    until(lambda: one.player.state == "finished")
    with page(server) as client:
        assert read(client)["about"]["lanes"] == ["matched_filter", "wu"]
        knots = read_until(client, "knots")
        assert (knots["first"], knots["count"]) == (0, len(one.show.memory.knots(0)))
        assert {read_until(client, "map")["lane"] for _ in range(2)} == {0, 1}
        frame = read_until(client, "frame")
        assert frame["index"] == 39
        assert frame["truth"] is not None
        for name in ("points", "curve_0", "response_1", "corners_1", "seen_ids_0"):
            assert frame["arrays"][name][2] > 0
        status = read_until(client, "status", lambda s: s["lag"]["median"] is not None or s["pages"] == 1)
        assert status["state"] == "finished"


def test_time_can_be_drawn_back_stepped_and_followed_again(served) -> None:
    one, server = served(40, pace=Pace(2000.0))
    with page(server) as client:
        read_until(client, "frame", lambda f: f["index"] == 39)
        ask(client, "pause")
        ask(client, "seek", 2.05)
        assert read_until(client, "frame")["index"] == 10
        ask(client, "step", 1)
        assert read_until(client, "frame")["index"] == 11
        ask(client, "step", -10)
        assert read_until(client, "frame")["index"] == 1
        ask(client, "follow")
        assert read_until(client, "frame")["index"] == 39
        ask(client, "speed", 5)
        assert read_until(client, "status", lambda s: s["speed"] == 5.0)["paused"]
        ids = [lane.mapper.corner_map().ids for lane in one.player.lanes]
        ask(client, "story", int(ids[0][0]), lane=0)
        assert len(read_until(client, "story")["times"]) > 0


def test_a_page_that_stops_reading_holds_up_nobody_and_fills_no_memory(served, until) -> None:
    one, server = served(500, pace=Pace(20.0))  # some seconds, so that a busy machine draws several frames too
    with page(server, max_queue=1, close_timeout=0.2) as asleep, page(server) as awake:
        read(asleep)  # hello, and never again
        frames = 0
        until(lambda: one.show.memory.newest)
        while one.show.memory.newest.index < 450:
            frames += read_until(awake, "frame")["index"] >= 0
        assert frames > 5
        assert server._lag.pages == 2
        until(lambda: one.player.state == "finished")


def test_a_hundred_pages_come_and_go_and_leave_nothing_behind(served, until) -> None:
    one, server = served(40)
    until(lambda: one.player.state == "finished")
    before = threading.active_count()
    for i in range(100):
        with page(server) as client:
            if i % 2:
                read(client)
            else:
                client.socket.shutdown(socket.SHUT_RDWR)  # as if the cable were pulled
    until(lambda: server._lag.pages == 0, 30.0)
    assert len(asyncio.all_tasks(server._loop)) <= 6
    until(lambda: threading.active_count() <= before, 30.0)


def test_the_server_ends_at_once_whatever_the_pages_do(replayed) -> None:
    one = replayed(40)
    one.player.start()
    with ExitStack() as clients:
        with ViewServer(one.show, lag=one.lag) as server:
            for _ in range(3):
                clients.enter_context(page(server))
            port, began = server.port, time.monotonic()
        assert time.monotonic() - began < 10.0
    with ViewServer(one.show, port=port):  # the port is free again
        pass


def test_a_port_that_is_taken_is_a_known_failure(replayed) -> None:
    one = replayed(3)
    with (
        ViewServer(one.show) as server,
        pytest.raises(ServeError, match=rf"cannot be served at 127\.0\.0\.1, port {server.port} \(.*in use"),
        ViewServer(one.show, port=server.port),
    ):
        pass


def test_a_host_that_is_none_is_a_known_failure(replayed) -> None:
    with pytest.raises(ServeError, match=r"served at a\.\.b"), ViewServer(replayed(3).show, host="a..b"):
        pass


def test_lag_is_from_the_pose_to_the_picture() -> None:
    lag = Lag()
    assert lag.summary() == {"median": None, "most": None}
    for waited in (0.01, 0.02, 0.03):
        lag.count(0.1, waited)
    assert lag.summary() == {"median": pytest.approx(120.0), "most": pytest.approx(130.0)}


def test_where_the_way_is_thinned_out_a_page_gets_it_anew(served) -> None:
    one, server = served(40, memory=Memory(1, knots=5), pace=Pace(40.0))
    one.show.memory.add_event(0.0, "trouble", "early")
    hellos = count = 0
    told: list[str] = []
    with page(server) as client:
        while True:
            message = read(client)
            if message["kind"] == "hello":
                hellos, count, told = hellos + 1, 0, []
            elif message["kind"] == "status":
                told += [event["text"] for event in message["events"]]
            elif message["kind"] == "knots":
                assert message["first"] == count
                count += message["count"]
            elif message["kind"] == "frame":
                ask(client, "drawn", message["index"])
                if message["index"] == 39:
                    break
    assert hellos >= 2
    assert told.count("early") == 1  # a page forgets what happened, too
    assert message["knots"] == count == len(one.show.memory.knots(0)) <= 5
