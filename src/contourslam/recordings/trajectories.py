"""Trajectories as text: TUM rows and plain planar rows."""

import contextlib
import os
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contourslam.errors import RecordingError, ResultError
from contourslam.geometry.angles import wrap
from contourslam.recordings.text import number_rows

Floats = NDArray[np.float64]


def read_trajectory(path: str | Path) -> tuple[Floats, Floats]:
    """Read a trajectory; the number of values in a row tells which of two forms it has.

    Parameters
    ----------
    path : str or Path
        Rows ``t x y z qx qy qz qw`` (TUM) or ``t x y theta``; plain, gzip or xz; ``#`` starts a comment.

    Returns
    -------
    stamps : ndarray, shape (n,)
        In the order of the file, s.
    poses : ndarray, shape (n, 3)
        x (m), y (m), heading (rad); height, roll and pitch of a TUM row are dropped.

    Raises
    ------
    RecordingError
        If the file cannot be read or a row is malformed; the message names file and line.
    """
    rows, lines = number_rows(Path(path), (4, 8))
    if rows.shape[1] == 4:
        return rows[:, 0], np.column_stack([rows[:, 1:3], wrap(rows[:, 3])])
    qx, qy, qz, qw = rows[:, 4:].T
    poor = np.abs(np.linalg.norm(rows[:, 4:], axis=1) - 1.0) > 0.1
    if poor.any():
        raise RecordingError(f"{path}: line {lines[int(np.argmax(poor))]}: the quaternion is not of unit length")
    headings = np.arctan2(2.0 * (qw * qz + qx * qy), qw**2 + qx**2 - qy**2 - qz**2)
    return rows[:, 0], np.column_stack([rows[:, 1:3], headings])


def write_trajectory(path: str | Path, stamps: ArrayLike, poses: ArrayLike) -> None:
    """Write a trajectory in TUM's form; the file is either whole or not there.

    Stamps keep a nanosecond, positions and quaternions 1e-12.

    Parameters
    ----------
    path : str or Path
    stamps : array_like, shape (n,)
        s.
    poses : array_like, shape (n, 3)
        x (m), y (m), heading (rad).

    Raises
    ------
    ResultError
        If the shapes do not fit, a value is not finite, or the file cannot be written.
    """
    path = Path(path)
    times, rows = np.asarray(stamps, dtype=np.float64), np.asarray(poses, dtype=np.float64)
    if times.ndim != 1 or rows.shape != (len(times), 3):
        raise ResultError(f"{path}: stamps {times.shape} and poses {rows.shape} must have shapes (n,) and (n, 3)")
    if not (np.isfinite(times).all() and np.isfinite(rows).all()):
        raise ResultError(f"{path}: a stamp or pose of the trajectory is not finite")
    half = 0.5 * rows[:, 2]
    values = np.column_stack([times, rows[:, :2], np.sin(half), np.cos(half)]).tolist()
    text = "".join(f"{t:.9f} {x:.12f} {y:.12f} 0 0 0 {qz:.12f} {qw:.12f}\n" for t, x, y, qz, qw in values)
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        temporary.write_text(text, encoding="ascii")
        temporary.replace(path)
    except OSError as error:
        raise ResultError(f"{path}: cannot be written: {error.strerror or error}") from error
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)
