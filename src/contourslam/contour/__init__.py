"""Contours: a scan as complex-valued chains of points, one for each surface (eqs 1-11)."""

from contourslam.contour.code import difference_code, polar_code
from contourslam.contour.contours import Contours
from contourslam.contour.equalization import equalize
from contourslam.contour.segmentation import segment

__all__ = ["Contours", "difference_code", "equalize", "polar_code", "segment"]
