"""Landmark detectors behind one contract; a fifth one is an entry more in `DETECTORS` or an object handed over."""

from collections.abc import Callable

from contourslam.detectors.contract import Detector
from contourslam.detectors.curvature_scale_space import CurvatureScaleSpace
from contourslam.detectors.matched_filter import MatchedFilter
from contourslam.detectors.suppression import suppress
from contourslam.detectors.teh_chin import TehChin
from contourslam.detectors.wu import Wu
from contourslam.errors import ConfigError
from contourslam.nearest import no_such

DETECTORS: dict[str, Callable[[bool], Detector]] = {
    "matched_filter": MatchedFilter,
    "wu": Wu,
    "teh_chin": TehChin,
    "curvature_scale_space": CurvatureScaleSpace,
}
"""Name to detector; called with ``adapted``, whether to use our adaptations to range noise."""


def make_detector(name: str, *, adapted: bool = True) -> Detector:
    """Detector by name.

    Parameters
    ----------
    name : str
        A key of `DETECTORS`.
    adapted : bool
        With our adaptations to range noise; off, as its source has it.

    Raises
    ------
    ConfigError
        If there is no such detector; the message lists those there are.
    """
    if name not in DETECTORS:
        raise ConfigError(no_such("detector", name, DETECTORS))
    return DETECTORS[name](adapted)


__all__ = [
    "DETECTORS",
    "CurvatureScaleSpace",
    "Detector",
    "MatchedFilter",
    "TehChin",
    "Wu",
    "make_detector",
    "suppress",
]
