import math
import re
import shutil
import subprocess
from collections import Counter
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from contourslam.cli import main
from contourslam.simulation.config import LIDARS, YDLIDAR_X4, RobotModel
from contourslam.simulation.gazebo import robot as gazebo_robot
from contourslam.simulation.gazebo.world import gazebo_world
from contourslam.simulation.pieces import Box
from contourslam.simulation.rooms import ROOMS
from contourslam.simulation.world import walls

Element = ElementTree.Element
SIZES = {"box": {"size": 3}, "cylinder": {"radius": 1, "length": 1}, "sphere": {"radius": 1}, "plane": {"size": 2}}
ROBOT = RobotModel()


@pytest.fixture(scope="module", params=ROOMS)
def name(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(scope="module")
def world(name: str) -> Element:
    root = ElementTree.fromstring(gazebo_world(ROOMS[name], YDLIDAR_X4, ROBOT))
    found = root.find("world")
    assert found is not None
    return found


def numbers(parent: Element, path: str) -> list[float]:
    text = parent.findtext(path)
    assert text is not None, path
    return [float(word) for word in text.split()]


def number(parent: Element, path: str) -> float:
    (value,) = numbers(parent, path)
    return value


def the(parent: Element, path: str) -> Element:
    (element,) = parent.findall(path)
    return element


def systems(parent: Element) -> dict[str, Element]:
    return {plugin.attrib["name"].removeprefix("gz::sim::systems::"): plugin for plugin in parent.findall("plugin")}


@pytest.mark.skipif(
    shutil.which("ign") is None, reason="needs `ign sdf`: apt-get install ignition-tools libsdformat-dev"
)
def test_gazebos_own_parser_takes_the_file(name: str, tmp_path: Path) -> None:
    if not shutil.which("ign") or subprocess.run(["ign", "sdf", "--versions"], capture_output=True).returncode:
        pytest.skip("`ign sdf` is in Debian's ignition-tools and libsdformat-dev")
    path = tmp_path / "world.sdf"
    assert main(["world", "--room", name, "-o", str(path)]) == 0
    done = subprocess.run(["ign", "sdf", "-k", str(path)], capture_output=True, text=True, check=False)
    assert done.stdout == "Valid.\n", done.stderr
    assert done.returncode == 0
    assert not re.search(r"\[Warn|Error", done.stderr)


def test_every_shape_has_its_sizes(world: Element) -> None:
    shapes = [shape for geometry in world.iter("geometry") for shape in geometry]
    assert len(shapes) > 50
    for shape in shapes:
        for tag, count in SIZES[shape.tag].items():
            values = numbers(shape, tag)
            assert len(values) == count
            assert min(values) > 0
            assert np.isfinite(values).all()


def test_every_number_of_a_pose_is_there_and_finite(world: Element) -> None:
    for pose in world.iter("pose"):
        values = [float(word) for word in (pose.text or "").split()]
        assert len(values) == 6
        assert np.isfinite(values).all()


def test_siblings_never_share_a_name(world: Element) -> None:
    for parent in world.iter():
        named = [child.attrib["name"] for child in parent if "name" in child.attrib]
        assert [name for name, count in Counter(named).items() if count > 1] == []


def test_each_wall_and_piece_stands_where_the_room_has_it(name: str, world: Element) -> None:
    room, link = ROOMS[name], the(world, "model[@name='room']/link")
    assert the(world, "model[@name='room']").findtext("static") == "true"
    assert world.find("model[@name='room']/pose") is None
    assert link.find("pose") is None
    expected = {f"wall{index}": piece for index, piece in enumerate(walls(room))}
    expected |= {f"piece{index}": piece for index, piece in enumerate(room.pieces)}
    assert len(link) == 2 * len(expected)
    for key, piece in expected.items():
        for kind in ("collision", "visual"):
            element = the(link, f"{kind}[@name='{key}_{kind}']")
            yaw = math.radians(piece.yaw_deg) if isinstance(piece, Box) else 0.0
            middle = (piece.top + piece.bottom) / 2
            assert numbers(element, "pose") == pytest.approx([piece.x, piece.y, middle, 0, 0, yaw], abs=1e-12)
            high = piece.top - piece.bottom
            if isinstance(piece, Box):
                assert numbers(element, "geometry/box/size") == [piece.length, piece.width, high]
            else:
                assert number(element, "geometry/cylinder/radius") == piece.radius
                assert number(element, "geometry/cylinder/length") == high
        assert numbers(the(link, f"visual[@name='{key}_visual']"), "material/diffuse") == [*piece.colour, 1.0]


def test_the_floor_reaches_beyond_the_walls(name: str, world: Element) -> None:
    floor = the(world, "model[@name='floor']")
    middle, outline = np.array(numbers(floor, "pose")[:2]), np.array(ROOMS[name].outline)
    for kind in ("collision", "visual"):
        half = np.array(numbers(floor, f"link/{kind}/geometry/plane/size")) / 2
        assert (np.abs(outline - middle).max(axis=0) < half - 1.0).all()


def test_the_world_loads_the_systems_that_move_sense_and_show(world: Element) -> None:
    assert set(systems(world)) == {"Physics", "UserCommands", "SceneBroadcaster", "Sensors"}
    assert systems(world)["Sensors"].findtext("render_engine") == "ogre2"
    files = [plugin.attrib["filename"] for plugin in world.iter("plugin")]
    assert files == [
        *("gz-sim-physics-system", "gz-sim-user-commands-system", "gz-sim-scene-broadcaster-system"),
        *("gz-sim-sensors-system", "gz-sim-diff-drive-system", "gz-sim-odometry-publisher-system"),
    ]


def test_every_joint_ties_two_links_of_the_robot(world: Element) -> None:
    robot = the(world, "model[@name='robot']")
    links = {link.attrib["name"] for link in robot.findall("link")}
    joints = {joint.attrib["name"]: joint for joint in robot.findall("joint")}
    assert {joint.findtext("child") for joint in joints.values()} == links - {"base_link"}
    assert {joint.findtext("parent") for joint in joints.values()} == {"base_link"}
    drive = systems(robot)["DiffDrive"]
    for side in ("left", "right"):
        joint = joints[drive.findtext(f"{side}_joint") or ""]
        assert joint.attrib["type"] == "revolute"
        assert joint.findtext("child") == f"{side}_wheel"


def test_the_drive_knows_the_wheels_that_the_robot_has(world: Element) -> None:
    robot = the(world, "model[@name='robot']")
    drive = systems(robot)["DiffDrive"]
    assert number(drive, "wheel_separation") == ROBOT.wheel_base
    assert number(drive, "wheel_radius") == ROBOT.wheel_radius
    for side, sign in (("left", 1), ("right", -1)):
        wheel = the(robot, f"link[@name='{side}_wheel']")
        # It touches the floor, in one point, half a wheel base to its side.
        assert numbers(wheel, "pose") == [0, sign * ROBOT.wheel_base / 2, ROBOT.wheel_radius, 0, 0, 0]
        assert number(wheel, "collision/geometry/sphere/radius") == ROBOT.wheel_radius


def test_nothing_of_the_robot_reaches_below_the_floor_and_its_load_rests_on_the_caster(world: Element) -> None:
    base = the(world, "model[@name='robot']/link[@name='base_link']")
    caster = the(base, "collision[@name='caster_collision']")
    x, _, z, *_ = numbers(caster, "pose")
    assert z == number(caster, "geometry/sphere/radius")
    assert x < numbers(base, "inertial/pose")[0] < 0
    body = the(base, "collision[@name='body_collision']")
    assert numbers(body, "pose")[2] - number(body, "geometry/cylinder/length") / 2 > 0.02


def test_every_moving_link_has_a_mass_and_moments_that_a_body_can_have(world: Element) -> None:
    links = the(world, "model[@name='robot']").findall("link")
    assert len(links) == 4
    for link in links:
        assert number(link, "inertial/mass") > 0
        moments = sorted(number(link, f"inertial/inertia/{name}") for name in ("ixx", "iyy", "izz"))
        assert moments[0] > 0
        assert moments[2] <= moments[0] + moments[1] + 1e-12


def test_the_robot_stands_at_the_start_of_the_rooms_way(name: str, world: Element) -> None:
    x, y, z, roll, pitch, yaw = numbers(the(world, "model[@name='robot']"), "pose")
    assert [x, y, yaw] == pytest.approx(ROOMS[name].start.tolist(), abs=1e-12)
    assert [z, roll, pitch] == [0, 0, 0]


@pytest.mark.parametrize("preset", LIDARS)
def test_the_lidar_is_the_simulators(preset: str) -> None:
    lidar = LIDARS[preset]
    root = ElementTree.fromstring(gazebo_world(ROOMS["large_hall"], lidar, ROBOT))
    link = the(root, "world/model[@name='robot']/link[@name='lidar_link']")
    assert numbers(link, "pose") == [lidar.mount_x, 0, lidar.mount_height, 0, 0, 0]
    sensor = the(link, "sensor[@type='gpu_lidar']")
    assert sensor.findtext("gz_frame_id") == "lidar_link"
    rate, ray = number(sensor, "update_rate"), "lidar/scan/horizontal/"
    beams = number(sensor, f"{ray}samples")
    assert beams * rate == pytest.approx(lidar.samples_per_second, rel=1e-3)
    # Gazebo spreads the beams over samples - 1 steps: the whole turn, and no direction twice.
    first, last = number(sensor, f"{ray}min_angle"), number(sensor, f"{ray}max_angle")
    assert (last - first) / (beams - 1) == pytest.approx(2 * math.pi / beams)
    assert number(sensor, "lidar/range/min") == lidar.range_min
    assert number(sensor, "lidar/range/max") == lidar.range_max
    assert number(sensor, "lidar/noise/stddev") == lidar.sigma_range
    # Gazebo's lidar sees what is drawn: its own housing must be nearer than it can see, the body lower.
    assert number(link, "visual/geometry/cylinder/radius") < lidar.range_min
    for visual in root.findall("world/model[@name='robot']/link[@name='base_link']/visual"):
        if visual.find("geometry/cylinder") is not None:
            top = numbers(visual, "pose")[2] + number(visual, "geometry/cylinder/length") / 2
            assert top < lidar.mount_height - 0.01


def test_the_same_room_gives_the_same_file_and_an_empty_one_no_robot(tmp_path: Path) -> None:
    files = [tmp_path / f"{index}.sdf" for index in range(3)]
    for file, options in zip(files, ([], [], ["--empty"]), strict=True):
        assert main(["world", "-o", str(file), *options]) == 0
    assert files[0].read_bytes() == files[1].read_bytes()
    bare = ElementTree.parse(files[2]).getroot()
    assert [model.attrib["name"] for model in bare.iter("model")] == ["floor", "room"]
    (version,) = {bare.attrib["version"]}
    assert version == "1.9"


def test_a_world_that_is_there_is_replaced_only_if_asked(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "world.sdf"
    path.write_text("mine")
    assert main(["world", "-o", str(path)]) == 1
    assert "--overwrite" in capsys.readouterr().err
    assert path.read_text() == "mine"
    assert main(["world", "-o", str(path), "--overwrite"]) == 0
    assert path.read_text().startswith("<?xml")


def test_the_topics_are_each_named_once() -> None:
    names = [value for key, value in vars(gazebo_robot).items() if key.endswith("_TOPIC")]
    assert len(names) == len(set(names)) == 5
