"""The robot's side: everything of a graph is told once and in order, no faster than may be, and places the robot."""

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from contourslam.config import Config
from contourslam.geometry.poses import between_one, compose, compose_one
from contourslam.scan import LaserScan, Odometry, TruePose

pytest.importorskip("gtsam", reason="needs the extra 'graph'")
pytest.importorskip("shapely", reason="needs the extra 'simulation'")

from contourslam.fleet import reporter as module
from contourslam.fleet.facts import Answer, Fact, KeyframeFact, RelationFact, Report, Status, StretchFact
from contourslam.fleet.inbox import Inbox
from contourslam.fleet.reporter import Reporter
from contourslam.fleet.reporter_facts import News
from contourslam.fleet.reporter_outbox import OVERHEAD, PATIENCE, WINDOW, Allowance, Outbox
from contourslam.fleet.wire import decode, encode
from contourslam.graph import GraphSlam, kept, resume
from contourslam.matching.align import align
from contourslam.matching.cell_map import CellMap
from contourslam.matching.certainty import hold
from contourslam.simulation.long_drive import building_drive

Floats = NDArray[np.float64]
CONFIG = Config(back_end="graph")
LENGTH, SEED = 60.0, 0
MOUNT = building_drive(LENGTH, SEED).lidar_mount
SHIFT = np.array([7.0, -3.0, 1.1])


@cache
def messages() -> tuple[LaserScan | Odometry | TruePose, ...]:
    return tuple(building_drive(LENGTH, SEED).messages())


def feed(slam: GraphSlam, reporter: Reporter, part: Sequence[object]) -> None:
    for message in part:
        if isinstance(message, Odometry):
            slam.push_odometry(message)
        elif isinstance(message, LaserScan):
            reporter.push(slam, slam.push_scan(message), message.stamp)


def answer(reporter: Reporter, received: int, keyframe: int = -1, pose: Floats = SHIFT) -> Answer:
    spread = np.diag([0.02**2, 0.03**2, 0.01**2])
    return Answer(reporter.robot, reporter.run or 0, received, (), 1, (reporter.robot,), keyframe, pose, spread)


def told(reporter: Reporter) -> dict[int, list[Fact]]:
    """All that is sent once the server hears, by run, in order."""
    runs: dict[int, list[Fact]] = {}
    counts: dict[int, int] = {}
    now = 1e6
    while not reporter.settled:
        now += 1e3
        for data in reporter.due(now):
            message = decode(data)
            if isinstance(message, Report):
                assert message.number == counts.get(message.run, 0)
                counts[message.run] = message.number + 1
                runs.setdefault(message.run, []).extend(message.facts)
        for run, count in counts.items():
            reporter.answered(Answer(reporter.robot, run, count, (), 1, (), -1, np.zeros(3), np.eye(3)))
    return runs


@cache
def driven() -> tuple[GraphSlam, list[Fact]]:
    """A whole drive, and what was told of it."""
    slam, reporter = GraphSlam(CONFIG, lidar_mount=MOUNT), Reporter("robot1")
    feed(slam, reporter, messages())
    reporter.flush(1e6)
    (facts,) = told(reporter).values()
    return slam, facts


def assert_all_told(slam: GraphSlam, facts: list[Fact]) -> None:
    memory = slam.memory
    keyframes = [fact for fact in facts if isinstance(fact, KeyframeFact)]
    assert [fact.number for fact in keyframes] == list(range(len(memory.keyframes)))
    sightings = memory.landmarks.sightings
    for fact, keyframe in zip(keyframes, memory.keyframes, strict=True):
        assert len(fact.points) == len(keyframe.oriented)
        assert len(fact.seen) == np.sum(sightings.keys[: sightings.count] == fact.number)
        assert abs(fact.stamp - keyframe.stamp) < 1e-6
        assert fact.drive == keyframe.drive
    known = 0
    for fact in facts:
        if isinstance(fact, KeyframeFact):
            known = fact.number
        elif isinstance(fact, RelationFact):
            assert max(fact.first, fact.second) <= known
        else:
            assert max(fact.anchor, *fact.members) <= known


