"""Every fault of a drive has a diagnostic that names it, and the pose is right within two seconds of the return."""

import threading
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from contourslam.config import Config, LidarConfig, LiveConfig, SlamConfig
from contourslam.errors import ContourslamError, MapError
from contourslam.geometry.poses import between, compose
from contourslam.live.backing import Backing
from contourslam.live.diagnostics import Diagnostic, Level
from contourslam.live.events import Reason
from contourslam.live.session import Processed, Session
from contourslam.live.start import mapping
from contourslam.maps.saved_map import SavedMap
from contourslam.recordings import open_recording
from contourslam.replay import make_mapper, replay
from contourslam.scan import LaserScan, Odometry, TruePose
from contourslam.slam.mapper import Mapper
from contourslam.slam.result import ScanUpdate

Floats = NDArray[np.float64]
Message = LaserScan | Odometry
Streams = Callable[..., Any]

EKF = Config(slam=SlamConfig(walls=True, contour_matching=True), lidar=LidarConfig(sigma_range=0.005))
GRAPH = replace(EKF, back_end="graph")
LIVE = LiveConfig()
LOG = Path(__file__).parents[3] / "shared" / "data" / "acapulco" / "acapulco.log.xz"


@dataclass
class Told:
    """What a session told of a drive."""

    done: list[Processed]
    diagnostics: list[tuple[float, tuple[Diagnostic, ...]]]

    def at(self, now: float, name: str) -> Diagnostic:
        """The diagnostic of that name at the last moment not after `now`."""
        told = [d for when, d in self.diagnostics if when <= now][-1]
        return next(d for d in told if d.name == name)

    def worst(self, name: str, first: float = -1.0, last: float = 1e9) -> Level:
        return max(d.level for when, told in self.diagnostics if first <= when < last for d in told if d.name == name)

    def errors(self, truth: Callable[[float], Floats]) -> tuple[Floats, Floats]:
        """Stamps, and distances from the truth, m."""
        steps = np.array([between(truth(p.stamp), p.T_map_base) for p in self.done])
        return np.array([p.stamp for p in self.done]), np.hypot(steps[:, 0], steps[:, 1]) + np.abs(steps[:, 2])


def run(session: Session, messages: Iterable[tuple[float, Message]], *, until: float | None = None) -> Told:
    """Feed a session as a node would, with a look at everything every tenth of a second."""
    told, now, messages = Told([], []), 0.0, list(messages)
    end = messages[-1][0] + 0.2 if until is None else until
    ticks = [(t, None) for t in np.arange(messages[0][0], end, 0.1).tolist()]
    for now, message in sorted([*messages, *ticks], key=lambda entry: entry[0]):
        if isinstance(message, LaserScan):
            session.push_scan(message, now)
        elif message is not None:
            session.push_odometry(message, now)
        told.done += session.poll(now)
        if message is None:
            told.diagnostics.append((now, session.diagnostics(now)))
    return told


def new(stream: Any, config: Config = EKF, **options: Any) -> Session:
    return mapping(config, LIVE, initial_pose=stream.truth(stream.start), **options)


def test_a_drive_gives_every_pose_and_no_complaint(stream: Streams) -> None:
    drive = stream(6.0)
    session = new(drive)
    told = run(session, drive.messages)
    scans = [m for _, m in drive.messages if isinstance(m, LaserScan)]
    assert [p.stamp for p in told.done] == [s.stamp for s in scans]
    assert [p.scan for p in told.done] == scans
    _, errors = told.errors(drive.truth)
    assert errors.max() < 0.02
    assert all(d.level is Level.OK for when, told_ in told.diagnostics if when > 0.3 for d in told_), told.diagnostics
    assert {p.incidents for p in told.done} == {()}
    for p in told.done:
        assert p.localized
        np.testing.assert_allclose(compose(p.T_map_odom, p.T_odom_base), p.T_map_base, atol=1e-9)
        assert (np.linalg.eigvalsh(p.covariance) > 0.0).all()
        np.testing.assert_allclose(p.T_map_odom_smooth, p.T_map_odom, atol=0.02)
    assert max(p.latency for p in told.done) < 0.03
    assert len(session.wall_map().ids) >= 8
    rates = told.at(6.0, "scans").values
    assert float(rates["per second by arrival"]) == pytest.approx(10.0, abs=0.2)
    assert float(rates["per second by stamps"]) == pytest.approx(10.0, abs=0.2)


