import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import islice
from pathlib import Path

import mujoco
import numpy as np
import pytest

from contourslam.errors import ConfigError
from contourslam.geometry.poses import between, compose, interpolate, transform
from contourslam.recordings import open_recording
from contourslam.scan import LaserScan, Odometry, TruePose
from contourslam.simulation.buildings import office_building
from contourslam.simulation.config import PAPER_LIDAR, YDLIDAR_X4, LidarModel, RobotModel, SimulationConfig
from contourslam.simulation.gliding import Gliding
from contourslam.simulation.lanes import ways_of
from contourslam.simulation.lidar import SolidCaster
from contourslam.simulation.others import cast_others
from contourslam.simulation.ray_casting import outlines
from contourslam.simulation.recorded import record, recording_paths
from contourslam.simulation.robot import Standing, draw_flaws, drums
from contourslam.simulation.rolling import TICK, Moments
from contourslam.simulation.rooms import ROOMS
from contourslam.simulation.senses import Eyes, Message, Past
from contourslam.simulation.several import SeveralRobots
from contourslam.simulation.simulate import simulate
from contourslam.simulation.traffic import Traffic
from contourslam.simulation.world import compile_world

ROBOT = RobotModel()
BODIES = 2 * ROBOT.body_radius
EXACT = replace(PAPER_LIDAR, sigma_range=0.0)


def as_bytes(message: Message) -> bytes:
    values = [message.ranges, message.angles] if isinstance(message, LaserScan) else message.pose
    return type(message).__name__.encode() + np.append(message.stamp, values).tobytes()


def true_ways(robots: SeveralRobots) -> np.ndarray:
    """True poses of all robots at each tick, shape (robots, ticks, 3)."""
    return np.array([moments.poses[-1] for moments in robots.moments()]).transpose(1, 0, 2)


def nearest(ways: np.ndarray) -> float:
    """Least distance between the middles of any two robots, m."""
    pairs = np.hypot(*np.moveaxis(ways[:, None, :, :2] - ways[None, :, :, :2], 3, 0))
    return float(pairs[np.triu_indices(len(ways), 1)].min())


@pytest.mark.parametrize(("lidar", "duration"), [(PAPER_LIDAR, 2.0), (YDLIDAR_X4, 2.03)])
def test_one_robot_alone_does_what_a_simulated_robot_does_to_the_bit(lidar: LidarModel, duration: float) -> None:
    config = SimulationConfig(duration=duration, lidar=lidar)
    for name in ("furnished_room", "office_building"):
        whole = simulate(ROOMS[name], config, 5).messages()
        stepwise = (message for _, message in SeveralRobots(ROOMS[name], config, 5, 1).messages())
        assert [as_bytes(m) for m in whole] == [as_bytes(m) for m in stepwise]


@pytest.mark.parametrize("contact_free", [False, True])
def test_the_same_seed_gives_the_same_messages_and_another_seed_others(contact_free: bool) -> None:
    config = SimulationConfig(duration=1.0)
    first, again, other = (
        [(k, as_bytes(m)) for k, m in SeveralRobots(place, config, seed, 3, contact_free=contact_free).messages()]
        for place, seed in ((ROOMS["office_corridor"], 1), (ROOMS["office_corridor"], 1), (ROOMS["office_corridor"], 2))
    )
    assert first == again
    assert first != other


def test_every_robot_has_noise_and_odometry_of_its_own() -> None:
    messages = list(SeveralRobots(ROOMS["large_hall"], SimulationConfig(duration=3.0), 0, 3).messages())
    turned = [[m.pose for k, m in messages if k == robot and isinstance(m, Odometry)][-1] for robot in range(3)]
    assert len({tuple(pose.round(6)) for pose in turned}) == 3
    quiet = SeveralRobots(ROOMS["large_hall"], SimulationConfig(duration=3.0, noise=0.0), 0, 3).messages()
    errors = np.array(
        [
            m.ranges[:100] - q.ranges[:100]
            for (_, m), (_, q) in zip(messages, quiet, strict=True)
            if isinstance(m, LaserScan)
        ]
    )
    assert np.abs(np.corrcoef(errors[:3]) - np.eye(3)).max() < 0.5
    assert errors.std() == pytest.approx(0.01, rel=0.1)


