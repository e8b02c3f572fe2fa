"""Scans and readings that are nothing but their stamps."""

from collections.abc import Callable

import numpy as np
import pytest

from contourslam.scan import LaserScan, Odometry


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