@pytest.mark.parametrize("config", [EKF, GRAPH], ids=["ekf", "graph"])
def test_live_equals_replay_to_the_bit(stream: Streams, config: Config) -> None:
    drive = stream(4.0)
    readings = [(t, m.stamp) for t, m in drive.messages if isinstance(m, Odometry)]

    def covered(message: Message) -> float:
        if isinstance(message, Odometry):
            return next(t for t, stamp in readings if stamp == message.stamp)
        return 1e-6 + next(t for t, stamp in readings if stamp >= message.stamp + message.offsets.max())

    # A recording has each scan after the reading that covers it.
    order = sorted((m for _, m in drive.messages), key=covered)
    session = new(drive, config)
    told = run(session, drive.messages)
    result = replay(order, config, initial_pose=drive.truth(drive.start))
    poses = result.poses if result.online_poses is None else result.online_poses
    np.testing.assert_array_equal([p.T_map_base for p in told.done], poses)
    if config is EKF:
        np.testing.assert_array_equal([p.covariance for p in told.done], result.covariances)
        np.testing.assert_array_equal(session.corner_map().positions, result.corner_map.positions)


@pytest.mark.skipif(not LOG.exists(), reason=f"{LOG.name} is not there")
def test_live_equals_replay_on_a_real_log() -> None:
    recording = open_recording(LOG)
    messages = [m for m in islice(recording.messages(), 2500) if not isinstance(m, TruePose)]
    session = mapping(GRAPH, LIVE)
    done = []
    for message in messages:
        if isinstance(message, LaserScan):
            session.push_scan(message, message.stamp)
        else:
            session.push_odometry(message, message.stamp)
        done += session.poll(message.stamp)
    poses = replay(messages, GRAPH).online_poses
    assert poses is not None and len(poses) > 50
    np.testing.assert_array_equal([p.T_map_base for p in done], poses)
    assert session.diagnostics(messages[-1].stamp)[0].level is Level.OK


@pytest.mark.parametrize("config", [EKF, GRAPH], ids=["ekf", "graph"])
def test_odometry_that_stops_for_five_seconds_is_named_and_costs_no_pose(stream: Streams, config: Config) -> None:
    drive = stream(14.0)
    told = run(new(drive, config), drive.without(Odometry, 4.0, 9.0).messages)
    stamps, errors = told.errors(drive.truth)
    assert len(stamps) == 140
    assert errors.max() < 0.15  # guessed meanwhile
    assert errors[stamps > drive.start + 11.0].max() < 0.03
    assert told.worst("odometry", 1.0, 4.0) is Level.OK
    silent = told.at(8.5, "odometry")
    assert silent.level is Level.ERROR
    assert silent.message.startswith("no odometry for 4.4 s on odometry: ")
    assert "is the base driver running?" in silent.message
    after = told.at(11.0, "odometry")
    assert after.level is Level.WARN
    assert "mapped without odometry" in after.message
    jumps = np.diff([compose(p.T_map_odom_smooth, p.T_odom_base) for p in told.done], axis=0)
    assert np.hypot(jumps[:, 0], jumps[:, 1]).max() < 0.15


