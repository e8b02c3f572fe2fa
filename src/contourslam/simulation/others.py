"""What a lidar sees of other robots: upright drums, each where it is at the time of each beam."""

import math

import numpy as np
from numpy.typing import NDArray

from contourslam.kernels import kernel
from contourslam.simulation.robot import Drum

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]
_NEAR = 0.6  # m: no part of a robot is farther from where its base is in the middle of a turn


def cast_others(
    origins: Floats,
    directions: Floats,
    found: tuple[Floats, Floats],
    steps: Indices,
    weights: Floats,
    positions: Floats,
    rotations: Floats,
    drums: tuple[Drum, ...],
    own: int,
) -> tuple[Floats, Floats]:
    """Range (m; inf where it meets nothing) and incidence (rad) of rays that may meet other robots.

    Parameters
    ----------
    origins, directions : ndarray, shape (n, 3)
        World frame, m; directions of unit length.
    found : tuple of ndarray, shape (n,)
        Range and incidence of what they meet of the room.
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
    return _cast(origins, directions, *found, steps, weights, positions, rotations, shapes, own)


@kernel
def _cast(
    origins: Floats,
    directions: Floats,
    ranges: Floats,
    incidences: Floats,
    steps: Indices,
    weights: Floats,
    positions: Floats,
    rotations: Floats,
    shapes: Floats,
    own: int,
) -> tuple[Floats, Floats]:
    ranges, incidences = ranges.copy(), incidences.copy()
    count, middle = len(origins), steps[len(steps) // 2]
    for robot in range(positions.shape[1]):
        if robot == own:
            continue
        near_x, near_y = positions[middle, robot, 0], positions[middle, robot, 1]
        for n in range(count):
            x, y = near_x - origins[n, 0], near_y - origins[n, 1]
            across = x * directions[n, 1] - y * directions[n, 0]
            along = x * directions[n, 0] + y * directions[n, 1]
            if abs(across) > _NEAR or along < -_NEAR or along > ranges[n] + _NEAR:
                continue
            step, part = steps[n], weights[n]
            rest = 1.0 - part
            x = rest * positions[step, robot, 0] + part * positions[step + 1, robot, 0] - origins[n, 0]
            y = rest * positions[step, robot, 1] + part * positions[step + 1, robot, 1] - origins[n, 1]
            z = rest * positions[step, robot, 2] + part * positions[step + 1, robot, 2] - origins[n, 2]
            axes = rest * rotations[step, robot] + part * rotations[step + 1, robot]
            for k in range(len(shapes)):
                distance, sine = _meet(
                    x + shapes[k, 0] * axes[0, 0] + shapes[k, 1] * axes[0, 2],
                    y + shapes[k, 0] * axes[1, 0] + shapes[k, 1] * axes[1, 2],
                    z + shapes[k, 0] * axes[2, 0] + shapes[k, 1] * axes[2, 2],
                    directions[n], shapes[k, 2], shapes[k, 3],
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
