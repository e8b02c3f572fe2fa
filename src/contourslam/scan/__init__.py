"""Scans and odometry as they come from the sensors, and the undoing of motion during a scan."""

from contourslam.scan.laser_scan import LaserScan, evenly_spaced
from contourslam.scan.odometry import Odometry, TruePose

__all__ = ["LaserScan", "Odometry", "TruePose", "evenly_spaced"]