def test_scans_before_the_odometry_are_mapped_and_the_lack_is_named(stream: Streams) -> None:
    drive = stream(8.0)
    told = run(new(drive), drive.without(Odometry, -1.0, 3.0).messages)
    stamps, errors = told.errors(drive.truth)
    assert len(stamps) == 80
    assert errors[stamps > drive.start + 5.0].max() < 0.08  # what was guessed at the start is in the map
    early = told.at(2.5, "odometry")
    assert early.level is Level.WARN
    assert early.message.startswith("no odometry has come on odometry for 2.")
    assert told.done[0].incidents[0].reason is Reason.ODOMETRY_MISSING
    assert told.done[-1].incidents == ()
    np.testing.assert_array_equal(told.done[5].T_odom_base, 0.0)


def test_odometry_before_the_scans_is_nothing_special_but_the_lack_of_scans_is_named(stream: Streams) -> None:
    drive = stream(8.0)
    start = drive.truth(drive.start + 3.0)
    session = mapping(EKF, LIVE, initial_pose=start)
    told = run(session, drive.without(LaserScan, -1.0, 3.0).messages)
    assert told.errors(drive.truth)[1].max() < 0.02
    early = told.at(2.5, "scans")
    assert early.level is Level.ERROR
    assert early.message.startswith("no scan has come on scan for 2.4 s: is the lidar's driver running")


def test_without_odometry_at_all_the_scans_alone_give_the_pose(stream: Streams) -> None:
    drive = stream(8.0)
    silent = drive.without(Odometry, -1.0, 1e9)
    told = run(new(drive, expects_odometry=False), silent.messages)
    stamps, errors = told.errors(drive.truth)
    assert len(stamps) == 80
    assert errors.max() < 0.15
    assert told.worst("odometry") is Level.OK
    assert max(p.latency for p in told.done) == 0.0  # nothing is waited for
    assert run(new(drive), silent.messages).worst("odometry") is Level.WARN


def test_scans_that_stop_for_five_seconds_are_named_and_the_wheels_bridge_them(stream: Streams) -> None:
    drive = stream(14.0)
    told = run(new(drive), drive.without(LaserScan, 4.0, 9.0).messages)
    stamps, errors = told.errors(drive.truth)
    assert len(stamps) == 90
    assert errors[stamps > drive.start + 11.0].max() < 0.03
    silent = told.at(8.5, "scans")
    assert silent.level is Level.ERROR
    assert silent.message == "no scan for 4.4 s on scan: is the lidar's driver running?"
    assert told.at(9.5, "scans").level is Level.OK


@pytest.mark.parametrize("odometry", [True, False])
@pytest.mark.parametrize("config", [EKF, GRAPH], ids=["ekf", "graph"])
def test_a_recording_that_begins_again_is_named_and_the_pose_is_right_again(
    stream: Streams, config: Config, odometry: bool
) -> None:
    first, second = stream(7.0), stream(5.0, arrival=7.5, seed=1)
    messages = [*first.messages, *second.messages]
    if not odometry:
        messages = [(t, m) for t, m in messages if isinstance(m, LaserScan)]
    session = new(first, config, expects_odometry=odometry)
    told = run(session, messages)
    again = [p for p in told.done[60:] if p.stamp < first.start + 5.0]
    assert len(again) >= 49
    assert all(p.localized for p in again if p.stamp > first.start + 2.0)
    errors = [between(first.truth(p.stamp), p.T_map_base) for p in again if p.localized]
    assert np.hypot(*np.array(errors)[:, :2].T).max() < (0.03 if odometry else 0.12)
    named = told.at(8.5, "clock")
    assert named.level is Level.WARN
    assert named.message.startswith("time ran back by ")
    # The graph goes on in its map, in which it finds the robot; the filter begins a new one.
    assert named.message.endswith("the robot is looked for in the map" if config is GRAPH else "a new map is begun")
    assert told.at(7.4, "clock").level is Level.OK
    assert sum(i.lost for p in told.done for i in p.incidents) <= 2


