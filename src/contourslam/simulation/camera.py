"""The simulated fisheye camera: pictures of a textured room from where the robot is.

A fisheye sees more than a plane can hold: the faces of a cube around the lens are drawn, as much of each as the lens
sees, and every pixel of the picture is looked up in them along its own ray.
"""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contourslam.closing import Closing
from contourslam.errors import ConfigError, MissingExtraError, ResultError
from contourslam.geometry.fisheye import FisheyeModel
from contourslam.geometry.rigid import from_planar
from contourslam.kernels import kernel
from contourslam.recordings.picture import Picture
from contourslam.simulation.chance import CAMERA
from contourslam.simulation.config import CameraModel, RobotModel
from contourslam.simulation.cube import Face, cube_faces
from contourslam.simulation.mjcf import import_mujoco
from contourslam.simulation.offscreen import CubeDrawing, drawing_errors
from contourslam.simulation.room import Room
from contourslam.simulation.textured_world import compile_textured_world
from contourslam.simulation.textures import RoomTextures, room_textures

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Bytes = NDArray[np.uint8]
_RIM = math.radians(1.5)  # within which the picture fades to black at the edge of the lens' view


class FisheyeCamera(Closing):
    """A fisheye camera on the robot; a context manager.

    The graphics belong to the thread in which the first picture is taken: take all others there, and close it there.

    Parameters
    ----------
    room : Room or RoomTextures
    camera : CameraModel, optional
    T_base_camera : array_like, shape (4, 4), optional
        Where the lens sits, in place of what `camera` says.
    robot : RobotModel, optional
        Whose body is in the picture's lower edge.
    seed : int
        Of the textures, of the noise and of how the exposure wanders.

    Attributes
    ----------
    camera : CameraModel
    T_base_camera : ndarray, shape (4, 4)
    robot : RobotModel
    taken : int
        How many pictures were taken.
    textures : RoomTextures
        What is painted on the room: the truth about the pictures.

    Raises
    ------
    MissingExtraError
        If MuJoCo is not installed.
    """

    def __init__(
        self,
        room: Room | RoomTextures,
        camera: CameraModel | None = None,
        *,
        T_base_camera: ArrayLike | None = None,
        robot: RobotModel | None = None,
        seed: int = 0,
    ) -> None:
        self._mujoco = import_mujoco()
        self.camera = camera or CameraModel()
        self.textures = room if isinstance(room, RoomTextures) else room_textures(room, seed)
        self.robot, self._seed = robot or RobotModel(), seed
        self.T_base_camera = self.camera.mount if T_base_camera is None else _as_matrix(T_base_camera)
        self._faces, self._columns, self._rows, self._factors = _plan(self.camera)
        self._model = compile_textured_world(self.textures, self.robot, self.T_base_camera)
        self._data = self._mujoco.MjData(self._model)
        self._graphics: CubeDrawing | None = None
        self.taken = 0

    @property
    def model(self) -> FisheyeModel:
        """Which pixel sees which ray."""
        return self.camera.model

    def exposure(self, stamp: float) -> float:
        """Gain of the picture at a time: the camera's own wandering, which a user of the pictures doesn't know."""
        phases = np.random.default_rng([self._seed, CAMERA]).uniform(0.0, 2 * math.pi, 2)
        swing = 0.6 * math.sin(stamp / 2.9 + phases[0]) + 0.4 * math.sin(stamp / 1.1 + phases[1])
        return math.exp(self.camera.exposure_wander * swing)

    def own_body(self) -> NDArray[np.bool_]:
        """Tell which pixels show the robot itself, wherever it is, or nothing at all; shape (height, width)."""
        self._place(np.eye(4))
        height, width = self.model.height, self.model.width
        columns, rows = np.meshgrid(np.arange(width), np.arange(height))
        rays, seen = self.model.unproject(np.stack([columns.ravel(), rows.ravel()], axis=1))
        ahead = np.ascontiguousarray(np.where(seen[:, None], rays, [0.0, 0.0, 1.0]) @ self.T_base_camera[:3, :3].T)
        geoms, ranges = np.empty(len(rays), dtype=np.int32), np.empty(len(rays))
        lens, far = np.ascontiguousarray(self.T_base_camera[:3, 3]), 10.0
        # All but the robot is fixed to the world, and left out.
        self._mujoco.mj_multiRay(
            self._model, self._data, lens, ahead.ravel(), None, False, -1, geoms, ranges, None, len(rays), far
        )
        return np.asarray(~seen | (geoms >= 0)).reshape(height, width)

    def render(self, pose: ArrayLike, stamp: float = 0.0) -> Bytes:
        """Take a picture.

        Parameters
        ----------
        pose : array_like, shape (3,) or (4, 4)
            Of the base in the world: x (m), y (m), heading (rad), or T_world_base with its tilts; the base frame's
            origin is on the floor below the middle of the axle.
        stamp : float
            Time of the picture, s; exposure and noise follow from it and the seed.

        Returns
        -------
        ndarray of uint8, shape (height, width, 3)
            Red, green, blue; black where the lens sees nothing. The same arguments give the same picture, to the last
            bit on one machine; another graphics library may round differently.

        Raises
        ------
        ResultError
            If there are no graphics on this machine, or another thread has the camera.
        """
        T_world_base = _as_matrix(pose)
        self.taken += 1
        self._place(T_world_base)
        sheet = self._drawn(T_world_base @ self.T_base_camera)
        height, width = self._columns.shape
        noise: Singles = np.zeros((0, 0, 3), dtype=np.float32)
        if self.camera.noise > 0:
            chance = np.random.default_rng([self._seed, CAMERA, round(abs(stamp) * 1e6)])
            noise = chance.standard_normal((height, width, 3), dtype=np.float32) * np.float32(self.camera.noise)
        return _develop(sheet, self._columns, self._rows, self._factors * np.float32(self.exposure(stamp)), noise)

    def picture(self, pose: ArrayLike, stamp: float) -> Picture:
        """Take a picture as JPEG; parameters and errors as :meth:`render`.

        Raises
        ------
        MissingExtraError
            If Pillow is not installed.
        """
        try:
            from PIL import Image
        except ImportError as error:
            raise MissingExtraError("pictures need Pillow: pip install 'contourslam[camera]'") from error
        import io

        data = io.BytesIO()
        Image.fromarray(self.render(pose, stamp)).save(data, "JPEG", quality=self.camera.jpeg_quality)
        return Picture(stamp, data.getvalue(), "jpeg")

    def open(self) -> None:
        """Open the graphics, which the first picture would do otherwise; errors as :meth:`picture`."""
        self.picture(self.textures.room.start, 0.0)
        self.taken = 0

    def close(self) -> None:
        """Give the graphics back; the next picture would open them anew."""
        if self._graphics is not None:
            self._graphics.close()
            self._graphics = None

    def _place(self, T_world_base: Floats) -> None:
        """Put the robot there, so that its own body is where the camera sees it."""
        quaternion = np.empty(4)
        self._mujoco.mju_mat2Quat(quaternion, np.ascontiguousarray(T_world_base[:3, :3]).ravel())
        self._data.qpos[:3] = T_world_base[:3, 3] + self.robot.wheel_radius * T_world_base[:3, 2]
        self._data.qpos[3:7] = quaternion
        self._mujoco.mj_kinematics(self._model, self._data)
        self._mujoco.mj_camlight(self._model, self._data)

    def _drawn(self, T_world_camera: Floats) -> Bytes:
        try:
            if self._graphics is None:
                self._graphics = CubeDrawing(self._mujoco, self._model, self._faces)
            return self._graphics.draw(self._data, T_world_camera)
        except drawing_errors(self._mujoco) as error:
            name = self.textures.room.name
            raise ResultError(f"no camera picture of room {name}: {error}; try MUJOCO_GL=osmesa") from error


