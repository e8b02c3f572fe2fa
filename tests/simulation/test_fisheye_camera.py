"""What the simulated camera shows is what its model says: where, and in which colour."""

import io
import sys
import threading
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

pytest.importorskip("mujoco", reason="needs the extra 'simulation'")
pytest.importorskip("shapely", reason="needs the extra 'simulation'")

from contourslam.errors import ConfigError, MissingExtraError, ResultError
from contourslam.geometry.fisheye import FisheyeModel
from contourslam.geometry.rigid import from_planar, inverse
from contourslam.scan import Odometry
from contourslam.simulation import offscreen
from contourslam.simulation.camera import FisheyeCamera, _develop
from contourslam.simulation.config import CameraModel, SimulationConfig
from contourslam.simulation.filming import film
from contourslam.simulation.pieces import DARK_WOOD, GREEN, Box, Cylinder
from contourslam.simulation.room import Room
from contourslam.simulation.simulate import simulate
from contourslam.simulation.textured_world import illumination
from contourslam.simulation.textures import RoomTextures, room_textures

Floats = NDArray[np.float64]

ROOM = Room(
    "small",
    "a room with a cupboard and a column",
    ((0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0)),
    (Box(3.2, 0.6, 0.8, 0.6, 0.9, 20.0, colour=DARK_WOOD), Cylinder(0.4, 2.6, 0.15, 1.2, colour=GREEN)),
    ((1.2, 0.8), (2.4, 1.2), (2.4, 2.2), (1.2, 2.2)),
)
POSE = np.array([1.3, 1.4, 0.4])
SMALL = FisheyeModel(320, 320, 1.6, 210.0, 209.0, 0.1, 161.0, 158.5, -0.012, 0.002, 0.0004, -0.0003)
EVEN = CameraModel(SMALL, noise=0.0, vignetting=0.0, exposure_wander=0.0)


@pytest.fixture(scope="module")
def textures() -> RoomTextures:
    return room_textures(ROOM, 1)


@pytest.fixture(scope="module")
def even(textures: RoomTextures) -> Iterator[FisheyeCamera]:
    """A camera without any fault."""
    with FisheyeCamera(textures, EVEN, seed=1) as camera:
        yield ready(camera)


@pytest.fixture(scope="module")
def real(textures: RoomTextures) -> Iterator[FisheyeCamera]:
    """A camera with noise, a darker rim and an exposure that wanders."""
    with FisheyeCamera(textures, CameraModel(SMALL), seed=1) as camera:
        yield ready(camera)


def ready(camera: FisheyeCamera) -> FisheyeCamera:
    try:
        camera.render(POSE)
    except ResultError as error:
        pytest.skip(f"no graphics on this machine: {error}")
    return camera


def looked_up(camera: FisheyeCamera, pixels: Floats) -> tuple[Floats, NDArray[np.bool_]]:
    """Colours that the pixels must have by the textures and the light, and which of them meet a surface at all."""
    T_world_camera = from_planar(POSE) @ camera.T_base_camera
    rays, seen = camera.model.unproject(pixels)
    ahead, lens = rays @ T_world_camera[:3, :3].T, T_world_camera[:3, 3]
    nearest, colours = np.full(len(pixels), np.inf), np.full((len(pixels), 3), np.nan)
    for surface in camera.textures.surfaces:
        with np.errstate(all="ignore"):
            away = ((surface.corner - lens) @ surface.normal) / (ahead @ surface.normal)
            places = surface.places(lens + away[:, None] * ahead)
        across, below = places[:, 0], places[:, 1]
        inside = (across >= 0) & (across <= surface.width) & (below >= 0) & (below <= surface.height)
        hit = seen & inside & (away > 0) & (ahead @ surface.normal < 0) & (away < nearest)
        nearest[hit] = away[hit]
        colours[hit] = surface.colours(places[hit, :2]) * illumination(surface.normal)
    return colours, np.isfinite(nearest)