@pytest.mark.parametrize("config", [EKF, GRAPH], ids=["ekf", "graph"])
def test_a_clock_set_back_in_mid_drive_loses_neither_map_nor_pose(stream: Streams, config: Config) -> None:
    drive = stream(9.0)
    behind = [(t, m if t < 4.0 else replace(m, stamp=m.stamp - 500.0)) for t, m in drive.messages]
    session = new(drive, config)
    told = run(session, behind)
    _, errors = told.errors(lambda s: drive.truth(s if s >= drive.start else s + 500.0))
    assert errors.max() < 0.05
    assert len(told.done) >= 88
    assert "a clock was set; all goes on" in told.at(5.0, "clock").message
    # The walls seen before are those of the map now: their numbers have not begun anew.
    assert set(session.wall_map().ids.tolist()) & {i for p in told.done[:30] for i in p.update.born}


@pytest.mark.parametrize("config", [EKF, GRAPH], ids=["ekf", "graph"])
def test_a_base_driver_started_again_in_mid_drive_is_no_motion(stream: Streams, config: Config) -> None:
    drive = stream(9.0)
    moved = [
        (
            t,
            Odometry(m.stamp, between(drive.truth(drive.start + 4.0), m.pose))
            if isinstance(m, Odometry) and t > 4.0
            else m,
        )
        for t, m in drive.messages
    ]
    told = run(new(drive, config), moved)
    assert told.errors(drive.truth)[1].max() < 0.03
    assert "the odometry leapt by" in told.at(5.0, "odometry").message
    way = np.diff([compose(p.T_map_odom_smooth, p.T_odom_base) for p in told.done], axis=0)
    assert np.hypot(way[:, 0], way[:, 1]).max() < 0.08  # of which the drive itself is 0.045
    for p in told.done:
        np.testing.assert_allclose(compose(p.T_map_odom, p.T_odom_base), p.T_map_base, atol=1e-9)
    raw = {m.stamp: m.pose for _, m in moved if isinstance(m, Odometry)}
    last = told.done[-5]  # its stamp is that of a reading
    near = min(raw, key=lambda stamp: abs(stamp - last.stamp))
    assert np.hypot(*(raw[near] - last.T_odom_base)[:2]) < 0.03


def test_a_pause_leaves_out_scans_by_count_and_the_wheels_carry_on(stream: Streams) -> None:
    drive = stream(8.0)
    session = new(drive)
    told = run(session, [e for e in drive.messages if e[0] < 3.0])
    session.pause()
    paused = run(session, [e for e in drive.messages if 3.0 <= e[0] < 5.0])
    assert len(paused.done) <= 1
    assert paused.at(4.5, "scans").message == "paused: scans are left out until resumed"
    session.resume()
    after = run(session, [e for e in drive.messages if e[0] >= 5.0])
    assert after.errors(drive.truth)[1].max() < 0.03
    assert after.worst("scans", 6.0) is Level.OK
    lost = [i for p in after.done for i in p.incidents if i.lost]
    assert {i.reason for i in lost} == {Reason.PAUSED}
    assert len(lost) == 80 - len(told.done) - len(paused.done) - len(after.done)


def test_a_message_that_is_none_is_counted_and_named(stream: Streams) -> None:
    drive = stream(2.0)
    session = new(drive)
    session.refuse("scan", 1000.05, "a stamp, angle or time offset is not finite", 0.05)
    told = run(session, drive.messages)
    assert told.done[0].incidents[0].reason is Reason.REFUSED
    named = told.at(2.0, "scans")
    assert named.level is Level.WARN
    assert named.message == (
        "1 scan lost on scan in the last 10 s: not a valid message: a stamp, angle or time offset is not finite"
    )
    assert named.values["not a valid message"] == "1"


