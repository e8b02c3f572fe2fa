"""Drawing without a window."""

import os
import sys
import threading
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contourslam.simulation.cube import Face

Floats = NDArray[np.float64]
Bytes = NDArray[np.uint8]


def open_context(width: int, height: int) -> Any:
    """Open a graphics context of MuJoCo's own kind (``mujoco.GLContext``), for the thread that calls.

    Works without a screen: where neither a display nor ``MUJOCO_GL`` is set, MuJoCo draws through EGL. The errors are
    those of :func:`drawing_errors`, whatever graphics library there is, or is not.
    """
    if sys.platform == "linux" and not os.environ.get("DISPLAY") and not os.environ.get("MUJOCO_GL"):
        # mujoco.Renderer would take the window system that was chosen when MuJoCo was imported; here is none.
        from mujoco.egl import GLContext
    else:
        from mujoco import GLContext
    return GLContext(width, height)


def drawing_errors(mujoco: Any) -> tuple[type[BaseException], ...]:
    """Errors that mean there are no graphics on this machine."""
    return ImportError, AttributeError, OSError, RuntimeError, ValueError, mujoco.FatalError


class CubeDrawing:
    """Draws the faces of a cube around a lens, side by side on one sheet, for the thread that makes it.

    Parameters
    ----------
    mujoco : module
    model : mujoco.MjModel
        What is drawn; its textures are copied to where the graphics are.
    faces : tuple of Face
    """

    def __init__(self, mujoco: Any, model: Any, faces: tuple[Face, ...]) -> None:
        self._mujoco, self._model, self._faces = mujoco, model, faces
        self._thread = threading.get_ident()
        width, height = faces[-1].left + faces[-1].columns, max(face.rows for face in faces)
        model.vis.global_.offwidth, model.vis.global_.offheight = width, height
        self._window = open_context(width, height)
        self._window.make_current()
        self._context = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._context)
        self._scene = mujoco.MjvScene(model, maxgeom=model.ngeom + 100)
        flags = mujoco.mjtRndFlag
        for flag in (flags.mjRND_SHADOW, flags.mjRND_REFLECTION, flags.mjRND_SKYBOX, flags.mjRND_HAZE):
            self._scene.flags[flag] = 0
        self._options, self._perturb, self._camera = mujoco.MjvOption(), mujoco.MjvPerturb(), mujoco.MjvCamera()
        self._sheet = np.zeros((height, width, 3), dtype=np.uint8)

    def draw(self, data: Any, T_world_camera: Floats) -> Bytes:
        """Draw all faces; returns the sheet, its lowest row first, valid until the next call."""
        if threading.get_ident() != self._thread:
            raise RuntimeError("its graphics belong to the thread that took the first picture")
        mujoco, scene = self._mujoco, self._scene
        self._window.make_current()
        every = mujoco.mjtCatBit.mjCAT_ALL
        mujoco.mjv_updateScene(self._model, data, self._options, self._perturb, self._camera, every, scene)
        for face in self._faces:
            _, up, forward = (T_world_camera[:3, :3] @ face.axes).T
            for eye in scene.camera:
                eye.pos[:], eye.forward[:], eye.up[:] = T_world_camera[:3, 3], forward, up
                eye.frustum_near, eye.frustum_far = face.near, face.far
                eye.frustum_center = face.near * face.middle
                eye.frustum_bottom, eye.frustum_top = face.near * face.bottom, face.near * face.top
            mujoco.mjr_render(mujoco.MjrRect(face.left, 0, face.columns, face.rows), scene, self._context)
        whole = mujoco.MjrRect(0, 0, self._sheet.shape[1], self._sheet.shape[0])
        mujoco.mjr_readPixels(self._sheet, None, whole, self._context)
        return self._sheet

    def close(self) -> None:
        """Give the graphics back."""
        self._context.free()
        self._window.free()