def test_everything_in_the_graph_is_told_once_and_in_order() -> None:
    slam, facts = driven()
    assert_all_told(slam, facts)
    relations = [fact for fact in facts if isinstance(fact, RelationFact)]
    assert sum(not fact.tie for fact in relations) == slam.memory.graph.factors.size()
    assert sum(fact.tie for fact in relations) == slam.memory.graph.ties.size()
    stretches = [(fact.anchor, fact.members) for fact in facts if isinstance(fact, StretchFact)]
    assert stretches == [(place.anchor, place.members) for place in slam.memory.places.list]


def test_alignments_to_contours_that_were_told_are_those_to_the_graphs_own() -> None:
    slam, facts = driven()
    contours = [np.asarray(fact.points, np.float64) for fact in facts if isinstance(fact, KeyframeFact)]
    own = [np.asarray(keyframe.oriented, np.float64) for keyframe in slam.memory.keyframes]
    prior, off, ratios = np.diag([400.0, 400.0, 3000.0]), [], []
    for place in slam.memory.places.list:
        key = place.members[-1] + 1
        if key >= len(own):
            continue
        guess, found = between_one(slam.memory.keyframes[place.anchor].local, slam.memory.keyframes[key].local), []
        for points in (own, contours):
            cells = CellMap(np.zeros(2), CONFIG.lidar.max_range + 6.0)
            for member, seen in zip(place.members, place.seen, strict=True):
                cells.insert(points[member], seen)
            pose = align(points[key], cells, guess, prior).pose
            found.append((pose, hold(points[key], cells, pose).covariance(1e-9, 0.0)))
        off.append(found[1][0] - found[0][0])
        ratios.append(np.diag(found[1][1]) / np.diag(found[0][1]))
    assert len(off) > 8
    assert np.mean(np.hypot(*np.array(off)[:, :2].T)) < 0.001
    assert np.degrees(np.mean(np.abs(np.array(off)[:, 2]))) < 0.02
    assert 0.9 < np.exp(np.mean(np.log(np.sqrt(ratios)))) < 1.1


def test_a_drive_takes_a_small_part_of_what_its_scans_would() -> None:
    slam, reporter, inbox = GraphSlam(CONFIG, lidar_mount=MOUNT), Reporter("robot1", lambda: 1), Inbox()
    sent: list[bytes] = []
    answered = 0.0
    for message in messages():
        feed(slam, reporter, [message])
        if isinstance(message, LaserScan):
            due = reporter.due(message.stamp)
            sent += due
            for data in due:
                inbox.take(data)
            if message.stamp >= answered + 1.0:
                answered = message.stamp
                inbox.settle()
                back = answer(reporter, inbox.state(("robot1", 1))[0], len(slam.memory.keyframes) - 1)
                sent.append(encode(back))
                reporter.answered(back)
    scans = [message for message in messages() if isinstance(message, LaserScan)]
    seconds = scans[-1].stamp - scans[0].stamp
    rate = sum(len(data) + OVERHEAD for data in sent) / seconds
    assert rate < 2000.0
    assert rate < 0.2 * 10.0 * np.mean([scan.ranges.size for scan in scans]) * 4  # 32 bits a beam, ten times a second
    numbers = sum(4 * (fact.points.size + fact.seen.size) for fact in driven()[1] if isinstance(fact, KeyframeFact))
    assert sum(len(data) for data in sent if isinstance(decode(data), Report)) < 0.2 * numbers


def test_a_graph_that_begins_anew_is_another_run_and_the_first_one_is_told_to_its_end() -> None:
    scans = [i for i, message in enumerate(messages()) if isinstance(message, LaserScan)]
    reporter, graphs = Reporter("robot1"), []
    for part in (messages()[: scans[60]], messages()[: scans[30]]):
        graphs.append(GraphSlam(CONFIG, lidar_mount=MOUNT))
        feed(graphs[-1], reporter, part)
    reporter.flush(1e6)
    runs = told(reporter)
    assert len(runs) == 2
    for slam, facts in zip(graphs, runs.values(), strict=True):
        assert_all_told(slam, facts)


