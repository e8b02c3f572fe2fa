"""The model of the camera; it is kept in the geometry, as recordings hold one too."""

from contourslam.geometry.fisheye import FisheyeModel

__all__ = ["FisheyeModel"]