def _plan(camera: CameraModel) -> tuple[tuple[Face, ...], Singles, Singles, Singles]:
    """The faces, where on their sheet each pixel of the picture is looked up, and how bright it comes out."""
    model = camera.model
    columns, rows = np.meshgrid(np.arange(model.width), np.arange(model.height))
    rays, seen = model.unproject(np.stack([columns.ravel(), rows.ravel()], axis=1))
    rays[~seen] = 0.0, 0.0, 1.0
    faces, at = cube_faces(rays, seen, camera.face_pixels)
    angle = np.arccos(np.clip(rays[:, 2], -1.0, 1.0))
    darker = 1.0 - camera.vignetting * (angle / model.half_view) ** 2
    rim = np.clip((model.half_view - angle) / _RIM, 0.0, 1.0)
    factors = np.where(seen, darker * rim, 0.0)
    shape = model.height, model.width
    column, row, factor = (
        np.ascontiguousarray(a.reshape(shape), dtype=np.float32) for a in (at[:, 0], at[:, 1], factors)
    )
    return faces, column, row, factor


@kernel
def _develop(sheet: Bytes, columns: Singles, rows: Singles, factors: Singles, noise: Singles) -> Bytes:
    """Look each pixel up between four of the sheet's, times its factor, plus the noise (none where it is empty)."""
    height, width = columns.shape
    out = np.zeros((height, width, 3), dtype=np.uint8)
    noisy = noise.shape[0] > 0
    for i in range(height):
        for j in range(width):
            if factors[i, j] <= 0.0 and not noisy:
                continue
            x, y = columns[i, j], rows[i, j]
            left, low = int(x), int(y)
            u, v = x - np.float32(left), y - np.float32(low)
            for c in range(3):
                lower = (np.float32(1.0) - u) * sheet[low, left, c] + u * sheet[low, left + 1, c]
                upper = (np.float32(1.0) - u) * sheet[low + 1, left, c] + u * sheet[low + 1, left + 1, c]
                value = ((np.float32(1.0) - v) * lower + v * upper) * factors[i, j]
                if noisy:
                    value += noise[i, j, c]
                out[i, j, c] = np.uint8(min(max(value + np.float32(0.5), np.float32(0.0)), np.float32(255.0)))
    return out


def _as_matrix(pose: ArrayLike) -> Floats:
    """T_world_base, shape (4, 4), of a pose in the plane or of itself."""
    pose = np.asarray(pose, dtype=np.float64)
    if pose.shape not in ((3,), (4, 4)) or not np.isfinite(pose).all():
        raise ConfigError(f"a camera's base pose must be finite, shape (3,) or (4, 4), got {pose!r}")
    if pose.shape == (4, 4):
        return pose
    return from_planar(pose)
