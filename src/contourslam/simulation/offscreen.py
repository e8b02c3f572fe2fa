"""Drawing without a window."""

import os
import sys
from typing import Any


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