def test_a_reset_begins_anew_and_tells_those_who_draw_the_map(stream: Streams) -> None:
    drive = stream(6.0)
    session = new(drive)
    run(session, [e for e in drive.messages if e[0] < 3.0])
    version = session.map_version
    session.reset()
    assert session.map_version > version
    assert len(session.wall_map().ids) == 0
    told = run(session, [e for e in drive.messages if e[0] >= 3.0])
    start = drive.truth(told.done[0].stamp)
    for p in told.done:
        expected = compose(drive.truth(drive.start), between(start, drive.truth(p.stamp)))
        assert np.hypot(*(p.T_map_base - expected)[:2]) < 0.03
        np.testing.assert_allclose(compose(p.T_map_odom, p.T_odom_base), p.T_map_base, atol=1e-9)


class Fake:
    """A mapper that gives the odometry back as the pose, and fails where it is told to."""

    start_pose = np.zeros(3)

    def __init__(self, *, fails_at: float = -1.0, localized: bool = True) -> None:
        self.odometry_pose: Floats = np.zeros(3)
        self.fails_at, self.localized = fails_at, localized
        self.offset = np.zeros(3)
        self.working = threading.Event()
        self.go_on = threading.Event()
        self.go_on.set()

    def push_odometry(self, odometry: Odometry) -> None:
        self.odometry_pose = odometry.pose

    def push_scan(self, scan: LaserScan) -> ScanUpdate:
        self.working.set()
        self.go_on.wait(10.0)
        if scan.stamp == self.fails_at:
            raise MapError("the map is full")
        pose = compose(self.offset, self.odometry_pose)
        return ScanUpdate(scan.stamp, pose, np.eye(3), 0, 0, (1,), (), (), (), 0.0, 0, 1.0)

    def corner_map(self) -> Any:
        return "corners"

    def wall_map(self) -> Any:
        return "walls"

    def finish(self) -> None:
        return None


def fake_session(fake: Fake, **options: Any) -> Session:
    backing = Backing(
        begin=lambda: fake, lost=lambda mapper, pose: fake, localized=lambda mapper: fake.localized, **options
    )
    return Session(backing, LIVE)


def test_a_scan_that_the_mapper_refuses_is_counted_and_the_next_is_mapped(
    scan_at: Callable[..., LaserScan], reading_at: Callable[..., Odometry]
) -> None:
    session = fake_session(Fake(fails_at=10.1))
    told = run(session, [(0.1 * k, m) for k in range(3) for m in (reading_at(10.2 + 0.1 * k), scan_at(10.0 + 0.1 * k))])
    assert [p.stamp for p in told.done] == [10.0, 10.2]
    (incident,) = told.done[1].incidents
    assert (incident.reason, incident.detail) == (Reason.FAILED, "the map is full")
    assert "the map is full" in told.diagnostics[-1][1][0].message


@pytest.mark.parametrize("guesses", [True, False])
def test_what_scans_have_bridged_is_not_driven_once_more_when_odometry_returns(
    scan_at: Callable[..., LaserScan], reading_at: Callable[..., Odometry], guesses: bool
) -> None:
    fake = Fake()
    session = fake_session(fake, guesses=guesses)
    run(session, [(0.0, reading_at(10.1, 1.0)), *((0.1 * k, scan_at(10.0 + 0.1 * k)) for k in range(20))])
    back = [(2.1 + 0.1 * k, reading_at(12.2 + 0.1 * k, 1.5 + 0.1 * k)) for k in range(5)]
    told = run(session, [*back, (2.3, scan_at(12.1)), (2.5, scan_at(12.2))])
    assert fake.odometry_pose[0] == pytest.approx(1.4 if guesses else 1.9)
    np.testing.assert_allclose(told.done[-1].T_odom_base, [1.9, 0.0, 0.0], atol=1e-12)


