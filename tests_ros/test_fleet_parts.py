"""Parts of the fleet's nodes by themselves: any robot's name, threads that meet, a full disk, what cannot be told."""

import sys
import threading
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import rclpy
from rclpy.node import Node
from rclpy.validate_topic_name import validate_topic_name

from contourslam.config import Config, LiveConfig
from contourslam.errors import ConfigError, MessageError
from contourslam.fleet.facts import Answer
from contourslam.graph.slam import GraphSlam
from contourslam.live.diagnostics import Diagnostic, Level
from contourslam_ros import fleet_link
from contourslam_ros import slam as slam_node
from contourslam_ros.fleet_health import FleetHealth, State, Voice
from contourslam_ros.fleet_link import FleetLink
from contourslam_ros.fleet_maps import FleetMaps
from contourslam_ros.fleet_settings import FleetConfig
from contourslam_ros.fleet_topics import answers_to, in_topic
from contourslam_ros.live_node import LiveNode
from contourslam_ros.settings import NodeConfig

FOREIGN = "robot-1", "1a", "a.b", "9-.-9", "x" * 64


@pytest.fixture
def node(ros: None) -> Iterator[Node]:
    made = rclpy.create_node("parts_of_a_fleet")
    yield made
    made.destroy_node()


def answer(robot: str, run: int = 1) -> Answer:
    return Answer(robot, run, 1, (), 1, (robot,), 0, np.zeros(3), np.eye(3))


def told(found: tuple[Diagnostic, ...], name: str) -> Diagnostic:
    (one,) = [diagnostic for diagnostic in found if diagnostic.name == name]
    return one


def test_every_name_that_a_message_may_have_has_topics(node: Node) -> None:
    FleetMaps(node, FleetConfig()).offer([answer(robot) for robot in FOREIGN])
    ways = {f"/fleet/way/{in_topic(robot)}" for robot in FOREIGN}
    assert ways <= {name for name, _ in node.get_topic_names_and_types()}
    assert all(validate_topic_name(answers_to(robot)) for robot in FOREIGN)


def test_names_that_ros_knows_stay_as_they_are() -> None:
    assert [in_topic(name) for name in ("robot1", "a_b", "R2_d2")] == ["robot1", "a_b", "R2_d2"]


def test_the_diagnostics_are_asked_while_packets_come() -> None:
    health, ending, wrong = FleetHealth("/reports", 10.0), threading.Event(), []
    answers = tuple(answer("robot", run) for run in range(3))

    def hear() -> None:
        now = 0.0
        while not ending.is_set():
            now += 0.01
            health.hear(("robot", 0), 300, now)
            health.hear(("other", int(now)), 300, now)

    def ask() -> None:
        try:
            for _ in range(300):
                health.diagnostics(State(answers), [], 0.0)
        except RuntimeError as error:
            wrong.append(error)

    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        threads = [threading.Thread(target=hear), threading.Thread(target=ask)]
        for thread in threads:
            thread.start()
        threads[1].join()
        ending.set()
        threads[0].join()
    finally:
        sys.setswitchinterval(before)
    assert not wrong


def test_what_nobody_asks_for_is_forgotten() -> None:
    voice = Voice(0.0)
    for second in range(10_000):
        voice.hear(300, float(second))
    assert len(voice.sizes) < 20


def test_a_full_disk_is_told_of_until_a_report_is_kept() -> None:
    health = FleetHealth("/reports", 10.0)
    health.keep(5)
    health.fail("no space left")
    for _ in range(3):  # robots are answered, and nothing is kept
        health.keep(6)
        state = told(health.diagnostics(State(), [], 0.0), "messages")
        assert state.level is Level.ERROR
        assert "no space left" in state.message
    health.keep(7)
    assert told(health.diagnostics(State(), [], 0.0), "messages").level is Level.OK


def test_views_that_wait_and_that_were_given_up_are_told() -> None:
    health = FleetHealth("/reports", 10.0)
    assert told(health.diagnostics(State(waiting=12), [], 0.0), "search").values["waiting"] == "12"
    late = told(health.diagnostics(State(given_up=3), [], 0.0), "search")
    assert late.level is Level.WARN
    assert "sites" in late.message


def test_sites_are_read_and_what_names_none_is_refused() -> None:
    assert FleetConfig().sites_of_robots() == {}
    named = FleetConfig(sites="robot1:ground floor, robot-2:first")
    assert named.sites_of_robots() == {"robot1": "ground floor", "robot-2": "first"}
    for wrong in ("robot1", "robot1:", ":ground", "robot 1:ground", "robot1:ground,robot1:first"):
        with pytest.raises(ConfigError, match="parameter sites"):
            FleetConfig(sites=wrong)


@pytest.mark.parametrize("link", [None, "a link"])
def test_a_robot_rehearses_for_a_fleet_where_there_is_one(link: str | None, monkeypatch: pytest.MonkeyPatch) -> None:
    rehearsed: list[Config] = []
    monkeypatch.setattr(LiveNode, "warm_up", lambda node: None)
    monkeypatch.setattr(slam_node, "rehearse_robot", rehearsed.append)
    robot: Any = slam_node.Slam.__new__(slam_node.Slam)
    robot.link, robot.settings = link, SimpleNamespace(core=Config())
    robot.warm_up()
    assert rehearsed == [Config()] * (link is not None)


class Unsendable:
    """A reporter that once has something which cannot be sent, wherever it is asked."""

    waiting, settled, run, given_up, left_out = 0, True, 1, 0, 0

    def __init__(self, robot: str, *, period: float) -> None:
        self.asked: list[str] = []

    def _ask(self, what: str) -> list[bytes]:
        self.asked.append(what)
        if self.asked.count(what) == 1:
            raise MessageError("nan is no number that can be sent")
        return []

    def push(self, *given: object) -> None:
        self._ask("push")

    def flush(self, now: float) -> None:
        self._ask("flush")

    def due(self, now: float) -> list[bytes]:
        return self._ask("due")

    def placed(self) -> None:
        return None


def test_what_cannot_be_told_ends_neither_the_mapping_nor_the_fleet(
    node: Node, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(fleet_link, "Reporter", Unsendable)
    monkeypatch.setattr(fleet_link, "QUIET", -1.0)
    link = FleetLink(node, NodeConfig(fleet="robot"), LiveConfig())
    reporter: Any = link._reporter
    slam = GraphSlam(Config())
    session: Any = SimpleNamespace(inspect=lambda look: look(slam), map_version=0)
    scan: Any = SimpleNamespace(map_version=0, update=None, stamp=0.0)
    link.start()
    link.follow(session)
    node.create_subscription(fleet_link.FleetPacket, fleet_link.REPORTS, lambda message: None, fleet_link.QUALITY)
    assert link.diagnostic().level is Level.WARN  # no server
    for _ in range(2):
        link.take(scan)
        link.rest()
        link.finish()
    assert reporter.asked == ["push", "flush", "flush", "push", "flush", "flush"]
    while reporter.asked.count("due") < 2:
        rclpy.spin_once(node, timeout_sec=1.0)
    state = link.diagnostic()
    assert state.level is Level.ERROR
    assert "nan is no number" in state.message
    assert state.values["failures"] == "3"
