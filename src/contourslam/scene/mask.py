"""What of the robot itself is in its pictures: the pixels that show the same whatever the robot drives by."""

import numpy as np
from numpy.typing import NDArray

from contourslam.scene.lens import Lens
from contourslam.scene.sampling import decode
from contourslam.scene.views import View

Bools = NDArray[np.bool_]

_LOOKED_AT = 40  # pictures
_FEWEST = 8  # pictures that tell
_DRIVEN = 1.5  # m between the farthest of them
_STILL, _NOISE = 0.12, 2.0  # a pixel that varies by less than a part of its brightness and this, of 255, is the robot's
_FOOTPRINT = 0.8  # m; a floor farther off may well be the same everywhere
_MARGIN = 2  # pixels
_WIDE = 800  # pixels; of larger pictures each second is looked at, or third


def robot_mask(views: tuple[View, ...], lens: Lens) -> Bools:
    """Find the pixels that show the robot.

    Parameters
    ----------
    views : tuple of View
    lens : Lens

    Returns
    -------
    ndarray of bool, shape (height, width)
        True where a picture is not to be used; nowhere where there are too few pictures to tell.
    """
    import cv2

    model = lens.model
    nothing = np.zeros((model.height, model.width), np.bool_)
    chosen = [views[n] for n in np.unique(np.linspace(0, len(views) - 1, _LOOKED_AT).astype(int))]
    places = np.array([view.pose[:2] for view in chosen])
    if len(chosen) < _FEWEST or np.ptp(places, axis=0).max() < _DRIVEN:
        return nothing
    each = -(-max(model.width, model.height) // _WIDE)
    grey = [
        cv2.GaussianBlur(cv2.cvtColor(pixels, cv2.COLOR_RGB2GRAY), (5, 5), 0)[::each, ::each]
        for view in chosen
        if (pixels := decode(view.picture, model)) is not None
    ]
    if len(grey) < _FEWEST:
        return nothing
    stack = np.stack(grey).astype(np.float32)
    stack *= (stack.mean() / np.maximum(stack.mean(axis=(1, 2)), 1.0))[:, None, None]
    low, middle, high = np.percentile(stack, (10, 50, 90), axis=0)
    still = high - low < _STILL * middle + _NOISE
    near = still & _under(lens)[::each, ::each]
    size = 2 * _MARGIN + 1
    grown = cv2.dilate(cv2.morphologyEx(near.astype(np.uint8), cv2.MORPH_OPEN, np.ones((3, 3))), np.ones((size, size)))
    whole = np.repeat(np.repeat(grown, each, axis=0), each, axis=1)[: model.height, : model.width]
    return np.asarray(whole, dtype=np.bool_)


def _under(lens: Lens) -> Bools:
    """Pixels whose rays meet the floor beside the robot."""
    rows, columns = np.indices((lens.model.height, lens.model.width))
    rays, seen = lens.model.unproject(np.stack([columns.ravel(), rows.ravel()], axis=1))
    stand = lens.stand(np.zeros(3))
    with np.errstate(all="ignore"):
        turned = rays @ stand[:3, :3].T
        place = stand[:2, 3] - turned[:, :2] * (stand[2, 3] / turned[:, 2:])
        near = seen & (turned[:, 2] < 0.0) & (np.hypot(*place.T) < _FOOTPRINT)
    return np.asarray(near.reshape(rows.shape))