def test_a_large_correction_is_smoothed_and_a_robot_found_anew_is_not(
    scan_at: Callable[..., LaserScan], reading_at: Callable[..., Odometry]
) -> None:
    fake = Fake()
    session = fake_session(fake)
    assert session.map_to_odom(0.0) is None

    def step(k: int) -> Processed:
        session.push_odometry(reading_at(10.2 + 0.1 * k, 0.05 * k), 0.1 * k)
        session.push_scan(scan_at(10.0 + 0.1 * k), 0.1 * k)
        (processed,) = session.poll(0.1 * k)
        return processed

    step(0)
    fake.offset = np.array([0.0, 0.3, 0.0])
    p = step(1)
    np.testing.assert_allclose(p.T_map_odom, [0.0, 0.3, 0.0], atol=1e-12)
    np.testing.assert_allclose(p.T_map_odom_smooth, [0.0, 0.05, 0.0], atol=1e-12)
    np.testing.assert_allclose(session.map_to_odom(10.2), [0.0, 0.1, 0.0], atol=1e-12)
    fake.localized = False
    p = step(3)
    assert not p.localized
    (named,) = [d for d in session.diagnostics(0.3) if d.name == "map"]
    assert named.level is Level.ERROR
    assert "not found in the map" in named.message
    fake.localized, fake.offset = True, np.array([5.0, 5.0, 1.0])
    p = step(4)
    np.testing.assert_array_equal(p.T_map_odom_smooth, p.T_map_odom)


def test_messages_and_transforms_do_not_wait_for_the_mapper(
    scan_at: Callable[..., LaserScan], reading_at: Callable[..., Odometry]
) -> None:
    fake = Fake()
    session = fake_session(fake)
    session.push_odometry(reading_at(10.2), 0.0)
    session.push_scan(scan_at(10.0), 0.0)
    fake.go_on.clear()
    thread = threading.Thread(target=session.poll, args=(0.0,))
    thread.start()
    try:
        assert fake.working.wait(10.0)
        session.push_odometry(reading_at(10.3), 0.1)  # none of these may hang
        session.push_scan(scan_at(10.1), 0.1)
        session.map_to_odom(10.1)
        session.diagnostics(0.1)
        session.pause()
        assert session.due(0.1) == 0.0
    finally:
        fake.go_on.set()
        thread.join(10.0)
    assert len(session.poll(0.1)) <= 1


def test_the_map_is_drawn_up_while_no_scan_waits_and_only_when_it_is_wanted_and_changed(
    scan_at: Callable[..., LaserScan], reading_at: Callable[..., Odometry]
) -> None:
    fake = Fake()
    session = fake_session(fake)
    session.push_odometry(reading_at(20.0), 0.0)
    assert session.latest_map() is None
    assert session.due(0.0) == 0.0
    assert session.poll(0.0) == []
    first = session.latest_map()
    assert first is not None
    assert (first.version, first.corners, first.walls) == (0, "corners", "walls")
    assert session.due(0.0) is None  # nothing has changed since
    session.push_scan(scan_at(10.0), 0.1)
    assert len(session.poll(0.1)) == 1
    assert session.latest_map() is first  # the pose went first
    assert session.due(0.1) == 0.0
    session.poll(0.1)
    second = session.latest_map()
    assert second is not None
    assert second.version == session.map_version == 1
    session.poll(0.1)
    assert session.latest_map() is second


def test_a_fixed_map_never_changes_its_version(
    scan_at: Callable[..., LaserScan], reading_at: Callable[..., Odometry]
) -> None:
    for fixed in (False, True):
        session = fake_session(Fake(), fixed=fixed)
        run(session, [(0.0, reading_at(10.2)), (0.0, scan_at(10.0))])
        assert (session.map_version == 0) is fixed


def kept(mapper: Mapper) -> SavedMap:
    return SavedMap(mapper.corner_map(), mapper.wall_map())


@dataclass
class Shelf:
    """Where maps go in these tests; it can be full."""

    files: dict[Path, SavedMap]
    full: bool = False

    def write(self, path: Path, saved: SavedMap) -> None:
        if self.full:
            raise OSError(28, "No space left on device")
        self.files[path] = saved

    def read(self, path: Path) -> SavedMap:
        if path not in self.files:
            raise MapError(f"{path}: not there")
        return self.files[path]


