"""A live session that is watched, on a clock of its own."""

import json
import time
from contextlib import ExitStack
from dataclasses import replace
from importlib.util import find_spec

import numpy as np
import pytest
from websockets.sync.client import connect

from contourslam.config import Config, LiveConfig, SlamConfig
from contourslam.live.diagnostics import Diagnostic, Level
from contourslam.live.start import localization, mapping
from contourslam.live.worker import Worker
from contourslam.replay import replay
from contourslam.scan import LaserScan, Odometry
from contourslam.view.followed import Followed
from contourslam.view.health import PERIOD, QUIET, Health
from contourslam.view.memory import Memory
from contourslam.view.server import ViewServer

SETTINGS = Config(back_end="ekf", slam=SlamConfig(walls=True, contour_matching=True))
GRAPH = pytest.mark.skipif(find_spec("gtsam") is None, reason="no GTSAM")
BACK_ENDS = ["ekf", pytest.param("graph", marks=GRAPH)]


def happened(followed) -> list[str]:
    return [event["text"] for event in followed.show.memory.events(0)[1]]


@pytest.mark.parametrize("back_end", BACK_ENDS)
def test_a_watched_robot_has_the_poses_and_the_map_of_one_that_nobody_watches(back_end, drive, live) -> None:
    config = Config(back_end=back_end)
    robot = live(40, config=config)
    robot.go(40)
    known = replay(drive(40), config, initial_pose=np.zeros(3))
    poses = known.poses if known.online_poses is None else known.online_poses
    memory = robot.followed.show.memory
    assert memory.newest.index == 39
    for i in range(40):
        moment = memory.beside(memory.newest, i - 39)
        np.testing.assert_array_equal(moment.lanes[0].update.pose, poses[i])
        np.testing.assert_allclose(moment.odometry, known.odometry[i], atol=1e-9)
        assert moment.lanes[0].localized and moment.truth is None
    assert dict(moment.lanes[0].stages)["contour"] > 0.0
    assert memory.map_at(0, 1e9) is not None
    # Drawn while no scan waits, as the map was then; nothing that is drawn changes it.
    arrays = robot.followed._lane.draw(memory.knot_scans())
    ids = robot.session.corner_map().ids
    assert arrays["corner_ids"].tolist() == ids.tolist() and len(ids) >= 4


def test_a_corner_of_a_robot_has_a_story(live) -> None:
    robot = live(40)
    robot.go(40)
    corners = robot.session.corner_map()
    story = robot.followed.show.story(0, int(corners.ids[np.argmax(corners.observed)]))
    assert story["what"].count(1) > 5
    assert list(story["times"]) == sorted(story["times"]) and story["times"][-1] < 8.0
    assert robot.followed.show.story(0, 10**6)["times"] == ()


def test_it_says_how_the_robot_is_and_what_to_do(live) -> None:
    battery = Diagnostic(Level.WARN, "base", "the battery is low: charge it", {"battery (V)": "6.50"})
    more: list[Diagnostic] = [replace(battery, level=Level.OK, message="driving")]
    robot = live(30, health=lambda: more)
    status = robot.followed.show.status()
    assert status["state"] == "starting" and status["trouble"] == ""
    assert "waiting for the first scan" in status["health"][0]["message"]
    robot.go(20)
    status = robot.followed.show.status()
    assert status["state"] == "live" and status["scans"] == 20
    assert {row["name"] for row in status["health"]} == {
        "scans", "odometry", "clock", "latency", "map", "consistency", "saving", "base"
    }  # fmt: skip
    assert all(row["level"] == "ok" for row in status["health"])
    assert status["health"][0]["message"] == "5.0 scans a second"
    more[0] = battery
    robot.wait(4.4)
    status = robot.followed.show.status()
    rows = {row["name"]: row for row in status["health"]}
    assert rows["scans"]["level"] == "error" and "is the lidar's driver running" in rows["scans"]["message"]
    assert rows["base"]["level"] == "warning" and rows["base"]["values"] == {"battery (V)": "6.50"}
    assert "no scan for 4.4 s" in status["trouble"] and "battery" not in status["trouble"]
    robot.wait(3.0)
    assert "no scan for 4.4 s" in robot.followed.show.status()["trouble"]  # it would be read out again and again
    assert status["head"] > robot.followed.show.memory.newest.elapsed  # time goes on
    told = happened(robot.followed)
    assert sum("no scan" in text for text in told) == 1 and "base: the battery is low: charge it" in told


def test_what_is_well_again_is_told() -> None:
    now, told = [0.0], []
    rows = [Diagnostic(Level.OK, "scans", "7.0 scans a second")]
    health = Health(lambda: rows, lambda what, text: told.append((what, text)), lambda: now[0])
    health.look()
    rows[0] = Diagnostic(Level.WARN, "scans", "3 scans lost")
    health.look()
    assert told == []  # asked twice a second, however many pages there are
    now[0] += PERIOD
    health.look()
    now[0] += PERIOD
    rows[0] = Diagnostic(Level.WARN, "scans", "4 scans lost")
    health.look()
    now[0] += PERIOD
    rows[0] = Diagnostic(Level.OK, "scans", "7.0 scans a second")
    health.look()
    now[0] += QUIET
    health.look()
    assert told == [("trouble", "scans: 3 scans lost"), ("well", "scans: well again")]


