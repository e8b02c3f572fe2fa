"""The server that joins what robots tell."""

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from contourslam.cli.run import DEFAULTS
from contourslam.contour.contours import Floats
from contourslam.evaluation.errors import fit
from contourslam.evaluation.fleet import rmse
from contourslam.fleet.facts import Answer
from contourslam.fleet.inbox import Inbox
from contourslam.fleet.reporter import Reporter
from contourslam.fleet.server import FleetServer
from contourslam.fleet.shared import Shared
from contourslam.geometry.poses import interpolate
from contourslam.graph import GraphSlam
from contourslam.scan import LaserScan, Odometry, TruePose
from contourslam.simulation.buildings import office_building
from contourslam.simulation.long_drive import LongDrive


@dataclass(frozen=True)
class Drive:
    """What a robot told of a drive, with the time of each message, and where it truly was."""

    name: str
    told: tuple[tuple[float, bytes], ...]
    truth: Floats
    """Rows of stamp, x, y, heading."""

    def true(self, stamps: Floats) -> Floats:
        return interpolate(self.truth[:, 0], self.truth[:, 1:], stamps)


def driven(name: str, building: int, seed: int, begin: float, length: float) -> Drive:
    """Map a drive through a building, from some way after its begin on."""
    drive = LongDrive(office_building(2, building), begin + length, seed)
    slam, reporter = GraphSlam(DEFAULTS, lidar_mount=drive.lidar_mount), Reporter(name, lambda: seed, rate=1e9)
    told: list[tuple[float, bytes]] = []
    truth, since, heard = [], begin / drive.speed, Inbox()

    def tell(now: float) -> None:
        for data in reporter.due(now):
            told.append((now - since, data))
            heard.take(data)
        heard.settle()  # whoever is not answered tells no more after a while
        received, missing = heard.state((name, seed))
        reporter.answered(Answer(name, seed, received, missing, -1, (name,), -1, np.zeros(3), np.zeros((3, 3))))

    for message in drive.messages():
        if message.stamp < since:
            continue
        if isinstance(message, TruePose):
            truth.append((message.stamp, *message.pose))
        elif isinstance(message, Odometry):
            slam.push_odometry(message)
        else:
            assert isinstance(message, LaserScan)
            reporter.push(slam, slam.push_scan(message), message.stamp)
            tell(message.stamp)
    reporter.flush(message.stamp)
    tell(message.stamp + 1.0)
    return Drive(name, tuple(told), np.array(truth))


@pytest.fixture(scope="module")
def together() -> tuple[Drive, Drive]:
    """Two robots in one building, that begin apart."""
    return driven("one", 4, 1, 0.0, 45.0), driven("two", 4, 2, 25.0, 45.0)


@pytest.fixture(scope="module")
def elsewhere() -> Drive:
    """One in another building of the same kind."""
    return driven("three", 7, 3, 0.0, 30.0)


def merged(drives: Iterable[Drive]) -> list[tuple[float, bytes]]:
    return sorted((row for drive in drives for row in drive.told), key=lambda row: row[0])


def run(server: FleetServer, messages: Iterable[tuple[float, bytes]]) -> None:
    due = 0.0
    for now, data in messages:
        server.push(data)
        if now >= due:
            server.tick(now)
            due = now + 0.5
    server.flush(1e6)
    server.answers()  # lets go of the files


def errors(shared: Shared, drives: Iterable[Drive]) -> dict[str, float]:
    """RMSE of each robot's keyframes after one rigid motion for all, m."""
    assert shared.saved.keyframes is not None
    by_name = {drive.name: drive for drive in drives}
    ends = np.cumsum([0, *shared.counts])
    names = [name for name, _ in shared.members]
    poses = [frames for _, _, frames in shared.frames()]
    stamps = [shared.saved.keyframes.stamps[a:b] for a, b in pairwise(ends)]
    truth = [by_name[name].true(own) for name, own in zip(names, stamps, strict=True)]
    motion = fit(*(np.concatenate(ways)[:, :2] for ways in (poses, truth)))
    return {name: rmse(p, q, motion) for name, p, q in zip(names, poses, truth, strict=True)}


def laid(shared: Shared) -> dict[str, Floats]:
    """Ways of the robots as seen from the first keyframe of one of them, whatever the frame of the map."""
    from contourslam.geometry.poses import between

    frames = {name: poses for (name, _), _, poses in shared.frames()}
    return {name: between(frames["one"][0], poses) for name, poses in frames.items()}


@pytest.fixture(scope="module")
def joined(together: tuple[Drive, Drive]) -> Shared:
    server = FleetServer()
    run(server, merged(together))
    (shared,) = server.settle()
    return shared