@pytest.fixture
def shelf() -> Shelf:
    return Shelf({})


def shelved(stream: Any, shelf: Shelf, *, period: float = 2.0) -> Session:
    start = stream.truth(stream.start)

    def begin(pose: Floats | None = None) -> Mapper:
        return make_mapper(EKF, initial_pose=start if pose is None else pose)

    backing = Backing(
        begin=begin,
        lost=lambda mapper, pose: begin(pose),
        keep=kept,
        open=lambda saved: begin(),
        write=shelf.write,
        read=shelf.read,
    )
    return Session(backing, LiveConfig(autosave_period=period), autosave=Path("map.cmap"))


def test_the_map_is_saved_by_itself_while_it_changes_and_at_the_end(stream: Streams, shelf: Shelf) -> None:
    drive = stream(5.0)
    session = shelved(drive, shelf)
    run(session, [e for e in drive.messages if e[0] < 1.5])
    assert shelf.files == {}
    told = run(session, [e for e in drive.messages if e[0] >= 1.5])
    session.close()
    walls = shelf.files[Path("map.cmap")].walls
    np.testing.assert_array_equal(walls.end_points, session.wall_map().end_points)
    assert told.worst("saving") is Level.OK
    assert told.at(4.9, "saving").values == {"file": "map.cmap"}


def test_a_full_disk_is_named_keeps_the_file_and_ends_no_drive(stream: Streams, shelf: Shelf) -> None:
    drive = stream(9.0)
    session = shelved(drive, shelf, period=1.0)
    run(session, [e for e in drive.messages if e[0] < 3.0])
    before = dict(shelf.files)
    shelf.full = True
    told = run(session, [e for e in drive.messages if 3.0 <= e[0] < 6.0])
    assert len(told.done) >= 29
    named = told.at(6.0, "saving")
    assert named.level is Level.ERROR
    assert "No space left on device; the file from before is kept" in named.message
    assert set(shelf.files) == set(before)
    shelf.full = False
    told = run(session, [e for e in drive.messages if e[0] >= 6.0])
    assert told.at(8.9, "saving").level is Level.OK
    session.close()


def test_the_map_that_is_left_is_set_aside(stream: Streams, shelf: Shelf) -> None:
    drive = stream(4.0)
    session = shelved(drive, shelf)
    run(session, drive.messages)
    walls = session.wall_map()
    session.reset()
    np.testing.assert_array_equal(shelf.files[Path("previous-map.cmap")].walls.end_points, walls.end_points)
    session.close()


def test_saving_and_loading_on_request_say_what_is_wrong_and_change_nothing(stream: Streams, shelf: Shelf) -> None:
    drive = stream(3.0)
    session = shelved(drive, shelf)
    run(session, drive.messages)
    session.save(Path("mine.cmap"))
    walls, version = session.wall_map(), session.map_version
    with pytest.raises(MapError, match=r"elsewhere\.cmap: not there"):
        session.load(Path("elsewhere.cmap"))
    assert session.map_version == version
    np.testing.assert_array_equal(session.wall_map().end_points, walls.end_points)
    session.load(Path("mine.cmap"))
    assert session.map_version > version
    session.close()
    with pytest.raises(ContourslamError, match="cannot be saved"):
        fake_session(Fake()).save(Path("x"))
    with pytest.raises(ContourslamError, match="cannot be continued"):
        fake_session(Fake()).load(Path("x"))


def test_a_robot_said_to_be_elsewhere_goes_on_from_there(stream: Streams, shelf: Shelf) -> None:
    drive = stream(4.0)
    session = shelved(drive, shelf)
    run(session, [e for e in drive.messages if e[0] < 2.0])
    session.lost(np.array([10.0, 20.0, 0.5]))
    told = run(session, [e for e in drive.messages if e[0] >= 2.0])
    np.testing.assert_allclose(told.done[0].T_map_base, [10.0, 20.0, 0.5], atol=0.05)
    session.close()
