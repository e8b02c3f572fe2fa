"""The occupancy grid as the picture and the YAML file that Nav2's map server and ROS 1's load."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from contourslam.atomic import write_bytes, write_text
from contourslam.report.occupancy import FREE, OCCUPIED, OccupancyGrid

_BLACK, _GREY, _WHITE = 0, 205, 254
_YAML = """\
image: {image}
mode: trinary
resolution: {resolution:.6g}
origin: [{x:.6f}, {y:.6f}, 0.0]
negate: 0
occupied_thresh: 0.65
free_thresh: 0.196
"""
# The map server reads a pixel as (255 - p)/255 occupied: grey 205 is 0.19608, just above the free threshold: unknown.
# Nav2's own default of 0.25 would turn unknown into free.


def write_nav2_map(folder: Path, grid: OccupancyGrid) -> None:
    """Write ``map.pgm`` (binary, 8 bit) and ``map.yaml``.

    Parameters
    ----------
    folder : Path
        Where the two files go.
    grid : OccupancyGrid
        The map.

    Raises
    ------
    ResultError
        If a file cannot be written.
    """
    cells, (x, y) = grid.cells()
    pixels = pgm_pixels(cells)
    write_bytes(folder / "map.pgm", b"P5\n%d %d\n255\n" % (pixels.shape[1], pixels.shape[0]) + pixels.tobytes())
    write_text(folder / "map.yaml", _YAML.format(image="map.pgm", resolution=grid.resolution, x=x, y=y))


def pgm_pixels(cells: NDArray[np.int8]) -> NDArray[np.uint8]:
    """Grey values of the picture: black occupied, white free, grey unknown; its first row has the largest y.

    Parameters
    ----------
    cells : ndarray of int8, shape (rows, columns)
        As :meth:`OccupancyGrid.cells` gives them.

    Returns
    -------
    ndarray of uint8, shape (rows, columns)
    """
    grey = np.where(cells == OCCUPIED, _BLACK, np.where(cells == FREE, _WHITE, _GREY)).astype(np.uint8)
    return np.ascontiguousarray(grey[::-1])
