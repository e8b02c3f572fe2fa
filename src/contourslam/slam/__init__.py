"""EKF-SLAM over corners and walls (eqs 23-31): one streaming object."""

from contourslam.slam.landmark_map import CornerMap, WallMap
from contourslam.slam.result import RunResult, ScanUpdate
from contourslam.slam.slam import ContourSlam

__all__ = ["ContourSlam", "CornerMap", "RunResult", "ScanUpdate", "WallMap"]
