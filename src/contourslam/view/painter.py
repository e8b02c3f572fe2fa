"""A moment as the page gets it: the detectors are asked anew, so that nothing but the contours has to be kept."""

from collections import OrderedDict
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contourslam.config import Config
from contourslam.contour.contours import Floats
from contourslam.detectors import Detector
from contourslam.landmarks import find_landmarks
from contourslam.view.moment import LaneMoment, Moment
from contourslam.view.wire import pack

KEPT = 16  # messages, for several pages that ask for the same moment


class Painter:
    """Makes messages of moments; for one thread.

    Parameters
    ----------
    config : Config
    detectors : sequence of Detector
        One a lane.
    """

    def __init__(self, config: Config, detectors: Sequence[Detector]) -> None:
        self._config, self._detectors = config, detectors
        self._kept: OrderedDict[tuple[int, float, int], bytes] = OrderedDict()

    def paint(self, moment: Moment, knots: int) -> bytes:
        """Give the message of a moment; `knots` is how many lie behind it."""
        key = moment.index, moment.made, knots  # where a new map is begun, the scans are counted anew
        if key not in self._kept:
            self._kept[key] = self._paint(moment, knots)
            if len(self._kept) > KEPT:
                self._kept.popitem(last=False)
        return self._kept[key]

    def _paint(self, moment: Moment, knots: int) -> bytes:
        arrays: dict[str, NDArray[Any]] = {"points": moment.trace.points, "starts": moment.trace.starts}
        lanes = [self._lane(number, moment, lane, arrays) for number, lane in enumerate(moment.lanes)]
        header = {
            "index": moment.index,
            "elapsed": moment.elapsed,
            "knots": knots,
            "truth": moment.truth,
            "lanes": lanes,
        }
        return pack("frame", header, arrays)

    def _lane(self, number: int, moment: Moment, lane: LaneMoment, arrays: dict[str, NDArray[Any]]) -> dict[str, Any]:
        detector, update = self._detectors[number], lane.update
        found = find_landmarks(moment.trace.contours(), detector, self._config, walls=False)
        own: dict[str, NDArray[Any]] = {
            "curve": found.curve.points.astype(np.float32),
            "curve_starts": found.curve.starts.astype(np.int32),
            "response": found.response.astype(np.float32),
            "candidates": found.candidates.astype(np.int32),
            "corners": found.corners.positions.astype(np.float32),
        }
        seen = lane.sighting
        if seen is not None:
            own |= {"seen_ids": seen.ids, "seen": seen.points}
        arrays |= {f"{name}_{number}": values for name, values in own.items()}
        return {
            "pose": update.pose,
            "covariance": _upper(update.covariance),
            "nis": update.nis,
            "dof": update.nis_dof,
            "matched": update.matched,
            "missed": update.missed,
            "threshold": detector.threshold,
            "looked": seen is not None and seen.stamp == update.stamp,
            "seen_corners": 0 if seen is None else seen.corners,
            "stages": lane.stages,
            "localized": lane.localized,
        }


def _upper(covariance: Floats) -> list[float]:
    """xx, xy, yy, xt, yt, tt."""
    c = covariance.tolist()
    return [c[0][0], c[0][1], c[1][1], c[0][2], c[1][2], c[2][2]]
