"""OpenCV, imported where it is needed."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from contourslam.errors import MissingExtraError
from contourslam.recordings.picture import Picture


def opencv() -> Any:
    """Import OpenCV.

    Raises
    ------
    MissingExtraError
        If it is not installed.
    """
    try:
        import cv2
    except ImportError as error:
        raise MissingExtraError("OpenCV is not installed; run: pip install 'contourslam[camera]'") from error
    return cv2


def decode(picture: Picture, *, grey: bool = False) -> NDArray[np.uint8] | None:
    """Decode a picture.

    Parameters
    ----------
    picture : Picture
    grey : bool
        As brightness alone.

    Returns
    -------
    ndarray of uint8, shape (height, width, 3) or (height, width), or None
        Red, green and blue, or brightness; None where the data is damaged.
    """
    cv2 = opencv()
    flag = cv2.IMREAD_GRAYSCALE if grey else cv2.IMREAD_COLOR
    try:
        pixels = cv2.imdecode(np.frombuffer(picture.data, np.uint8), flag | cv2.IMREAD_IGNORE_ORIENTATION)
    except cv2.error:
        return None
    if pixels is None:
        return None
    found: NDArray[np.uint8] = pixels if grey else cv2.cvtColor(pixels, cv2.COLOR_BGR2RGB)
    return found


def encode_jpeg(pixels: NDArray[np.uint8], quality: int = 90) -> bytes:
    """Compress pixels as OpenCV has them: blue, green, red, or brightness alone."""
    cv2 = opencv()
    return bytes(cv2.imencode(".jpg", pixels, [cv2.IMWRITE_JPEG_QUALITY, quality])[1].tobytes())
