"""A 3-D picture of a room, seen from above like a doll's house (the paper's Fig. 4)."""

import math
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contourslam.errors import MissingExtraError, ResultError
from contourslam.simulation.config import RobotModel
from contourslam.simulation.mjcf import import_mujoco
from contourslam.simulation.offscreen import drawing_errors, open_context
from contourslam.simulation.robot import Standing, draw_flaws
from contourslam.simulation.room import Room
from contourslam.simulation.world import compile_world

Floats = NDArray[np.float64]
_COLOURS = (
    (0.84, 0.15, 0.16), (0.12, 0.47, 0.71), (0.17, 0.63, 0.17), (1.00, 0.50, 0.05), (0.58, 0.40, 0.74),
    (0.09, 0.75, 0.81), (0.89, 0.47, 0.76), (0.55, 0.34, 0.29), (0.74, 0.74, 0.13), (0.30, 0.30, 0.30),
)  # fmt: skip
_WIDE, _PIECE = 0.04, 0.2  # m: half of the width of a way, and the least length of its pieces


def render_room(
    room: Room,
    path: Path,
    *,
    ways: Sequence[Floats] = (),
    width: int = 1280,
    height: int = 860,
    azimuth_deg: float = 70.0,
) -> None:
    """Render a room with the robot at its start into a PNG file, or with several robots and the ways they drove.

    Works without a screen: where neither a display nor ``MUJOCO_GL`` is set, MuJoCo draws through EGL.

    Parameters
    ----------
    room : Room
    path : Path
        The picture, overwritten if there.
    ways : sequence of ndarray, shape (n, 3)
        True poses of each robot (m, m, rad), which stands at the last of them; each has a colour of its own.
    width, height : int
        Pixels, at most 1920 x 1200.
    azimuth_deg : float
        Direction in which the camera looks, counter-clockwise from the x axis, degrees.

    Raises
    ------
    MissingExtraError
        If MuJoCo or matplotlib is not installed.
    ResultError
        If no picture can be drawn or written.
    """
    mujoco = import_mujoco()
    try:
        from matplotlib.image import imsave
    except ImportError as error:
        raise MissingExtraError("pictures need matplotlib: pip install 'contourslam[report]'") from error
    poses = [way[-1] for way in ways] or [room.start]
    model = compile_world(room, [Standing(RobotModel(), draw_flaws(0), pose) for pose in poses])
    _open_walls(model, mujoco, azimuth_deg)
    camera = _camera(mujoco, room, width / height, azimuth_deg)
    if ways:  # from so high that the walls do not hide them
        camera.elevation = -78.0
    try:
        imsave(path, _draw(mujoco, model, camera, ways, width, height))
    except drawing_errors(mujoco) as error:
        raise ResultError(f"no picture of room {room.name} in {path}: {error}; try MUJOCO_GL=osmesa") from error


def _draw(mujoco: Any, model: Any, camera: Any, ways: Sequence[Floats], width: int, height: int) -> NDArray[np.uint8]:
    """Draw without a window, shape (height, width, 3)."""
    window = open_context(width, height)
    try:
        window.make_current()
        lines = [_simplified(way) for way in ways]
        most = 2 * model.ngeom + 100 + sum(len(line) for line in lines)
        data, scene = mujoco.MjData(model), mujoco.MjvScene(model, maxgeom=most)
        mujoco.mj_forward(model, data)
        context = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, context)
        every = mujoco.mjtCatBit.mjCAT_ALL
        mujoco.mjv_updateScene(model, data, mujoco.MjvOption(), mujoco.MjvPerturb(), camera, every, scene)
        for number, line in enumerate(lines):
            _add_way(mujoco, scene, line, _COLOURS[number % len(_COLOURS)])
        frame, pixels = mujoco.MjrRect(0, 0, width, height), np.zeros((height, width, 3), dtype=np.uint8)
        mujoco.mjr_render(frame, scene, context)
        mujoco.mjr_readPixels(pixels, None, frame, context)
        context.free()
        return pixels[::-1]
    finally:
        window.free()


def _simplified(way: Floats) -> Floats:
    """Points of a way, at least so far apart that it is drawn in few pieces, shape (n, 2), m."""
    kept = [way[0, :2]]
    for point in way[:, :2]:
        if np.hypot(*(point - kept[-1])) > _PIECE:
            kept.append(point)
    return np.array([*kept, way[-1, :2]])


def _add_way(mujoco: Any, scene: Any, line: Floats, colour: tuple[float, float, float]) -> None:
    """Lay a way on the floor."""
    rgba = np.array([*colour, 1.0], dtype=np.float32)
    for start, end in pairwise(np.column_stack([line, np.full(len(line), _WIDE)])):
        geom = scene.geoms[scene.ngeom]
        mujoco.mjv_initGeom(geom, mujoco.mjtGeom.mjGEOM_CAPSULE, np.zeros(3), np.zeros(3), np.zeros(9), rgba)
        mujoco.mjv_connector(geom, mujoco.mjtGeom.mjGEOM_CAPSULE, _WIDE, start, end)
        scene.ngeom += 1


def _open_walls(model: Any, mujoco: Any, azimuth_deg: float) -> None:
    """Make the walls between the camera and the room all but transparent."""
    view = np.array([math.cos(math.radians(azimuth_deg)), math.sin(math.radians(azimuth_deg))])
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    for geom in range(model.ngeom):
        if model.geom(geom).name.startswith("wall"):
            outward = -data.geom_xmat[geom].reshape(3, 3)[:2, 1]
            if outward @ view < -0.2:
                model.geom_rgba[geom, 3] = 0.12


def _camera(mujoco: Any, room: Room, aspect: float, azimuth_deg: float) -> Any:
    outline = np.array(room.outline)
    low, high = outline.min(axis=0), outline.max(axis=0)
    camera = mujoco.MjvCamera()
    camera.lookat = [*((low + high) / 2), 0.2]
    camera.azimuth, camera.elevation = azimuth_deg, -52.0
    turn = math.radians(azimuth_deg)
    across = abs(math.sin(turn)) * (high[0] - low[0]) + abs(math.cos(turn)) * (high[1] - low[1])
    along = abs(math.cos(turn)) * (high[0] - low[0]) + abs(math.sin(turn)) * (high[1] - low[1])
    half_view = math.tan(math.radians(45.0 / 2))  # MuJoCo's vertical field of view is 45 degrees
    camera.distance = 0.5 * max(across / aspect, 0.85 * along) / half_view + 0.35 * along
    return camera
