"""What a calibration leaves over, drawn into the frame of the pictures."""

import math

import numpy as np
from numpy.typing import NDArray

from contourslam.robot.camera.calibration import Calibration
from contourslam.robot.camera.opencv import opencv

_LONGEST = 0.03  # of the picture's width: that long is the usual residual drawn
_PAPER, _RINGS, _TEXT = (255, 255, 255), (205, 205, 205), (90, 90, 90)
_USED, _LEFT_OUT = (150, 80, 20), (30, 30, 220)  # blue, green, red


def residual_picture(found: Calibration) -> bytes:
    """Draw each corner, and from it, enlarged, where the lens expects it; rings tell each 30 degrees off the axis.

    Blue are the corners used, red those of views left out.

    Parameters
    ----------
    found : Calibration

    Returns
    -------
    bytes
        A PNG.
    """
    cv2 = opencv()
    model = found.model
    canvas: NDArray[np.uint8] = np.full((model.height, model.width, 3), _PAPER, np.uint8)
    around = np.linspace(0.0, 2.0 * math.pi, 181)
    edge = int(0.5 * model.field_of_view_deg)
    for degrees in (*range(30, edge, 30), edge):
        angle = math.radians(degrees)
        rays = np.column_stack(
            [math.sin(angle) * np.cos(around), math.sin(angle) * np.sin(around), np.full(around.size, math.cos(angle))]
        )
        ring = np.rint(model.project(rays)[0]).astype(np.int32)
        cv2.polylines(canvas, [ring.reshape(-1, 1, 2)], False, _RINGS, 1, cv2.LINE_AA)
        _write(canvas, f"{degrees} deg", tuple(int(value) for value in ring[22]))
    usual = max(found.rms, 1e-3)
    enlarged = max(_LONGEST * model.width / 2.0 / usual, 1.0)
    for view in found.views:
        colour = _USED if view.used else _LEFT_OUT
        # Fractions of a pixel count: the coordinates are in sixteenths.
        starts = np.rint(16.0 * view.corners).astype(np.int64)
        ends = np.rint(16.0 * (view.corners + np.clip(-enlarged * view.residuals, -200.0, 200.0))).astype(np.int64)
        for start, end in zip(starts.tolist(), ends.tolist(), strict=True):
            cv2.line(canvas, start, end, colour, 1, cv2.LINE_AA, 4)
            cv2.circle(canvas, start, 24, colour, -1, cv2.LINE_AA, 4)
    text = (
        f"{found.rms:.3f} pixels r.m.s. over {sum(view.used for view in found.views)} pictures; drawn {enlarged:.0f}x"
    )
    _write(canvas, text, (8, model.height - 10))
    return bytes(cv2.imencode(".png", canvas)[1].tobytes())


def _write(canvas: NDArray[np.uint8], text: str, where: tuple[int, ...]) -> None:
    cv2 = opencv()
    size = max(canvas.shape[1] / 1600.0, 0.35)
    cv2.putText(canvas, text, where, cv2.FONT_HERSHEY_SIMPLEX, size, _TEXT, 1, cv2.LINE_AA)
