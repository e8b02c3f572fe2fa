"""A map grows again only once the robot has been followed in it for long enough: a wrong place would spoil it."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from contourslam.config import Config, LiveConfig
from contourslam.live import resuming
from contourslam.live.resuming import Resuming
from contourslam.scan import LaserScan, Odometry
from contourslam.slam.result import ScanUpdate

Floats = NDArray[np.float64]
ScanAt = Callable[..., LaserScan]
LIVE = LiveConfig(sure_way=10.0, sure_time=15.0, give_up_after=20.0)
SPEED = 0.5  # m/s


class Follower:
    """Stands in for the localizer, or for the mapper that goes on: it drives straight on and is lost when told."""

    def __init__(self, lost: Callable[[float], bool] = lambda stamp: False) -> None:
        self._lost, self.localized = lost, False
        self.readings: list[Odometry] = []
        self.speed = SPEED
        self.start: tuple[Floats, Floats] | None = None

    def push_odometry(self, odometry: Odometry) -> None:
        self.readings.append(odometry)

    def push_scan(self, scan: LaserScan) -> ScanUpdate:
        self.localized = not self._lost(scan.stamp)
        pose = np.array([self.speed * scan.stamp, 0.0, 0.0])
        return ScanUpdate(scan.stamp, pose, 0.01 * np.eye(3), 0, 0, (), (), (), (), 0.0, 0, 1.0)


@pytest.fixture
def grown(monkeypatch: pytest.MonkeyPatch, scan_at: ScanAt) -> Callable[..., tuple[float, Follower]]:
    """Drive for a minute; gives when the map began to grow, and the mapper that then went on."""

    def drive(lost: Callable[[float], bool], *, speed: float = SPEED, begin: Any = None) -> tuple[float, Follower]:
        after = Follower()

        def go_on(
            saved: Any, covariance: Floats, config: Config, *, initial_pose: Floats, lidar_mount: Any, lap: Any
        ) -> Follower:
            after.start = initial_pose, covariance
            return after

        localizer = Follower(lost)
        localizer.speed = speed
        monkeypatch.setattr(resuming, "Localizer", lambda *_, **__: localizer)
        monkeypatch.setattr(resuming, "continue_mapper", go_on)
        mapper = Resuming("saved", Config(), LIVE, begin=begin)  # type: ignore[arg-type] # nothing looks into it
        for k in range(600):
            mapper.push_odometry(Odometry(0.1 * k, np.zeros(3)))
            mapper.push_scan(scan_at(0.1 * k))
            assert mapper.localized or lost(0.1 * k)
            if mapper.growing:
                return 0.1 * k, after
            assert mapper.keep({}) == "saved"
        return np.inf, after

    return drive


def test_it_grows_after_the_way_from_where_the_robot_is_then(grown: Callable[..., Any]) -> None:
    when, after = grown(lambda stamp: stamp < 2.0, speed=2.0)
    assert when == pytest.approx(2.0 + 10.0 / 2.0, abs=0.15)
    np.testing.assert_allclose(after.start[0], [2.0 * when, 0.0, 0.0])
    np.testing.assert_allclose(after.start[1], 0.01 * np.eye(3))
    assert after.readings[-1].stamp == pytest.approx(when)


def test_it_grows_after_the_time_where_the_robot_stands(grown: Callable[..., Any]) -> None:
    assert grown(lambda stamp: stamp < 2.0, speed=0.0)[0] == pytest.approx(17.0, abs=0.15)


def test_a_robot_lost_again_at_once_was_not_found(grown: Callable[..., Any]) -> None:
    when, _ = grown(lambda stamp: stamp < 2.0 or 4.0 < stamp < 9.0, speed=1.0)
    assert when == pytest.approx(19.0, abs=0.15)


def test_a_robot_that_drives_out_of_the_map_takes_it_along(grown: Callable[..., Any]) -> None:
    when, after = grown(lambda stamp: stamp > 7.0)
    assert when == pytest.approx(7.1, abs=0.05)
    np.testing.assert_allclose(after.start[0], [SPEED * when, 0.0, 0.0])


def test_a_robot_never_found_is_looked_for_without_end_unless_a_new_map_may_begin(grown: Callable[..., Any]) -> None:
    assert grown(lambda stamp: True)[0] == np.inf
    anew = Follower()
    when, after = grown(lambda stamp: True, begin=lambda: anew)
    assert when == pytest.approx(20.1, abs=0.05)
    assert after.start is None
    assert anew.readings


def test_it_gives_up_by_the_time_since_the_robot_was_last_known(grown: Callable[..., Any]) -> None:
    when, _ = grown(lambda stamp: not 15.0 < stamp < 16.0, begin=Follower)
    assert when == pytest.approx(36.1, abs=0.25)
