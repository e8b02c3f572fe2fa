"""Scans and readings that are nothing but their stamps, and a robot that drives round a room, message by message."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray

from contourslam.geometry.poses import compose
from contourslam.scan import LaserScan, Odometry

Floats = NDArray[np.float64]
Message = LaserScan | Odometry

OUTLINE = [[-3.0, -2.5], [4.0, -2.5], [4.0, 3.0], [1.5, 3.0], [1.5, 2.0], [-3.0, 2.0]]
BOX = [[1.2, -0.4], [1.2, 0.6], [2.4, 0.6], [2.4, -0.4]]
RATE = 0.5  # rad/s along a circle of RADIUS m
RADIUS = 0.9
BEAMS = 360


def _scan_at(stamp: float, duration: float = 0.1) -> LaserScan:
    return LaserScan(stamp, np.array([0.0, 1.0]), np.array([2.0, 2.0]), np.array([0.0, duration]), 0.1, 10.0)


def _reading_at(stamp: float, x: float = 0.0, y: float = 0.0, heading: float = 0.0) -> Odometry:
    return Odometry(stamp, np.array([x, y, heading]))


@pytest.fixture(scope="session")
def scan_at() -> Callable[..., LaserScan]:
    return _scan_at


@pytest.fixture(scope="session")
def reading_at() -> Callable[..., Odometry]:
    return _reading_at


def true_pose(time: float) -> Floats:
    """Base in the room at a time of the drive, s."""
    turn = RATE * time
    return np.array([RADIUS * math.sin(turn), -RADIUS * math.cos(turn), math.remainder(turn, 2.0 * math.pi)])


@dataclass(frozen=True)
class Stream:
    """A drive as a robot's computer hears of it.

    Attributes
    ----------
    messages : list of (float, LaserScan or Odometry)
        Each with its arrival on the computer's clock, s, in that order.
    start : float
        Stamp at which the drive began, s.
    """

    messages: list[tuple[float, Message]]
    start: float

    def truth(self, stamp: float) -> Floats:
        return true_pose(stamp - self.start)

    def without(self, kind: type, first: float, last: float) -> "Stream":
        """The same drive, one sensor silent between two times after its start, s."""
        kept = [(t, m) for t, m in self.messages if not (isinstance(m, kind) and first <= m.stamp - self.start < last)]
        return Stream(kept, self.start)


def _stream(
    seconds: float, *, start: float = 1000.0, arrival: float = 0.0, seed: int = 0, standing: bool = False
) -> Stream:
    """Scans ten times a second, each beam at its own time, and odometry that drifts, 25 times a second."""
    rng = np.random.default_rng(seed)
    segments = np.concatenate([np.stack([np.array(p), np.roll(p, -1, axis=0)], axis=1) for p in (OUTLINE, BOX)])
    angles = -math.pi + 2.0 * math.pi / BEAMS * np.arange(BEAMS)
    offsets = 0.08 / BEAMS * np.arange(BEAMS)
    messages: list[tuple[float, Message]] = []
    for k in range(int(25 * seconds) + 4):
        time = 0.04 * k
        turn = 0.0 if standing else 1.02 * RATE * time
        wheels = np.array([1.03 * RADIUS * math.sin(turn), 1.03 * RADIUS * (1.0 - math.cos(turn)), turn])
        wheels[2] = math.remainder(wheels[2], 2.0 * math.pi)
        messages.append((arrival + time + 0.002, Odometry(start + time, compose(np.array([7.0, -3.0, 1.0]), wheels))))
    for k in range(int(10 * seconds)):
        time = 0.1 * k
        poses = [true_pose(0.0 if standing else time + offset) for offset in offsets]
        ranges = _cast(segments, np.array(poses), angles) + 0.005 * rng.standard_normal(BEAMS)
        messages.append((arrival + time + 0.081, LaserScan(start + time, angles, ranges, offsets, 0.05, 30.0)))
    messages.sort(key=lambda entry: entry[0])
    return Stream(messages, start)


def _cast(segments: Floats, poses: Floats, angles: Floats) -> Floats:
    """Range of each beam, from its own pose."""
    dx, dy = np.cos(angles + poses[:, 2])[:, None], np.sin(angles + poses[:, 2])[:, None]
    ax, ay = segments[:, 0, 0] - poses[:, :1], segments[:, 0, 1] - poses[:, 1:2]
    ex, ey = (segments[:, 1] - segments[:, 0]).T
    with np.errstate(divide="ignore", invalid="ignore"):
        along = (ax * ey - ay * ex) / (dx * ey - dy * ex)
        share = (ax * dy - ay * dx) / (dx * ey - dy * ex)
    return np.where((share >= 0.0) & (share <= 1.0) & (along > 0.0), along, np.inf).min(axis=1)


@pytest.fixture(scope="session")
def stream() -> Callable[..., Stream]:
    return _stream
