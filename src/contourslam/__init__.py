"""contourslam: maps a building as corners and walls from any 2-D lidar.

Importing the package is cheap: nothing is compiled and no heavy library is loaded until a stage is used.
"""

__version__ = "0.1.0"