def test_colours_are_those_of_the_textures_in_their_light(even: FisheyeCamera) -> None:
    picture, own = even.render(POSE), even.own_body()
    pixels = np.random.default_rng(0).integers(0, 320, (6000, 2))
    angle = np.arccos(even.model.unproject(pixels)[0][:, 2])
    pixels = pixels[(angle < np.radians(107.0)) & ~own[pixels[:, 1], pixels[:, 0]]]
    wanted, found = looked_up(even, pixels.astype(np.float64))
    assert found.all()  # the room is closed
    shown = picture[pixels[:, 1], pixels[:, 0]].astype(np.float64)
    # A pixel is a mean over several texels: fine patterns differ, the middle does not.
    assert np.median(np.abs(shown - wanted)) < 3.0
    assert np.abs(np.mean(shown - wanted, axis=0)).max() < 1.5


@pytest.mark.parametrize(("side", "where"), [(0, 1.6), (0, 2.45), (1, 1.5), (2, 2.0), (2, 0.7)])
def test_an_upright_edge_is_seen_where_the_model_projects_it(
    even: FisheyeCamera, textures: RoomTextures, side: int, where: float
) -> None:
    """A wall painted black and white: the edge between is found in the picture to a part of a pixel."""
    wall = textures.walls[side]
    image = np.zeros_like(wall.image)
    image[:, round(where / wall.metres_per_pixel) :] = 255
    painted = tuple(replace(s, image=image) if s is wall else s for s in textures.surfaces)
    edge = wall.points([[round(where / wall.metres_per_pixel) * wall.metres_per_pixel, wall.height - 1.3]])
    T_camera_world = inverse(from_planar(POSE) @ even.T_base_camera)
    pixels, seen = even.model.project(edge @ T_camera_world[:3, :3].T + T_camera_world[:3, 3])
    if not seen[0]:
        pytest.fail("choose an edge that the camera sees")
    with FisheyeCamera(RoomTextures(ROOM, painted), EVEN) as camera:
        picture = camera.render(POSE)[:, :, 0].astype(np.float64)
    # Across the edge, the sum of dark pixels tells where it is: in the row for edges that are steep, else the column.
    (x, y), reach = pixels[0], 5
    along = wall.points([[where, wall.height - 1.25]])
    ahead = even.model.project(along @ T_camera_world[:3, :3].T + T_camera_world[:3, 3])[0][0] - pixels[0]
    steep = abs(ahead[1]) > abs(ahead[0])
    at, beside = (x, y) if steep else (y, x)
    # The edge is oblique: two rows are weighted to what it is at the very point.
    low, part = int(np.floor(beside)), beside - np.floor(beside)
    rows = [picture[low + k] if steep else picture[:, low + k] for k in (0, 1)]
    first = round(at) - reach
    profile = ((1 - part) * rows[0] + part * rows[1])[first : first + 2 * reach + 1]
    light = profile / profile.max()
    assert {round(float(light[0]), 1), round(float(light[-1]), 1)} == {0.0, 1.0}
    dark = np.sum(1.0 - light) if light[0] < 0.5 else np.sum(light)
    assert first - 0.5 + dark == pytest.approx(at, abs=0.2)


def test_the_same_seed_and_time_give_the_same_picture_and_others_another(
    real: FisheyeCamera, textures: RoomTextures
) -> None:
    first = real.render(POSE, 2.5)
    real.render([2.0, 1.0, 1.0], 3.0)
    np.testing.assert_array_equal(real.render(POSE, 2.5), first)
    assert (real.render(POSE, 3.0) != first).mean() > 0.3
    with FisheyeCamera(textures, real.camera, seed=1) as again:
        np.testing.assert_array_equal(again.render(POSE, 2.5), first)
    with FisheyeCamera(textures, real.camera, seed=2) as other:
        assert (other.render(POSE, 2.5) != first).mean() > 0.3


