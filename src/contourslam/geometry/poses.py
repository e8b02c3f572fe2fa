"""Poses in the plane, SE(2): rows of x (m), y (m), heading (rad); every function takes one pose or an array of them."""

import math

import numpy as np
from numpy.typing import NDArray

from contourslam.geometry.angles import wrap, wrap_angle
from contourslam.kernels import kernel

Floats = NDArray[np.float64]


def compose(first: Floats, second: Floats) -> Floats:
    """Pose reached by `second` starting at `first` (``T_a_c = T_a_b @ T_b_c``).

    Parameters
    ----------
    first, second : ndarray, shape (..., 3)
        Poses; the leading shapes broadcast.

    Returns
    -------
    ndarray, shape (..., 3)
    """
    first, second = np.asarray(first), np.asarray(second)
    cos, sin = np.cos(first[..., 2]), np.sin(first[..., 2])
    return np.stack(
        [
            first[..., 0] + cos * second[..., 0] - sin * second[..., 1],
            first[..., 1] + sin * second[..., 0] + cos * second[..., 1],
            wrap(first[..., 2] + second[..., 2]),
        ],
        axis=-1,
    )


def between(first: Floats, second: Floats) -> Floats:
    """Pose `second` seen from pose `first` (``T_a_b = inv(T_w_a) @ T_w_b``).

    Parameters
    ----------
    first, second : ndarray, shape (..., 3)
        Poses in one frame; the leading shapes broadcast.

    Returns
    -------
    ndarray, shape (..., 3)
    """
    first, second = np.asarray(first), np.asarray(second)
    cos, sin = np.cos(first[..., 2]), np.sin(first[..., 2])
    dx, dy = second[..., 0] - first[..., 0], second[..., 1] - first[..., 1]
    return np.stack([cos * dx + sin * dy, -sin * dx + cos * dy, wrap(second[..., 2] - first[..., 2])], axis=-1)


@kernel
def compose_one(first: Floats, second: Floats) -> Floats:
    """:func:`compose` for single poses of shape (3,): a kernel, for loops and for what runs once a scan."""
    cos, sin = math.cos(first[2]), math.sin(first[2])
    out = np.empty(3)
    out[0] = first[0] + cos * second[0] - sin * second[1]
    out[1] = first[1] + sin * second[0] + cos * second[1]
    out[2] = wrap_angle(first[2] + second[2])
    return out


@kernel
def between_one(first: Floats, second: Floats) -> Floats:
    """:func:`between` for single poses of shape (3,): a kernel, for loops and for what runs once a scan."""
    cos, sin = math.cos(first[2]), math.sin(first[2])
    dx, dy = second[0] - first[0], second[1] - first[1]
    out = np.empty(3)
    out[0], out[1], out[2] = cos * dx + sin * dy, -sin * dx + cos * dy, wrap_angle(second[2] - first[2])
    return out


@kernel
def interpolate_one(stamps: Floats, poses: Floats, wanted: float, clamped: bool) -> Floats:
    """:func:`interpolate` for one time: a kernel; not `clamped`, it goes on at the twist of the nearest readings."""
    n = stamps.size
    if n == 1:
        return compose_one(np.zeros(3), poses[0])
    i = min(max(int(np.searchsorted(stamps, wanted, side="right")) - 1, 0), n - 2)
    span = stamps[i + 1] - stamps[i]
    weight = (wanted - stamps[i]) / span if span > 0.0 else 0.0
    if clamped:
        weight = min(max(weight, 0.0), 1.0)
    return compose_one(poses[i], between_one(poses[i], poses[i + 1]) * weight)


def inverse(pose: Floats) -> Floats:
    """Pose of the old origin seen from `pose`.

    Parameters
    ----------
    pose : ndarray, shape (..., 3)

    Returns
    -------
    ndarray, shape (..., 3)
    """
    return between(pose, np.zeros(3))


def transform(pose: Floats, points: Floats) -> Floats:
    """Points given in the frame of `pose`, in the frame the pose is given in.

    Parameters
    ----------
    pose : ndarray, shape (3,)
    points : ndarray, shape (..., 2)
        m.

    Returns
    -------
    ndarray, shape (..., 2)
    """
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    rotation = np.array([[cos, -sin], [sin, cos]])
    return np.asarray(np.asarray(points) @ rotation.T + np.asarray(pose)[:2])


def interpolate(stamps: Floats, poses: Floats, wanted: Floats) -> Floats:
    """Poses at the wanted times, moving straight and turning evenly between neighbours; clamped at both ends.

    Parameters
    ----------
    stamps : ndarray, shape (n,)
        Ascending, s.
    poses : ndarray, shape (n, 3)
    wanted : ndarray, shape (m,)
        s.

    Returns
    -------
    ndarray, shape (m, 3)
    """
    if len(stamps) == 1:
        return np.repeat(poses, len(wanted), axis=0)
    index = np.clip(np.searchsorted(stamps, wanted, side="right") - 1, 0, len(stamps) - 2)
    span = np.maximum(stamps[index + 1] - stamps[index], 1e-12)
    weight = np.clip((wanted - stamps[index]) / span, 0.0, 1.0)
    return compose(poses[index], between(poses[index], poses[index + 1]) * weight[:, None])
