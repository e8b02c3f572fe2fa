import contextlib
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from contourslam.errors import ConfigError
from contourslam.robot.pilot import Pilot, PilotConfig
from contourslam.robot.route import Route, load_route, sample_route

SQUARE = ((0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0))


def drive(pilot: Pilot, pose: tuple[float, float, float], seconds: float, dt: float = 0.05) -> np.ndarray:
    """A robot that does as it is told, and knows where it is."""
    x, y, heading = pose
    poses = []
    for _ in range(round(seconds / dt)):
        v, omega = pilot.steer((x, y, heading), dt)
        x, y = x + v * dt * math.cos(heading), y + v * dt * math.sin(heading)
        heading += omega * dt
        poses.append((x, y, heading, v, omega))
    return np.array(poses)


def away(way: np.ndarray, points: np.ndarray) -> np.ndarray:
    return np.array([np.hypot(*(way - point).T).min() for point in points])


def test_points_of_a_route_are_a_centimetre_apart_and_come_back_where_it_is_closed() -> None:
    closed, open_ = sample_route(SQUARE), sample_route(SQUARE, closed=False)
    assert len(closed) == 800 and len(open_) == 600
    assert np.hypot(*np.diff(closed, axis=0).T).max() < 0.0101
    assert np.hypot(*(closed[0] - closed[-1])) < 0.0101
    assert open_[-1].tolist() == [0.0, 2.0]


def test_the_robot_stays_near_a_closed_way_lap_after_lap() -> None:
    way = sample_route(SQUARE)
    pilot = Pilot(way, closed=True, config=PilotConfig())
    poses = drive(pilot, (0.05, -0.1, 0.3), 60.0)
    assert pilot.laps > 1.5 and not pilot.arrived
    assert pilot.travelled == pytest.approx(8.0 * pilot.laps)
    assert away(way, poses[:, :2]).max() < 0.25  # corners are cut a little
    config = PilotConfig()
    assert np.abs(np.diff(poses[:, 3])).max() <= config.acceleration * 0.05 + 1e-9
    assert np.abs(np.diff(poses[:, 4])).max() <= config.turn_acceleration * 0.05 + 1e-9
    assert np.abs(poses[:, 4]).max() <= config.turn_limit + 1e-9


def test_an_open_way_ends_at_its_end() -> None:
    pilot = Pilot(sample_route(SQUARE, closed=False), closed=False, config=PilotConfig())
    poses = drive(pilot, (0.0, 0.0, 0.0), 40.0)
    assert pilot.arrived
    assert np.hypot(poses[-1, 0], poses[-1, 1] - 2.0) < 0.15
    assert poses[-1, 3:].tolist() == [0.0, 0.0]


def test_an_open_way_that_comes_back_to_its_start_has_not_ended_there() -> None:
    pilot = Pilot(sample_route((*SQUARE, SQUARE[0]), closed=False), closed=False, config=PilotConfig())
    pilot.steer((0.0, 0.006, 0.0), 0.02)
    assert not pilot.arrived
    poses = drive(pilot, (0.0, 0.006, 0.0), 60.0)
    assert pilot.arrived and np.ptp(poses[:, :2], axis=0).min() > 1.8


def test_a_robot_that_looks_the_wrong_way_turns_first() -> None:
    pilot = Pilot(sample_route(SQUARE, closed=False), closed=False, config=PilotConfig())
    v, omega = pilot.steer((0.0, 0.0, math.pi), 0.1)
    assert v == 0.0 and omega != 0.0


@pytest.mark.parametrize("sees", [{"blind": 1.5}, {"sigma": 0.5}, {}])
def test_a_robot_that_is_blind_unsure_or_lost_stops_and_goes_on_afterwards(sees: dict[str, float]) -> None:
    pilot = Pilot(sample_route(SQUARE), closed=True, config=PilotConfig())
    drive(pilot, (0.0, 0.0, 0.0), 3.0)
    pose = (0.7, 0.0, 0.0)
    for _ in range(10):
        v, _ = pilot.steer(pose if sees else None, 0.05, **sees)
    assert v == 0.0
    assert pilot.steer(pose, 0.05)[0] > 0.0


def test_routes_are_read_from_both_kinds_of_file(tmp_path: Path) -> None:
    yaml, csv = tmp_path / "a.yaml", tmp_path / "a.csv"
    yaml.write_text("closed: true\nwaypoints:\n  - [0, 0]\n  - [2, 0.5]\n")
    csv.write_text("x,y\n0, 0\n\n2, 0.5 # the door\n")
    assert load_route(yaml) == Route(((0.0, 0.0), (2.0, 0.5)), True)
    assert load_route(csv) == Route(((0.0, 0.0), (2.0, 0.5)), False)


@pytest.mark.parametrize(
    ("name", "text", "says"),
    [
        ("a.yaml", "waypoints: [[0, 0]]", "at least two waypoints"),
        ("a.yaml", "waypoints: [[0, 0], [1, 2, 3]]", "waypoint 2 must be two numbers"),
        ("a.yaml", "waypoints: [[0, 0], [1, .nan]]", "not finite"),
        ("a.yaml", "waypoints: [[0, 0], [0, 0]]", "the same"),
        ("a.yaml", "points: []", "holds no list of waypoints"),
        ("a.yaml", "waypoints: [[0, 0], [1, 1]]\nspeed: 3", "speed is not known"),
        ("a.yaml", "waypoints: [[0, 0], [1, 1]]\nclosed: 3", "closed is not known"),
        ("a.yaml", "{", "not valid YAML"),
        ("a.csv", "0,0\n1,a\n", "line 2 must be two numbers"),
        ("a.csv", "0,0\n", "at least two waypoints"),
    ],
)
def test_a_wrong_route_is_told_with_its_place(tmp_path: Path, name: str, text: str, says: str) -> None:
    path = tmp_path / name
    path.write_text(text)
    with pytest.raises(ConfigError, match=f"{name}: .*{says}"):
        load_route(path)
    with pytest.raises(ConfigError, match=r"none\.yaml: cannot be read"):
        load_route(tmp_path / "none.yaml")


@given(st.text(max_size=60), st.sampled_from([".yaml", ".csv"]))
def test_any_text_is_a_route_or_a_config_error(tmp_path_factory: pytest.TempPathFactory, text: str, kind: str) -> None:
    path = tmp_path_factory.mktemp("routes") / f"a{kind}"
    path.write_text(text, encoding="utf-8")
    with contextlib.suppress(ConfigError):
        assert len(load_route(path).waypoints) >= 2