def test_noise_exposure_and_the_darker_rim_are_as_said(real: FisheyeCamera, even: FisheyeCamera) -> None:
    model, wanted = real.model, even.render(POSE).astype(np.float64)
    columns, rows = np.meshgrid(np.arange(model.width), np.arange(model.height))
    rays, seen = model.unproject(np.stack([columns.ravel(), rows.ravel()], axis=1))
    angle = np.arccos(np.clip(rays[:, 2], -1, 1)).reshape(wanted.shape[:2])
    inside = seen.reshape(angle.shape) & (angle < np.radians(105.0)) & (wanted.max(axis=2) < 210)
    gains = []
    for stamp in (1.0, 4.0, 9.0):
        gains.append(real.exposure(stamp))
        fall = 1.0 - real.camera.vignetting * (angle / model.half_view) ** 2
        off = real.render(POSE, stamp)[inside] - (wanted * (gains[-1] * fall)[..., None])[inside]
        assert abs(off.mean()) < 0.2
        assert off.std() == pytest.approx(real.camera.noise, rel=0.1)
    assert np.ptp(gains) > 0.02 and max(np.abs(np.log(gains))) <= real.camera.exposure_wander


def test_the_robot_shows_in_its_own_pixels_and_in_no_other(even: FisheyeCamera) -> None:
    own = even.own_body()
    moved = even.render([2.2, 1.9, POSE[2]]).astype(np.int64) - even.render(POSE)
    _, seen = even.model.unproject(np.argwhere(np.ones_like(own))[:, ::-1])
    seen = seen.reshape(own.shape)
    robot = own & seen
    assert 0.005 < robot.mean() < 0.1
    assert robot[: own.shape[0] // 2].sum() == 0  # it is below
    inner = robot & np.roll(robot, 2, 0) & np.roll(robot, -2, 0) & np.roll(robot, 2, 1) & np.roll(robot, -2, 1)
    assert np.abs(moved[inner]).max() <= 1
    assert (np.abs(moved[~own]).max(axis=1) > 3).mean() > 0.5


def test_a_pose_in_the_plane_is_the_same_as_its_matrix_and_a_tilt_is_not(even: FisheyeCamera) -> None:
    flat = even.render(POSE)
    np.testing.assert_array_equal(even.render(from_planar(POSE)), flat)
    tilted = from_planar(POSE) @ np.array([[1, 0, 0.05, 0], [0, 1, 0, 0], [-0.05, 0, 1, 0], [0, 0, 0, 1.0]])
    assert (np.abs(even.render(tilted).astype(np.int64) - flat) > 3).mean() > 0.1


@pytest.mark.parametrize("pose", [[0.0, 1.0], [0.0, np.nan, 1.0], np.eye(3)])
def test_a_pose_that_is_none_is_refused(even: FisheyeCamera, pose: object) -> None:
    with pytest.raises(ConfigError, match="base pose"):
        even.render(pose)


def test_another_thread_is_told_that_the_graphics_are_not_its_own(even: FisheyeCamera) -> None:
    said: list[Exception] = []

    def elsewhere() -> None:
        try:
            even.render(POSE)
        except ResultError as error:
            said.append(error)

    thread = threading.Thread(target=elsewhere)
    thread.start()
    thread.join()
    assert "thread that took the first picture" in str(said[0])


def test_without_graphics_the_error_says_so(textures: RoomTextures, monkeypatch: pytest.MonkeyPatch) -> None:
    def no_library(width: int, height: int) -> None:
        raise ImportError("Cannot initialize a EGL device display")

    monkeypatch.setattr(offscreen, "open_context", no_library)
    with FisheyeCamera(textures, EVEN) as camera, pytest.raises(ResultError, match=r"EGL.*MUJOCO_GL=osmesa"):
        camera.open()


@pytest.mark.parametrize(("module", "extra"), [("mujoco", "simulation"), ("PIL", "camera")])
def test_what_is_not_installed_is_named(
    textures: RoomTextures, monkeypatch: pytest.MonkeyPatch, module: str, extra: str
) -> None:
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(MissingExtraError, match=rf"contourslam\[{extra}\]"):
        FisheyeCamera(textures, EVEN).open()


def test_a_picture_is_a_jpeg_of_what_is_rendered(real: FisheyeCamera) -> None:
    image = pytest.importorskip("PIL.Image", reason="needs the extra 'camera'")
    picture = real.picture(POSE, 2.5)
    assert (picture.stamp, picture.encoding) == (2.5, "jpeg")
    decoded = np.asarray(image.open(io.BytesIO(picture.data)), dtype=np.float64)
    assert np.abs(decoded - real.render(POSE, 2.5)).mean() < 3.0


def test_a_film_is_the_drive_with_pictures_in_between(real: FisheyeCamera) -> None:
    pytest.importorskip("PIL", reason="needs the extra 'camera'")
    run = simulate(ROOM, SimulationConfig(duration=1.2), 5)
    done: list[float] = []
    messages = list(film(run, real, rate=4.0, progress=done.append))
    pictures = [m for m in messages if not hasattr(m, "pose") and not hasattr(m, "ranges")]
    assert [picture.stamp for picture in pictures] == [0.0, 0.25, 0.5, 0.75, 1.0]
    for plain, filmed in zip(run.messages(), [m for m in messages if m not in pictures], strict=True):
        assert type(plain) is type(filmed) and plain.stamp == filmed.stamp
    for picture in pictures:
        before = [m.stamp for m in messages[: messages.index(picture)] if isinstance(m, Odometry)]
        assert picture.stamp <= before[-1] < picture.stamp + 0.0201
    assert done == sorted(done) and 0.8 < done[-1] <= 1.0


def test_a_film_shows_what_is_seen_from_the_true_poses(real: FisheyeCamera) -> None:
    image = pytest.importorskip("PIL.Image", reason="needs the extra 'camera'")
    run = simulate(ROOM, SimulationConfig(duration=1.2), 5)
    *_, last = (m for m in film(run, real, rate=1.0) if not isinstance(m, Odometry) and hasattr(m, "data"))
    shown = np.asarray(image.open(io.BytesIO(last.data)), dtype=np.float64)
    there, before = (np.abs(shown - real.render(run.truth(np.array([t]))[0], last.stamp)).mean() for t in (1.0, 0.0))
    assert there < 4.0 < before


def test_the_developing_kernel_does_as_numpy_does() -> None:
    chance = np.random.default_rng(0)
    sheet = chance.integers(0, 256, (9, 12, 3), dtype=np.uint8)
    columns, rows = (chance.uniform(0, n - 1.01, (5, 7)).astype(np.float32) for n in (12, 9))
    factors = chance.uniform(0, 1.3, (5, 7)).astype(np.float32)
    noise = (3 * chance.standard_normal((5, 7, 3))).astype(np.float32)
    left, low = np.floor(columns).astype(int), np.floor(rows).astype(int)
    u, v = (columns - left)[..., None], (rows - low)[..., None]
    lower = (1 - u) * sheet[low, left] + u * sheet[low, left + 1]
    upper = (1 - u) * sheet[low + 1, left] + u * sheet[low + 1, left + 1]
    plain = ((1 - v) * lower + v * upper) * factors[..., None]
    for added in (noise, np.zeros((0, 0, 3), dtype=np.float32)):
        wanted = np.clip(plain + (added if added.size else 0.0), 0.0, 254.9).round()
        assert np.abs(_develop(sheet, columns, rows, factors, added) - wanted).max() <= 1


@pytest.mark.parametrize("wrong", [{"rate": 0.0}, {"noise": -1.0}, {"vignetting": 1.5}, {"jpeg_quality": 100}])
def test_a_camera_that_cannot_be_is_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(ConfigError, match=f"CameraModel.{next(iter(wrong))}"):
        CameraModel(**wrong)
