"""The fisheye camera: its model and calibration, where it sits beside the lidar, and pictures from it."""