def test_a_robot_that_goes_on_in_its_own_map_goes_on_with_its_run_and_tells_nothing_twice() -> None:
    scans = [i for i, message in enumerate(messages()) if isinstance(message, LaserScan)]
    half, reporter = scans[len(scans) // 2], Reporter("robot1")
    first = GraphSlam(CONFIG, lidar_mount=MOUNT)
    feed(first, reporter, messages()[:half])
    saved = kept(first, {})
    memory = first.memory
    assert memory.contour is not None
    where = compose_one(saved.keyframes.poses[-1], between_one(memory.keyframes[-1].local, memory.contour.pose))  # type: ignore[union-attr]
    second = resume(CONFIG, saved, where, np.diag([0.02**2, 0.02**2, 0.01**2]), lidar_mount=MOUNT)
    feed(second, reporter, messages()[half:])
    reporter.flush(1e6)
    (facts,) = told(reporter).values()
    assert_all_told(second, facts)
    relations = [fact for fact in facts if isinstance(fact, RelationFact)]
    assert len(relations) == second.memory.graph.factors.size() + second.memory.graph.ties.size()
    assert {fact.drive for fact in facts if isinstance(fact, KeyframeFact)} == {0, 1}


def test_a_map_that_is_continued_by_a_new_program_is_told_as_a_whole() -> None:
    slam, _ = driven()
    reporter = Reporter("robot1")
    where = slam.path()[-1]
    again = resume(CONFIG, kept(slam, {}), where, np.diag([0.02**2, 0.02**2, 0.01**2]), lidar_mount=MOUNT)
    feed(again, reporter, messages()[-60:])
    reporter.flush(1e6)
    (facts,) = told(reporter).values()
    assert_all_told(again, facts)


def test_the_robot_is_placed_by_the_keyframe_that_the_server_places() -> None:
    slam, reporter = GraphSlam(CONFIG, lidar_mount=MOUNT), Reporter("robot1")
    half = len(messages()) // 2
    feed(slam, reporter, messages()[:half])
    assert reporter.placed() is None
    key = len(slam.memory.keyframes) - 5
    local = slam.memory.keyframes[key].local
    reporter.answered(answer(reporter, 0, key, compose(SHIFT, local)))
    feed(slam, reporter, messages()[half : half + 40])
    placed = reporter.placed()
    assert placed is not None
    assert slam.memory.contour is not None
    np.testing.assert_allclose(placed.pose, compose(SHIFT, slam.memory.contour.pose), atol=1e-9)
    np.testing.assert_allclose(compose(placed.T_common_map, placed.own), placed.pose, atol=1e-9)
    assert np.linalg.eigvalsh(placed.covariance).min() > 0.0
    assert placed.covariance[0, 0] > 0.02**2
    assert math.sqrt(placed.covariance[:2, :2].trace()) < 1.0


def begun_again(times: int) -> tuple[Reporter, int]:
    """A robot whose mapping begins again and again while there is no server."""
    reporter, runs = Reporter("robot1"), set()
    for _ in range(times):
        feed(GraphSlam(CONFIG, lidar_mount=MOUNT), reporter, messages()[:60])
        runs.add(reporter.run)
    reporter.flush(1e6)
    return reporter, len(runs)


def test_all_runs_that_were_made_without_a_server_arrive_once_there_is_one() -> None:
    reporter, runs = begun_again(8)
    assert len(told(reporter)) == runs == 8
    assert reporter.given_up == 0


def test_runs_that_are_given_up_for_their_size_are_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    whole, _ = begun_again(5)
    monkeypatch.setattr(module, "FORMER", 0)
    reporter, _ = begun_again(5)
    assert reporter.given_up == whole.waiting - reporter.waiting > 0
    assert len(told(reporter)) == 1


@pytest.mark.parametrize("wrong", [math.nan, math.inf, 1e9])
def test_a_keyframe_that_cannot_be_sent_is_told_without_its_contours_and_the_fleet_goes_on(
    wrong: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = News.collect

    def spoilt(news: News, pose: Floats) -> list[Fact]:
        facts = whole(news, pose)
        for i, fact in enumerate(facts):
            if isinstance(fact, KeyframeFact) and fact.number == 2:
                facts[i] = replace(fact, seen=np.full((1, 13), wrong, np.float32))
            elif isinstance(fact, RelationFact) and fact.second == 4:
                facts[i] = replace(fact, pose=np.full(3, 1e3 * wrong))
        return facts

    monkeypatch.setattr(News, "collect", spoilt)
    slam, reporter = GraphSlam(CONFIG, lidar_mount=MOUNT), Reporter("robot1")
    feed(slam, reporter, messages()[:400])
    reporter.flush(1e6)
    (facts,) = told(reporter).values()
    keyframes = [fact for fact in facts if isinstance(fact, KeyframeFact)]
    assert [fact.number for fact in keyframes] == list(range(len(slam.memory.keyframes)))
    assert [fact.number for fact in keyframes if not len(fact.points)] == [2]
    relations = sum(isinstance(fact, RelationFact) for fact in facts)
    missing = slam.memory.graph.factors.size() + slam.memory.graph.ties.size() - relations
    assert missing > 0
    assert reporter.left_out == missing + 1


def test_a_status_that_cannot_be_sent_stops_nothing() -> None:
    box = Outbox(1)
    box.status = Status("a", 1, 0, 0, np.full(3, np.nan), 0.0)
    assert box.news() is None


def test_an_answer_to_somebody_else_changes_nothing() -> None:
    slam, reporter = GraphSlam(CONFIG, lidar_mount=MOUNT), Reporter("robot1")
    feed(slam, reporter, messages()[:100])
    reporter.flush(1e6)
    waiting = reporter.waiting
    assert waiting > 0
    other = Answer("robot2", reporter.run or 0, 99, (), 1, (), 0, np.zeros(3), np.eye(3))
    for wrong in (other, Answer("robot1", 5, 99, (), 1, (), 0, np.zeros(3), np.eye(3))):
        reporter.answered(wrong)
    assert reporter.waiting == waiting


def test_what_is_missing_is_sent_again_but_not_at_once_and_oldest_first() -> None:
    box, free = Outbox(1), Allowance(1e9)
    for number in range(5):
        box.add(bytes([number]))
    free.renew(0.0)
    assert box.due(0.0, free) == [bytes([number]) for number in range(5)]
    box.answered(Answer("a", 1, 1, (3, 1), 1, (), -1, np.zeros(3), np.eye(3)))
    assert box.due(0.5 * PATIENCE, free) == []
    assert box.due(PATIENCE, free) == [b"\x01", b"\x03"]
    assert box.due(PATIENCE, free) == []


def test_without_a_server_only_so_much_is_sent_in_vain() -> None:
    box, free = Outbox(1), Allowance(1e9)
    for _ in range(3 * WINDOW):
        box.add(b"x")
    free.renew(0.0)
    assert sum(len(box.due(float(now), free)) for now in range(100)) == WINDOW


def test_no_more_is_sent_than_the_rate_allows() -> None:
    box, rate = Outbox(1), 1000.0
    allowance = Allowance(rate, saved=2.0)
    for _ in range(WINDOW):
        box.add(bytes(900))
    sent = 0
    for tenth in range(300):
        allowance.renew(0.1 * tenth)
        sent += sum(len(data) + OVERHEAD for data in box.due(0.1 * tenth, allowance))
        assert sent <= rate * (0.1 * tenth + 2.0) + 900 + OVERHEAD
    assert sent > 0.9 * rate * 30.0


def test_the_same_number_always_says_the_same() -> None:
    slam, reporter = GraphSlam(CONFIG, lidar_mount=MOUNT), Reporter("robot1", lambda: 7)
    feed(slam, reporter, messages()[:200])
    first = [data for data in reporter.due(0.0) if isinstance(decode(data), Report)]
    missing = tuple(range(len(first)))
    reporter.answered(Answer("robot1", 7, 0, missing, 1, (), -1, np.zeros(3), np.eye(3)))
    again = [data for data in reporter.due(1e3) if isinstance(decode(data), Report)]
    assert again[: len(first)] == first
    assert encode(decode(first[0])) == first[0]
