"""Sessions for mapping and localisation: maps are continued, and a robot that is lost is found in them."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from contourslam.config import Config, LidarConfig, LiveConfig, SlamConfig
from contourslam.errors import ConfigError, ContourslamError, MapError
from contourslam.geometry.poses import between, compose, inverse
from contourslam.live.diagnostics import Level
from contourslam.live.session import Processed, Session
from contourslam.live.start import localization, mapping
from contourslam.maps.file import load_map
from contourslam.scan import LaserScan, Odometry

pytest.importorskip("gtsam", reason="needs the extra 'graph'")

Floats = NDArray[np.float64]
Streams = Callable[..., Any]
GRAPH = Config(back_end="graph", lidar=LidarConfig(sigma_range=0.005))
EKF = Config(slam=SlamConfig(walls=True, contour_matching=True), lidar=LidarConfig(sigma_range=0.005))
LIVE = LiveConfig(sure_way=1.0, sure_time=10.0)


def run(session: Session, messages: list[tuple[float, Any]]) -> list[Processed]:
    done = []
    for now, message in messages:
        if isinstance(message, LaserScan):
            session.push_scan(message, now)
        else:
            session.push_odometry(message, now)
        done += session.poll(now)
    return done


def errors(done: list[Processed], truth: Callable[[float], Floats]) -> Floats:
    """Distances from the truth, m plus rad."""
    steps = np.array([between(truth(p.stamp), p.T_map_base) for p in done])
    return np.asarray(np.hypot(steps[:, 0], steps[:, 1]) + np.abs(steps[:, 2]))


@pytest.fixture(scope="module")
def mapped(stream: Streams, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A map of the room, in its true frame."""
    drive = stream(13.0)
    path = tmp_path_factory.mktemp("map") / "room.cmap"
    session = mapping(GRAPH, LIVE, initial_pose=drive.truth(drive.start))
    run(session, drive.messages)
    session.save(path)
    return path


def later(stream: Streams, seconds: float, *, skip: float) -> Any:
    """A further drive that begins elsewhere in the room, hours after."""
    drive = stream(seconds + skip, start=9000.0, seed=5)
    return type(drive)([(t, m) for t, m in drive.messages if m.stamp >= drive.start + skip], drive.start)


def test_a_map_is_continued_from_anywhere_in_it_and_its_landmarks_keep_their_ids(
    stream: Streams, mapped: Path, tmp_path: Path
) -> None:
    before = load_map(mapped)
    drive = later(stream, 8.0, skip=4.0)
    session = mapping(GRAPH, LIVE, map_file=mapped)
    assert set(session.wall_map().ids.tolist()) == set(before.walls.ids.tolist())
    done = run(session, drive.messages)
    assert all(p.localized for p in done if p.stamp > drive.start + 6.0)
    found = [p for p in done if p.localized]
    assert errors(found, drive.truth).max() < 0.05
    assert {i for p in found for i in p.update.matched} & set(before.walls.ids.tolist())
    for p in found:
        np.testing.assert_allclose(compose(p.T_map_odom, p.T_odom_base), p.T_map_base, atol=1e-9)
    session.save(tmp_path / "more.cmap")
    after = load_map(tmp_path / "more.cmap")
    assert after.keyframes is not None and before.keyframes is not None
    assert len(after.keyframes) > len(before.keyframes)
    assert after.keyframes.drives.max() == 1
    assert after.about["back_end"] == "graph"


def test_a_map_that_is_looked_for_in_vain_is_saved_as_it_was(stream: Streams, mapped: Path, tmp_path: Path) -> None:
    session = mapping(GRAPH, LIVE, map_file=mapped)
    session.save(tmp_path / "same.cmap")
    np.testing.assert_array_equal(load_map(tmp_path / "same.cmap").walls.end_points, load_map(mapped).walls.end_points)


def test_a_reset_begins_a_new_map_even_where_one_was_continued(stream: Streams, mapped: Path) -> None:
    session = mapping(GRAPH, LIVE, map_file=mapped)
    session.reset()
    assert len(session.wall_map().ids) == 0
    drive = stream(2.0)
    assert all(p.localized for p in run(session, drive.messages))


def test_a_map_may_be_loaded_in_mid_drive(stream: Streams, mapped: Path) -> None:
    drive = later(stream, 6.0, skip=3.0)
    session = mapping(GRAPH, LIVE)
    middle = len(drive.messages) // 3
    run(session, drive.messages[:middle])
    session.load(mapped)
    done = run(session, drive.messages[middle:])
    found = [p for p in done if p.localized]
    assert len(found) > 0.7 * len(done)
    assert errors(found, drive.truth).max() < 0.05


def test_what_cannot_be_continued_is_refused_before_the_drive(stream: Streams, mapped: Path, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="continued by the graph, not by ekf"):
        mapping(EKF, LIVE, map_file=mapped)
    with pytest.raises(ContourslamError, match=r"none\.cmap"):
        mapping(GRAPH, LIVE, map_file=tmp_path / "none.cmap")
    drive = stream(3.0)
    session = mapping(EKF, LIVE)
    run(session, drive.messages)
    session.save(tmp_path / "landmarks.cmap")
    with pytest.raises(MapError, match="landmarks alone"):
        mapping(GRAPH, LIVE, map_file=tmp_path / "landmarks.cmap")