def test_two_robots_in_one_building_share_a_map_that_is_true_for_both(
    joined: Shared, together: tuple[Drive, Drive]
) -> None:
    assert {name for name, _ in joined.members} == {"one", "two"}
    assert max(errors(joined, together).values()) < 0.02
    (event,) = joined.joined
    assert (event.members, event.joining) == (("one",), ("two",))
    assert event.joint.evidence.agreeing > 15.0


def test_messages_in_any_order_lost_once_and_repeated_give_the_same_map(
    joined: Shared, together: tuple[Drive, Drive]
) -> None:
    chance = np.random.default_rng(0)
    messages = []
    for now, data in merged(together):
        lost = 10.0 if chance.random() < 0.2 else 0.0  # is told again later
        times = 1 + (chance.random() < 0.2)
        messages += [(now + lost + 5.0 * chance.random(), data) for _ in range(times)]
    server = FleetServer()
    run(server, sorted(messages, key=lambda row: row[0]))
    (shared,) = server.settle()
    assert sum(shared.counts) == sum(joined.counts)
    assert [answer.missing for answer in server.answers()] == [(), ()]
    for name, way in laid(shared).items():
        np.testing.assert_allclose(way[:, :2], laid(joined)[name][:, :2], atol=0.01)


def test_a_server_that_starts_anew_loses_nothing_and_doubles_nothing(
    joined: Shared, together: tuple[Drive, Drive], tmp_path: Path
) -> None:
    messages = merged(together)
    half = len(messages) // 2
    inbox = Inbox(tmp_path)
    first = FleetServer(inbox=inbox)
    for now, data in messages[:half]:
        first.push(data)
        first.tick(now)
    acknowledged = {(answer.robot, answer.received) for answer in first.answers()}
    inbox.close()
    inbox = Inbox(tmp_path)
    second = FleetServer(inbox=inbox)
    assert {(answer.robot, answer.received) for answer in second.answers()} == acknowledged
    run(second, messages[half - 20 :])  # some that were acknowledged come again
    (shared,) = second.settle()
    assert sum(shared.counts) == sum(joined.counts)
    for name, way in laid(shared).items():
        np.testing.assert_allclose(way[:, :2], laid(joined)[name][:, :2], atol=0.01)
    (event,) = second.joined()
    inbox.close()
    third = FleetServer(inbox=Inbox(tmp_path))
    third.tick(0.0)
    (again,) = third.joined()  # and is there at once, without a search
    assert (again.at, again.kept, again.gone, again.joint.evidence, third.search.looks) == (
        event.at, event.kept, event.gone, event.joint.evidence, 0,
    )  # fmt: skip
    (shared,) = third.common_maps()
    assert shared.number == event.kept
    assert max(errors(shared, together).values()) < 0.02


def test_unrelated_buildings_are_never_joined_and_each_robot_there_has_its_own_frame(
    together: tuple[Drive, Drive], elsewhere: Drive
) -> None:
    server = FleetServer()
    run(server, merged([together[0], elsewhere]))
    assert server.joined() == ()
    assert server.search.looks > 0
    answers = {answer.robot: answer for answer in server.answers()}
    assert answers["one"].common != answers["three"].common
    for shared in server.common_maps():
        ((name, _),) = shared.members
        assert answers[name].members == (name,)
        ((_, _, frames),) = shared.frames()
        np.testing.assert_allclose(frames[0], 0.0, atol=1e-6)
        assert np.linalg.eigvalsh(answers[name].covariance).min() > 0.0


def test_robots_of_different_sites_are_never_compared(together: tuple[Drive, Drive]) -> None:
    server = FleetServer(sites={"one": "ground floor", "two": "first floor"})
    run(server, merged(together))
    assert server.search.looks == 0
    assert len(server.common_maps()) == 2


def test_a_robot_that_starts_anew_is_joined_with_its_own_run_of_before(together: tuple[Drive, Drive]) -> None:
    again = driven("one", 4, 11, 10.0, 20.0)
    server = FleetServer()
    run(server, [*together[0].told, *((now + 100.0, data) for now, data in again.told)])
    (shared,) = server.common_maps()
    assert [name for name, _ in shared.members] == ["one", "one"]
    assert len({number for _, number in shared.members}) == 2


def test_what_no_keyframe_is_behind_is_told_as_a_fault_and_left_out(together: tuple[Drive, Drive]) -> None:
    from contourslam.fleet.facts import RelationFact, Report
    from contourslam.fleet.wire import encode

    server = FleetServer()
    wrong = RelationFact(3, 4, np.zeros(3), np.eye(3), float("nan"), False)
    server.push(encode(Report("three", 5, 0, (wrong,))))
    server.tick(0.0)
    assert [fault.robot for fault in server.faults()] == ["three"]
    assert "keyframe" in server.faults()[0].text
    assert server.common_maps() == ()
    run(server, together[0].told)  # whose map is not compared with nothing
    assert [shared.members[0][0] for shared in server.common_maps()] == ["one"]
