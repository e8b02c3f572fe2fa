"""Whatever comes, in whatever order: nothing breaks, nothing is lost without a count, and the transforms agree."""

import math
from collections.abc import Callable
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from contourslam.config import LiveConfig
from contourslam.errors import MapError
from contourslam.geometry.poses import between, compose
from contourslam.live.backing import Backing
from contourslam.live.session import Processed, Session
from contourslam.scan import LaserScan, Odometry
from contourslam.slam.result import ScanUpdate

Floats = NDArray[np.float64]
SPEED, TURN_RATE = 0.5, math.radians(20.0)
LIVE = LiveConfig(smooth_speed=SPEED, smooth_turn_rate_deg=20.0, large_correction=1e6, large_correction_deg=179.0)


class Corrected:
    """A mapper that follows the odometry, but for corrections that come with the scans' numbers."""

    start_pose = np.zeros(3)

    def __init__(self) -> None:
        self.odometry_pose: Floats = np.zeros(3)
        self.scans = 0
        self.offset: Floats = np.zeros(3)

    def push_odometry(self, odometry: Odometry) -> None:
        self.odometry_pose = odometry.pose

    def push_scan(self, scan: LaserScan) -> ScanUpdate:
        self.scans += 1
        if self.scans % 11 == 0:
            raise MapError("no")
        if self.scans % 4 == 0:
            self.offset = compose(self.offset, np.array([0.2, -0.1, 0.15]))
        return ScanUpdate(
            scan.stamp, compose(self.offset, self.odometry_pose), np.eye(3), 0, 0, (1,), (), (), (), 1.0, 2, 0.9
        )

    def corner_map(self) -> Any:
        return "corners"

    def wall_map(self) -> Any:
        return "walls"

    def finish(self) -> None:
        return None


def session() -> Session:
    return Session(Backing(begin=Corrected, lost=lambda mapper, pose: Corrected()), LIVE)


STEPS = st.lists(
    st.tuples(
        st.sampled_from(["scan", "scan", "odometry", "odometry", "odometry", "poll", "other"]),
        st.sampled_from([0.0, 0.02, 0.05, 0.1, 0.4, 1.2]),  # of the caller's clock
        st.sampled_from([0.0, 0.0, 0.0, 0.0, -0.05, 0.3, -5.0, 1e6, -1e7]),  # stamps off that clock
        st.sampled_from([0.02, 0.02, 0.02, 5.0, -3.0]),  # driven since
    ),
    max_size=120,
)


@settings(max_examples=50)
@given(steps=STEPS)
def test_whatever_comes_a_session_goes_on(scan_at: Callable[..., LaserScan], steps: list[Any]) -> None:
    live = session()
    now, stamp, x, pushed, done = 0.0, 100.0, 0.0, 0, []
    for i, (what, wait, off, way) in enumerate(steps):
        now, stamp, x = now + wait, stamp + wait, x + way
        if what == "scan":
            pushed += 1
            live.push_scan(scan_at(stamp + off, 0.02), now)
        elif what == "odometry":
            live.push_odometry(Odometry(stamp + off, np.array([x, 0.1 * x, 0.3 * x])), now)
        elif what == "poll":
            done += live.poll(now)
        else:
            pushed += i % 7 == 0
            [
                partial(live.refuse, "scan", math.nan, "not finite", now),
                live.pause, live.resume, live.reset, live.lost, live.latest_map, partial(live.map_to_odom, stamp),
            ][i % 7]()  # fmt: skip
            assert len(live.diagnostics(now)) == 7
    live.resume()
    done += live.poll(now + 1000.0)
    counts = live._synchroniser.tally.counts
    assert pushed == len(done) + sum(c.number for (source, why), c in counts.items() if source == "scan" and why.loses)
    for p in done:
        np.testing.assert_allclose(between(compose(p.T_map_odom, p.T_odom_base), p.T_map_base), 0.0, atol=1e-6)
        assert p.latency >= 0.0
        assert np.isfinite(p.T_map_odom_smooth).all()
    versions = [p.map_version for p in done]
    assert versions == sorted(versions)


def published(p: Processed) -> Floats:
    """Where those who listen to the transforms have the robot."""
    return compose(p.T_map_odom_smooth, p.T_odom_base)


@settings(max_examples=30)
@given(
    leaps=st.sets(st.integers(2, 58), max_size=4),
    heading=st.floats(-3.0, 3.0),
    late=st.sets(st.integers(0, 59), max_size=10),
)
def test_the_published_pose_moves_with_the_wheels_and_no_faster_than_the_rates_beside(
    scan_at: Callable[..., LaserScan], leaps: set[int], heading: float, late: set[int]
) -> None:
    live = session()
    own, T_odom_own, done, steps = np.array([0.0, 0.0, heading]), np.zeros(3), [], []
    for k in range(60):
        step = np.array([0.04, 0.0, 0.03])
        own = compose(own, step)
        if k in leaps:
            T_odom_own = compose(np.array([30.0, -20.0, 2.0]), T_odom_own)
            step = np.zeros(3)  # a leap is no motion
        live.push_odometry(Odometry(100.0 + 0.1 * k, compose(T_odom_own, own)), 0.1 * k)
        live.push_scan(scan_at(100.0 + 0.1 * k, 0.05 if k in late else 0.0), 0.1 * k)
        got = live.poll(0.1 * k)
        done += got
        steps.append(step)
    for before, after in pairwise(done):
        driven = np.zeros(3)
        first, last = round(10 * (before.stamp - 100.0)), round(10 * (after.stamp - 100.0))
        for step in steps[first + 1 : last + 1]:
            driven = compose(driven, step)
        off = between(compose(published(before), driven), published(after))
        elapsed = after.stamp - before.stamp
        # A late scan may have been given the next reading as well: one step more.
        slack = 0.06 if late else 1e-9
        assert math.hypot(off[0], off[1]) <= SPEED * elapsed + slack
        assert abs(off[2]) <= TURN_RATE * elapsed + slack
