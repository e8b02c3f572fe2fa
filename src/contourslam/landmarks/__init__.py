"""Landmarks of a scan: corners refined to sub-beam accuracy and walls, with covariance."""

from contourslam.landmarks.corner import Corners, refine_corners
from contourslam.landmarks.detect import Detection, detect, find_corners, find_landmarks, trace
from contourslam.landmarks.wall import Walls, extract_walls

__all__ = [
    "Corners",
    "Detection",
    "Walls",
    "detect",
    "extract_walls",
    "find_corners",
    "find_landmarks",
    "refine_corners",
    "trace",
]
