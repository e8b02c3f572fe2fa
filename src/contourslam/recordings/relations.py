"""Known relative poses between pairs of times, the reference of the relation metric."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from contourslam.recordings.text import number_rows

Floats = NDArray[np.float64]


def read_relations(path: str | Path) -> tuple[Floats, Floats]:
    """Read a relations file (Kuemmerle et al. 2009): rows ``t1 t2 dx dy dz roll pitch yaw``, plain, gzip or xz.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    stamps : ndarray, shape (n, 2)
        The two times of each relation, s.
    poses : ndarray, shape (n, 3)
        The pose at the second time seen from the pose at the first: x (m), y (m), heading (rad).

    Raises
    ------
    RecordingError
        If the file cannot be read or a row is malformed; the message names the line.
    """
    rows, _ = number_rows(Path(path), (8,))
    return rows[:, :2], rows[:, [2, 3, 7]]