def test_a_robot_that_is_not_in_its_map_begins_a_new_one_in_the_end(stream: Streams, tmp_path: Path) -> None:
    drive = stream(5.0)
    session = mapping(GRAPH, LiveConfig(give_up_after=3.0), autosave=tmp_path / "map.cmap")
    run(session, drive.messages)
    walls = session.wall_map()
    # The next recording is of a place that looks like nothing in the room: a narrow passage.
    angles = np.linspace(-3.1, 3.1, 360)
    ranges = np.minimum(0.4 / np.maximum(np.abs(np.sin(angles)), 1e-3), 9.0)
    other: list[tuple[float, Any]] = []
    for k in range(60):
        other.append((6.0 + 0.1 * k, Odometry(5.0 + 0.1 * k, np.array([0.02 * k, 0.0, 0.0]))))
        other.append((6.0 + 0.1 * k, LaserScan(5.0 + 0.1 * k, angles, ranges, np.zeros(360), 0.05, 30.0)))
    done = run(session, other)
    assert not done[0].localized
    assert done[-1].localized
    assert done[-1].stamp - next(p for p in done if p.localized).stamp > 2.0
    np.testing.assert_allclose(next(p for p in done if p.localized).T_map_base, 0.0, atol=1e-6)
    session.close()
    np.testing.assert_array_equal(load_map(tmp_path / "previous-map.cmap").walls.end_points, walls.end_points)


def test_a_robot_is_found_and_followed_in_a_map_that_stays_as_it_is(stream: Streams, mapped: Path) -> None:
    drive = later(stream, 6.0, skip=5.0)
    session = localization(GRAPH, LIVE, mapped)
    assert session.diagnostics(0.0)[4].level is Level.ERROR
    done = run(session, drive.messages)
    assert all(p.localized for p in done if p.stamp > drive.start + 7.0)
    assert errors([p for p in done if p.localized], drive.truth).max() < 0.05
    assert session.map_version == 0
    (named,) = [d for d in session.diagnostics(done[-1].latency) if d.name == "map"]
    assert named.level is Level.OK


def test_a_first_guess_places_the_robot_at_once(stream: Streams, mapped: Path) -> None:
    drive = later(stream, 2.0, skip=5.0)
    guess = compose(drive.truth(drive.start + 5.0), np.array([0.2, -0.1, 0.1]))
    done = run(localization(GRAPH, LIVE, mapped, initial_pose=guess), drive.messages)
    assert errors(done[3:], drive.truth).max() < 0.05


def test_time_that_runs_back_makes_localisation_look_anew(stream: Streams, mapped: Path) -> None:
    first, second = later(stream, 3.0, skip=9.0), later(stream, 5.0, skip=2.0)
    session = localization(GRAPH, LIVE, mapped)
    run(session, first.messages)
    moved = [(t + 20.0, replace(m, stamp=m.stamp - 100.0)) for t, m in second.messages]
    done = [p for p in run(session, moved) if p.stamp < first.start]
    late = [p for p in done if p.stamp > second.start + 2.0 - 100.0 + 2.0]
    assert len(late) >= 29
    assert all(p.localized for p in late)
    assert errors(late, lambda stamp: second.truth(stamp + 100.0)).max() < 0.05
    (named,) = [d for d in session.diagnostics(25.0) if d.name == "clock"]
    assert named.message.endswith("the robot is looked for in the map")


def test_localisation_bridges_odometry_that_stops_and_returns_elsewhere(stream: Streams, mapped: Path) -> None:
    drive = later(stream, 12.0, skip=0.0)
    away = drive.truth(drive.start + 9.0)
    silent = [
        (
            t,
            Odometry(m.stamp, compose(inverse(away), m.pose))
            if isinstance(m, Odometry) and m.stamp > drive.start + 6
            else m,
        )
        for t, m in drive.without(Odometry, 3.0, 8.0).messages
    ]
    done = run(localization(GRAPH, LIVE, mapped, initial_pose=drive.truth(drive.start)), silent)
    assert len(done) == 120
    late = [p for p in done if p.stamp > drive.start + 10.0]
    assert all(p.localized for p in late)
    assert errors(late, drive.truth).max() < 0.05
    for p in done:
        np.testing.assert_allclose(compose(p.T_map_odom, p.T_odom_base), p.T_map_base, atol=1e-9)


def test_another_map_may_be_loaded_to_localise_in(stream: Streams, mapped: Path, tmp_path: Path) -> None:
    drive = stream(4.0)
    shifted = mapping(GRAPH, LIVE, initial_pose=np.array([10.0, 5.0, 1.0]))
    run(shifted, drive.messages)
    shifted.save(tmp_path / "shifted.cmap")
    session = localization(GRAPH, LIVE, mapped)
    run(session, drive.messages[:50])
    session.load(tmp_path / "shifted.cmap")
    done = [p for p in run(session, drive.messages[50:]) if p.localized]
    assert len(done) > 15
    start = drive.truth(drive.start)

    def truth(stamp: float) -> Floats:
        return compose(np.array([10.0, 5.0, 1.0]), between(start, drive.truth(stamp)))

    assert errors(done, truth).max() < 0.05
    np.testing.assert_array_equal(session.wall_map().ids, shifted.wall_map().ids)