def test_what_comes_and_goes_is_told_once() -> None:
    now, told = [0.0], []
    rows = [Diagnostic(Level.OK, "base", "0.30 m/s")]
    health = Health(lambda: rows, lambda what, text: told.append((what, text)), lambda: now[0])
    for i in range(60):
        now[0] += PERIOD
        rows[0] = Diagnostic((Level.OK, Level.WARN, Level.ERROR, Level.WARN)[i % 4], "base", f"look {i}")
        health.look()
    assert told == [("trouble", "base: look 1"), ("trouble", "base: look 2")]
    rows[0] = Diagnostic(Level.WARN, "base", "less")
    until = now[0] + 3.0 * QUIET
    while now[0] < until:
        now[0] += PERIOD
        health.look()
    assert told[2:] == [("trouble", "base: less")] and health.trouble == ""


def test_a_new_map_begins_the_page_anew_and_time_goes_on(live) -> None:
    robot = live(40)
    robot.go(20)
    memory, epoch = robot.followed.show.memory, robot.followed.show.memory.epoch
    before = memory.newest.elapsed
    robot.session.reset()
    assert memory.newest is not None  # until there is something of the new map to be seen
    robot.go(10)
    assert memory.epoch == epoch + 1
    assert memory.newest.index == 9 and memory.newest.elapsed > before
    assert memory.at(0.0).elapsed > before
    assert memory.knots(0)[0].index == 0
    assert "another map is begun" in happened(robot.followed)


def test_a_scan_of_a_map_that_was_left_meanwhile_is_passed_over(live) -> None:
    robot = live(10)
    robot.go(5)
    take, late = robot.followed.take, []
    robot.followed.take = late.append
    robot.go(1)
    robot.session.reset()
    take(late[0])
    assert robot.followed.error is None
    assert robot.followed.show.memory.newest.index == 4


@GRAPH
def test_a_robot_that_is_looked_for_says_so_and_draws_nothing_into_the_map(drive, live, tmp_path) -> None:
    config = Config(back_end="graph")
    first = mapping(config, LiveConfig())
    mapped = live(60, session=first, config=config)
    mapped.go(60)
    first.save(tmp_path / "room.cmap")
    found = localization(config, LiveConfig(), tmp_path / "room.cmap", clock=lambda: 0.0)
    robot = live(60, session=found, config=config, back_end="localisation")
    robot.go(1)
    memory = robot.followed.show.memory
    assert robot.followed.show.status()["state"] == "lost"
    assert memory.newest is not None and memory.knots(0) == []
    robot.go(59)
    assert robot.followed.show.status()["state"] == "live"
    assert len(memory.knots(0)) > 3
    assert len(robot.session.corner_map().ids) == len(first.corner_map().ids)
    assert robot.followed.show.about["back_end"] == "localisation"


def test_what_goes_wrong_in_the_page_does_not_end_the_mapping(live, monkeypatch) -> None:
    robot = live(20)
    robot.go(5)
    monkeypatch.setattr(robot.followed._keeper, "keep", lambda *_: 1 / 0)
    robot.go(10)
    assert isinstance(robot.followed.error, ZeroDivisionError)
    status = robot.followed.show.status()
    assert status["state"] == "failed" and "no more news" in status["trouble"]
    assert len(robot.session.corner_map().ids) >= 4


def test_over_hours_what_is_kept_stays_within_its_bounds(live) -> None:
    memory = Memory(1, moments=200_000, maps=40_000, knots=20)
    robot = live(400, memory=memory)
    robot.go(400)
    assert memory._bytes <= 200_000 and memory._map_bytes <= 40_000 and len(memory.knots(0)) <= 20
    assert memory.at(0.0).elapsed < 2.0 and memory.newest.index == 399
    assert robot.followed.show.status()["scans"] == 400


def test_a_page_that_stops_reading_costs_the_mapping_nothing(drive) -> None:
    followed = Followed(SETTINGS, title="robot")
    session = mapping(SETTINGS, LiveConfig(max_waiting=1000), clock=time.monotonic)
    followed.follow(session, np.zeros(3))
    done: list[float] = []
    failed: list[BaseException] = []
    worker = Worker(
        session, lambda p: done.append(p.stamp), clock=time.monotonic, failed=failed.append, onlooker=followed
    )
    with ViewServer(followed.show, lag=followed.lag) as server, ExitStack() as stack:
        url = server.url.replace("http:", "ws:") + "ws"
        asleep = stack.enter_context(connect(url, max_size=None, max_queue=1, close_timeout=0.2))
        awake = stack.enter_context(connect(url, max_size=None))
        asleep.recv(timeout=60)  # and never again
        worker.start()
        for message in drive(300):
            if isinstance(message, LaserScan):
                worker.push_scan(message)
            elif isinstance(message, Odometry):
                worker.push_odometry(message)
        kinds: set[str] = set()
        while not ({"frame", "map"} <= kinds and len(done) == 300):
            head = read(awake.recv(timeout=60))
            kinds.add(head["kind"])
            if head["kind"] == "frame":
                awake.send(json.dumps({"do": "drawn", "value": head["index"]}))
        assert followed.lag.pages == 2
        worker.stop()
    assert failed == [] and followed.error is None
    assert followed.show.status()["scans"] == 300


def read(message: bytes) -> dict:
    return json.loads(message[4 : 4 + int.from_bytes(message[:4], "little")])
