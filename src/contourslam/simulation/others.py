"""What a lidar sees of other robots: upright drums, each where it is at the time of each beam."""

import math

import numpy as np
from numpy.typing import NDArray

from contourslam.kernels import kernel
from contourslam.simulation.robot import Drum

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]


def cast_others(
    origins: Floats,
    directions: Floats,
    steps: Indices,
    weights: Floats,
    positions: Floats,
    rotations: Floats,
    drums: tuple[Drum, ...],
    own: int,
) -> tuple[Floats, Floats]:
    """Range (m; inf where it meets nothing) and incidence (rad) of rays that meet the drums of other robots.

    Parameters
    ----------
    origins, directions : ndarray, shape (n, 3)
        World frame, m; directions of unit length.
    steps, weights : ndarray, shape (n,)
        The moment before each beam, and which part of the time to the next one has passed.
    positions, rotations : ndarray, shape (moments, robots, 3) and (moments, robots, 3, 3)
        As of :class:`~contourslam.simulation.rolling.Moments`. The drums count as upright.
    drums : tuple of Drum
        Of every robot.
    own : int
        The robot that carries the lidar.
    """
    shapes = np.array([[drum.x, drum.z, drum.radius, drum.half] for drum in drums])
    return _cast(origins, directions, steps, weights, positions, rotations, shapes, own)


@kernel
def _cast(
    origins: Floats,
    directions: Floats,
    steps: Indices,
    weights: Floats,
    positions: Floats,
    rotations: Floats,
    shapes: Floats,
    own: int,
) -> tuple[Floats, Floats]:
    ranges, incidences = np.full(len(origins), np.inf), np.zeros(len(origins))
    for robot in range(positions.shape[1]):
        if robot == own:
            continue
        for n in range(len(origins)):
            step, part = steps[n], weights[n]
            before, after = positions[step, robot], positions[step + 1, robot]
            x = (1.0 - part) * before[0] + part * after[0] - origins[n, 0]
            y = (1.0 - part) * before[1] + part * after[1] - origins[n, 1]
            across = x * directions[n, 1] - y * directions[n, 0]
            if across * across > 0.25:  # far from every part of it
                continue
            z = (1.0 - part) * before[2] + part * after[2] - origins[n, 2]
            axes = rotations[step, robot]
            for shape in shapes:
                distance, sine = _meet(
                    x + shape[0] * axes[0, 0] + shape[1] * axes[0, 2],
                    y + shape[0] * axes[1, 0] + shape[1] * axes[1, 2],
                    z + shape[0] * axes[2, 0] + shape[1] * axes[2, 2],
                    directions[n], shape[2], shape[3],
                )  # fmt: skip
                if distance < ranges[n]:
                    ranges[n], incidences[n] = distance, math.asin(min(sine, 1.0))
    return ranges, incidences


@kernel
def _meet(x: float, y: float, z: float, ray: Floats, radius: float, half: float) -> tuple[float, float]:
    """Distance along a ray from the origin to an upright drum around (x, y, z), and the sine of the angle there."""
    flat = ray[0] * ray[0] + ray[1] * ray[1]
    middle = (x * ray[0] + y * ray[1]) / flat
    half_chord = (radius * radius - x * x - y * y) / flat + middle * middle
    if half_chord <= 0.0:
        return math.inf, 0.0
    half_chord = math.sqrt(half_chord)
    enter, leave, sine = middle - half_chord, middle + half_chord, half_chord * flat / radius
    if ray[2] != 0.0:  # between the planes of its two lids
        low, high = (z - half) / ray[2], (z + half) / ray[2]
        if min(low, high) > enter:
            enter, sine = min(low, high), abs(ray[2])
        leave = min(leave, max(low, high))
    elif abs(z) > half:
        return math.inf, 0.0
    if enter > leave or enter <= 0.0:
        return math.inf, 0.0
    return enter, sine
