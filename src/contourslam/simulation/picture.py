"""A 3-D picture of a room, seen from above like a doll's house (the paper's Fig. 4)."""

import math
import os
from pathlib import Path
from typing import Any

import numpy as np

from contourslam.errors import MissingExtraError, ResultError
from contourslam.simulation.config import RobotModel
from contourslam.simulation.mjcf import import_mujoco
from contourslam.simulation.robot import draw_flaws
from contourslam.simulation.room import Room
from contourslam.simulation.world import compile_world


def render_room(room: Room, path: Path, *, width: int = 1280, height: int = 860, azimuth_deg: float = 70.0) -> None:
    """Render a room with the robot at its start into a PNG file.

    Works without a screen: where neither a display nor ``MUJOCO_GL`` is set, MuJoCo draws through EGL.

    Parameters
    ----------
    room : Room
    path : Path
        The picture, overwritten if there.
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
    if not os.environ.get("DISPLAY"):
        os.environ.setdefault("MUJOCO_GL", "egl")  # read when MuJoCo is first imported
    model = compile_world(room, RobotModel(), draw_flaws(0))
    mujoco = import_mujoco()
    try:
        from matplotlib.image import imsave
    except ImportError as error:
        raise MissingExtraError("pictures need matplotlib: pip install 'contourslam[report]'") from error
    _open_walls(model, mujoco, azimuth_deg)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    try:
        with mujoco.Renderer(model, height, width) as renderer:
            renderer.update_scene(data, _camera(mujoco, room, width / height, azimuth_deg))
            imsave(path, renderer.render())
    except (OSError, RuntimeError, ValueError, mujoco.FatalError) as error:
        raise ResultError(f"no picture of room {room.name} in {path}: {error}; try MUJOCO_GL=osmesa") from error


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
