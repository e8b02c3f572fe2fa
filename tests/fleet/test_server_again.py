"""What the server makes of a robot that goes on in a map that it kept, and of reports that cannot be."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from contourslam.cli.run import DEFAULTS
from contourslam.errors import MessageError
from contourslam.fleet.facts import Fact, KeyframeFact, RelationFact, Report, Status, StretchFact
from contourslam.fleet.inbox import MOST_SILENT
from contourslam.fleet.reporter import Reporter
from contourslam.fleet.server import FleetServer
from contourslam.fleet.wire import encode
from contourslam.graph import GraphSlam
from contourslam.graph.keeping import kept, resume
from contourslam.live.warming import made_up_drive
from contourslam.maps.file import load_map, save_map


def drive(slam: GraphSlam, reporter: Reporter, server: FleetServer, seconds: float, begin: float) -> None:
    """Map, tell, and let the server work after every message."""
    now = begin
    for odometry, scan, _ in made_up_drive(seconds):
        slam.push_odometry(odometry)
        update = slam.push_scan(scan)
        now = begin + scan.stamp
        reporter.push(slam, update, now)
        for data in reporter.due(now):
            server.push(data)
            server.tick(now)
        for answer in server.answers():
            reporter.answered(answer)
    reporter.flush(now)
    while not reporter.settled:
        now += 3.0
        for data in reporter.due(now):
            server.push(data)
            server.tick(now)
        for answer in server.answers():
            reporter.answered(answer)
    server.flush(now + 10.0)


def test_a_robot_that_goes_on_in_its_kept_map_shares_it_with_its_run_of_before(tmp_path: Path) -> None:
    server, slam = FleetServer(), GraphSlam(DEFAULTS)
    drive(slam, Reporter("robot", lambda: 1, rate=1e9), server, 1.2, 0.0)
    slam.finish()
    save_map(tmp_path / "map.cmap", kept(slam, {}))
    old = len(slam.memory.keyframes)
    slam = resume(DEFAULTS, load_map(tmp_path / "map.cmap"), np.zeros(3), np.diag([1e-4, 1e-4, 1e-5]))
    drive(slam, Reporter("robot", lambda: 2, rate=1e9), server, 1.2, 1000.0)
    (shared,) = server.settle()
    assert shared.members == (("robot", 1), ("robot", 2))
    assert shared.counts == (old, len(slam.memory.keyframes) - old)  # nothing is there twice
    assert (server.joined(), server.search.looks) == ((), 0)  # and nothing was searched for
    first, second = (poses for _, _, poses in shared.frames())
    np.testing.assert_array_equal(second[:old], first)
    slam.finish()
    assert slam.settled is not None
    away = second[:, :2] - slam.settled.poses[:, :2]
    assert np.hypot(*away.T).max() < 0.05
    one, two = server.answers()
    assert (one.common, two.common, two.keyframe) == (shared.number, shared.number, len(second) - 1)


NONE = np.zeros((0, 13), np.float32)


def keyframe(number: int) -> KeyframeFact:
    turns = np.linspace(-3.0, 3.0, 40)
    points = np.column_stack([2 * np.cos(turns), 2 * np.sin(turns), -np.cos(turns), -np.sin(turns)])
    return KeyframeFact(number, 0.1 * number, np.array([0.3 * number, 0.0, 0.0]), 0.0, points.astype(np.float32), NONE)


def relation(first: int, second: int, information: float = 1e4) -> RelationFact:
    return RelationFact(first, second, np.array([0.3, 0.0, 0.0]), information * np.eye(3), float("nan"), False)


NUMBERS = st.integers(-3, 8)
SIZES = st.sampled_from([0.0, 1e-9, 0.3, 1.0, 1e3, 1e6, 1e9])
POSES = st.builds(lambda x, y, turn: np.array([x, -y, turn]), SIZES, SIZES, SIZES)
MATRICES = st.builds(lambda a, b, c: np.diag([a, b, c]), *3 * [st.sampled_from([0.0, 1e-9, 1.0, 1e5, 1e9, 1e17])])
KEYFRAMES = st.builds(
    lambda number, pose, blur, drive: replace(keyframe(abs(number)), pose=pose, blur=blur, drive=abs(drive)),
    NUMBERS, POSES, SIZES, NUMBERS,
)  # fmt: skip
RELATIONS = st.builds(
    RelationFact, NUMBERS, NUMBERS, POSES, MATRICES, st.sampled_from([float("nan"), 0.0, 1e-3, 1.0]), st.booleans()
)
STRETCHES = st.builds(
    lambda anchor, members, pose: StretchFact(anchor, tuple(members), np.tile(pose, (len(members), 1))),
    NUMBERS, st.lists(NUMBERS, max_size=4), POSES,
)  # fmt: skip
SOUND = st.integers(1, 7).map(lambda n: [keyframe(0)] + [f for k in range(1, n) for f in (keyframe(k), relation(0, k))])


@settings(max_examples=150)
@given(st.lists(st.tuples(SOUND, st.lists(KEYFRAMES | RELATIONS | STRETCHES, max_size=8)), min_size=1, max_size=3))
def test_no_report_whatever_it_tells_ends_the_server(told: list[tuple[list[Fact], list[Fact]]]) -> None:
    server = FleetServer()
    for run, (sound, odd) in enumerate(told):
        for number, facts in enumerate((sound, odd)):
            try:
                data = encode(Report("robot", run, number, tuple(facts)))
            except MessageError:  # cannot be sent
                continue
            server.push(data)
            server.tick(float(number))
    server.flush(10.0)
    server.settle()
    assert len(server.answers()) == len(told)


def test_a_common_map_that_cannot_be_solved_is_put_aside_and_the_others_go_on(monkeypatch: pytest.MonkeyPatch) -> None:
    from contourslam.fleet.common import CommonMap

    advance = CommonMap.advance

    def failing(common: CommonMap) -> None:
        if common.members == ("bad",):
            raise RuntimeError("it is indeterminate")
        advance(common)

    monkeypatch.setattr(CommonMap, "advance", failing)
    server = FleetServer()
    for name in ("bad", "good"):
        server.push(encode(Report(name, 1, 0, (keyframe(0), keyframe(1), relation(0, 1)))))
    for now in range(3):
        server.tick(2.0 * now)
    server.push(encode(Report("bad", 1, 1, (keyframe(2), relation(1, 2)))))
    server.flush(10.0)
    (fault,) = server.faults()
    assert (fault.robot, "put aside" in fault.text, "indeterminate" in fault.text) == ("bad", True, True)
    assert {answer.robot: answer.keyframe for answer in server.answers()} == {"bad": -1, "good": 1}
    assert {answer.robot: answer.received for answer in server.answers()} == {"bad": 2, "good": 1}


def test_statuses_of_ever_new_runs_take_no_more_room() -> None:
    server = FleetServer()
    for run in range(MOST_SILENT + 50):
        server.push(encode(Status("robot", run, 0, -1, np.zeros(3), 0.0)))
    assert len(server.answers()) == MOST_SILENT
    server.push(encode(Report("robot", 10**6, 0, (keyframe(0),))))  # who tells something is heard
    assert len(server.answers()) == MOST_SILENT + 1
    assert "not heard" in server.faults()[-1].text