def test_messages_of_all_robots_come_in_the_order_of_time() -> None:
    now, last = 0.0, [-1.0] * 3
    for robot, message in SeveralRobots(ROOMS["office_building"], SimulationConfig(duration=2.0), 0, 3).messages():
        assert message.stamp <= now + TICK + 1e-9
        if isinstance(message, Odometry):
            assert message.stamp >= now and message.stamp > last[robot]
            now = last[robot] = message.stamp
        elif isinstance(message, LaserScan):
            assert message.stamp + message.offsets[-1] <= now + 1e-9
    assert last == [2.0] * 3


def test_the_first_messages_come_before_the_drive_is_over() -> None:
    endless = SeveralRobots(office_building(2, 4), SimulationConfig(duration=1800.0), 0, 3)
    assert {robot for robot, _ in islice(endless.messages(), 300)} == {0, 1, 2}


@pytest.mark.parametrize(
    ("name", "robots", "seed"), [("office_building", 3, 0), ("office_building", 3, 1), ("office_corridor", 4, 0)]
)
def test_nobody_is_stuck_or_touched_in_two_minutes(name: str, robots: int, seed: int) -> None:
    config = SimulationConfig(duration=120.0)
    ways = true_ways(SeveralRobots(ROOMS[name], config, seed, robots, contact_free=True))
    assert nearest(ways) > BODIES + 0.1
    way = np.hypot(*np.moveaxis(np.diff(ways[..., :2], axis=1), 2, 0))
    assert way.sum(axis=1).min() > 0.5 * 0.8 * 0.4 * 120.0
    half_a_minute = way[:, : way.shape[1] // 1500 * 1500].reshape(robots, -1, 1500).sum(axis=2)
    assert half_a_minute.min() > 1.0


@pytest.mark.parametrize("name", ["office_building", "office_corridor"])
def test_on_their_wheels_robots_keep_off_each_other_and_off_everything(
    name: str, clearance: Callable[..., np.ndarray]
) -> None:
    config = SimulationConfig(duration=12.0)
    ways = true_ways(SeveralRobots(ROOMS[name], config, 1, 5))
    assert nearest(ways) > BODIES + 0.05
    for height in (0.02, 0.1):
        assert clearance(ways[:, ::20, :2].reshape(-1, 2), *outlines(ROOMS[name], height)).min() > BODIES / 2 + 0.04


def test_each_robot_claims_the_way_that_it_needs_at_its_own_speed(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []

    class Watched(Traffic):
        def limits(self, at: Sequence[int], speeds: Sequence[float]) -> list[float]:
            asked.append(speeds)
            return super().limits(at, speeds)

    monkeypatch.setattr("contourslam.simulation.several.Traffic", Watched)
    robots = SeveralRobots(ROOMS["large_hall"], SimulationConfig(duration=0.1), 0, 3, contact_free=True)
    assert len(list(robots.moments())) > 1
    assert asked[0] == robots.speeds
    assert asked[0][1] < asked[0][0] == robots.config.speed


def test_a_robot_that_starts_at_the_end_of_a_lap_starts_on_it() -> None:
    robots = SeveralRobots(ROOMS["large_hall"], SimulationConfig(duration=0.1), 2, 6, contact_free=True)
    assert all(driver.index < len(way.points) for (driver, _), way in zip(robots.drivers(), robots.ways, strict=True))
    assert all(
        np.hypot(*(way.points - start[:2]).T).min() < 0.04
        for start, way in zip(robots.starts, robots.ways, strict=True)
    )


@pytest.mark.parametrize("seed", range(3))
def test_ways_through_a_building_are_clear_on_the_right_side_too(
    seed: int, clearance: Callable[..., np.ndarray]
) -> None:
    building = office_building(3, seed)
    ways, starts = ways_of(building, 4, 60.0, seed)
    assert all(way.standing[start] for way, start in zip(ways, starts, strict=True))
    for way in ways:
        assert clearance(way.points[::20], *outlines(building.room, 0.1)).min() > BODIES / 2 + 0.08


def test_beams_meet_other_robots_where_mujoco_does() -> None:
    room, chance = ROOMS["large_hall"], np.random.default_rng(3)
    poses = np.array([[4.0, 4.0, 0.3], [5.5, 4.4, 2.0], [3.6, 5.8, -1.2], [11.0, 3.0, 0.0]])
    model = compile_world(room, [Standing(ROBOT, draw_flaws(k), pose) for k, pose in enumerate(poses)])
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    positions, rotations = (
        data.qpos.reshape(-1, 9)[:, :3],
        np.array([data.body(f"robot{k}_base").xmat for k in (1, 2, 3, 4)]),
    )
    count, solid = 6000, SolidCaster(room)
    origins = np.column_stack([np.tile([4.7, 5.1], (count, 1)), chance.uniform(0.09, 0.24, count)])
    angles, slopes = chance.uniform(-np.pi, np.pi, count), chance.uniform(-0.005, 0.005, count)
    directions = np.column_stack([np.cos(angles), np.sin(angles), slopes])
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    still = np.repeat(positions[None], 2, axis=0), np.repeat(rotations.reshape(1, -1, 3, 3), 2, axis=0)
    steps, weights = np.zeros(count, dtype=np.int64), chance.random(count)
    found = solid.cast(origins, directions)
    ranges, incidences = cast_others(origins, directions, found, steps, weights, *still, drums(ROBOT), -1)
    every, normal = np.ones(6, dtype=np.uint8), np.zeros(3)
    rays = zip(origins, directions, strict=True)
    expected = np.array([mujoco.mj_ray(model, data, o, d, every, 1, -1, None, normal) for o, d in rays])
    met = ranges < found[0]
    assert met.sum() > 100 and (incidences[met] > 0.0).all()
    np.testing.assert_allclose(ranges, np.where(expected < 0, np.inf, expected), atol=1e-6)


def test_a_beam_to_the_lidar_of_another_robot_gives_its_distance(
    clearance: Callable[..., np.ndarray], cast_ray: Callable[..., np.ndarray]
) -> None:
    room, head = ROOMS["furnished_room"], drums(ROBOT)[2]
    config = SimulationConfig(duration=5.0, lidar=EXACT)
    robots = SeveralRobots(room, config, 1, 3)
    messages = list(robots.messages())
    truth = [[m for k, m in messages if k == robot and isinstance(m, TruePose)] for robot in range(3)]
    matter, seen, met = (room.segments(0.2), room.circles(0.2)), 0, 0
    for robot, scan in [(k, m) for k, m in messages if isinstance(m, LaserScan)][::3]:
        at = scan.stamp + scan.offsets
        poses = [interpolate(np.array([m.stamp for m in way]), np.array([m.pose for m in way]), at) for way in truth]
        heads = [compose(pose, np.array([head.x, 0.0, 0.0]))[:, :2] for pose in poses]
        angles = poses[robot][:, 2] + scan.angles
        ahead = np.stack([np.cos(angles), np.sin(angles)], axis=1)
        to_wall = cast_ray(heads[robot], angles, *matter)
        for other in {0, 1, 2} - {robot}:
            to_head = heads[other] - heads[robot]
            along, aside = (
                np.sum(to_head * ahead, axis=1),
                np.abs(to_head[:, 0] * ahead[:, 1] - to_head[:, 1] * ahead[:, 0]),
            )
            meant = (along > 0) & (aside < 0.8 * head.radius) & (along < to_wall)
            seen += meant.sum()
            surface = along - np.sqrt(np.maximum(head.radius**2 - aside**2, 0.0))
            met += (np.abs(scan.ranges - surface)[meant] < 0.005).sum()
        # All else that is met is the room.
        hits = heads[robot] + scan.ranges[:, None] * ahead
        on_heads = np.min(
            [np.abs(np.hypot(*(hits - h).T) - head.radius) for k, h in enumerate(heads) if k != robot], axis=0
        )
        assert np.minimum(clearance(hits, *matter), on_heads).max() < 0.005
    assert seen > 50
    assert met > 0.97 * seen  # the rest has the third robot in between


def test_scans_without_physics_are_those_of_the_room_in_space() -> None:
    room, config = ROOMS["office_building"], SimulationConfig(duration=1.0)
    starts = SeveralRobots(room, config, 0, 3).starts
    world = Gliding(ROBOT, [1, 2, 3], starts)
    past = Past(world.begun, world.spacing)
    for _ in range(8):
        past.add(world.step([(0.4, 0.5), (0.3, -0.5), (0.4, 0.0)]))
    flat, solid = (Eyes(room, config, contact_free=free) for free in (True, False))
    angles, times = np.linspace(-np.pi, np.pi, 500, endpoint=False), np.arange(500) * 2e-4
    agreeing = []
    for robot in range(3):
        ours, theirs = (eyes.look(past, robot, 0.2 - ROBOT.wheel_radius, times, angles) for eyes in (flat, solid))
        agreeing.append(np.abs(ours[0] - theirs[0]) * np.sin(theirs[1]) < 1e-4)
        np.testing.assert_allclose(ours[1][agreeing[-1]], theirs[1][agreeing[-1]], atol=1e-3)
    assert np.mean(agreeing) > 0.998


def test_wheels_of_gliding_robots_slip_and_roll_as_far_as_they_go() -> None:
    world = Gliding(ROBOT, [7], [(0.0, 0.0, 0.0)])
    rows = [world.step([(0.4, 0.2)]) for _ in range(1000)]
    rolled = Moments.joined(rows).wheel_angles[-1, 0] * ROBOT.wheel_radius
    np.testing.assert_allclose(rolled, 8.0 + np.array([-1, 1]) * 4.0 * ROBOT.wheel_base / 2, atol=0.03)
    x, y, heading = rows[-1].last_pose(0)
    np.testing.assert_allclose([x, y], [2.0 * np.sin(4.0), 2.0 - 2.0 * np.cos(4.0)], atol=1e-9)
    assert heading == pytest.approx(4.0 - 2 * np.pi)


def test_true_poses_are_in_the_frame_of_the_room(clearance: Callable[..., np.ndarray]) -> None:
    room = ROOMS["office_building"]
    robots = SeveralRobots(room, SimulationConfig(duration=1.0, lidar=EXACT), 2, 3)
    first = {k: m for k, m in reversed(list(robots.messages())) if isinstance(m, TruePose)}
    scans = {k: m for k, m in reversed(list(robots.messages())) if isinstance(m, LaserScan)}
    for robot, start in enumerate(robots.starts):
        np.testing.assert_allclose(between(np.array(start), first[robot].pose), 0.0, atol=0.02)
        ahead = scans[robot].ranges[:, None] * np.stack(
            [np.cos(scans[robot].angles), np.sin(scans[robot].angles)], axis=1
        )
        hits = transform(compose(first[robot].pose, np.array([0.1, 0.0, 0.0])), ahead)
        assert np.median(clearance(hits, *outlines(room, 0.2))) < 0.01  # it has hardly begun to move


@pytest.mark.parametrize(("name", "fit"), [("furnished_room", 16), ("office_corridor", 12)])
def test_where_too_many_robots_do_not_fit_it_is_said_how_many_do(name: str, fit: int) -> None:
    with pytest.raises(ConfigError, match=rf"{name}: 200 robots do not fit; \d+ do.* --corridors") as caught:
        SeveralRobots(ROOMS[name], SimulationConfig(), 0, 200)
    most = int(re.findall(r"(\d+) do,", str(caught.value))[0])
    assert 3 < most < fit
    assert len(SeveralRobots(ROOMS[name], SimulationConfig(), 0, most).starts) == most
    with pytest.raises(ConfigError, match="at least one robot"):
        SeveralRobots(ROOMS[name], SimulationConfig(), 0, 0)


def test_what_is_recorded_until_it_is_stopped_is_whole(tmp_path: Path) -> None:
    robots = SeveralRobots(ROOMS["furnished_room"], SimulationConfig(duration=60.0), 0, 2, contact_free=True)
    asked = iter(range(10**9))
    done = record(robots, recording_paths(tmp_path, 2), stopped=lambda: next(asked) > 500)
    assert not done.complete and 0.5 < done.seconds < 5.0
    for path, scans, way in zip(recording_paths(tmp_path, 2), done.scans, done.ways, strict=True):
        messages = list(open_recording(path).messages())
        assert sum(isinstance(m, LaserScan) for m in messages) == scans > 5
        assert sum(isinstance(m, TruePose) for m in messages) == len(way)
