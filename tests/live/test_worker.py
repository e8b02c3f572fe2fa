"""A session in its own thread: results come as scans do, and errors are not lost."""

import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from contourslam.config import Config, LidarConfig, LiveConfig, SlamConfig
from contourslam.live.session import Processed
from contourslam.live.start import mapping
from contourslam.live.worker import Worker
from contourslam.maps.file import load_map
from contourslam.scan import LaserScan

EKF = Config(slam=SlamConfig(walls=True, contour_matching=True), lidar=LidarConfig(sigma_range=0.005))


def test_every_scan_that_is_pushed_comes_back_and_the_map_is_saved_at_the_end(
    stream: Callable[..., Any], tmp_path: Path
) -> None:
    drive = stream(2.0)
    session = mapping(EKF, LiveConfig(wait=2.0, max_waiting=100), autosave=tmp_path / "map.cmap", clock=time.monotonic)
    done: list[Processed] = []
    all_done = threading.Event()

    def take(processed: Processed) -> None:
        done.append(processed)
        if len(done) == 20:
            all_done.set()

    failures: list[BaseException] = []
    worker = Worker(session, take, clock=time.monotonic, failed=failures.append)
    worker.start()
    for _, message in drive.messages:
        if isinstance(message, LaserScan):
            worker.push_scan(message)
        else:
            worker.push_odometry(message)
    assert all_done.wait(60.0)
    worker.stop()
    assert failures == []
    assert [p.stamp for p in done] == [m.stamp for _, m in drive.messages if isinstance(m, LaserScan)]
    assert all(p.latency > 0.0 for p in done)
    saved = load_map(tmp_path / "map.cmap")
    np.testing.assert_array_equal(saved.walls.end_points, session.wall_map().end_points)


def test_a_scan_that_waits_in_vain_is_mapped_without_another_message(stream: Callable[..., Any]) -> None:
    drive = stream(1.0)
    session = mapping(EKF, LiveConfig(wait=0.05), clock=time.monotonic)
    done = threading.Event()
    worker = Worker(session, lambda processed: done.set(), clock=time.monotonic, failed=lambda error: None)
    worker.start()
    worker.push_scan(next(m for _, m in drive.messages if isinstance(m, LaserScan)))
    assert done.wait(60.0)
    worker.stop()


@pytest.mark.parametrize("started", [True, False])
def test_an_error_in_the_thread_is_told_and_stopping_still_works(stream: Callable[..., Any], started: bool) -> None:
    def fails(processed: Processed) -> None:
        raise ZeroDivisionError("a bug")

    drive = stream(1.0)
    failures: list[BaseException] = []
    told = threading.Event()

    def failed(error: BaseException) -> None:
        failures.append(error)
        told.set()

    session = mapping(EKF, LiveConfig(wait=0.01), clock=time.monotonic)
    worker = Worker(session, fails, clock=time.monotonic, failed=failed)
    if started:
        worker.start()
        for _, message in drive.messages:
            if isinstance(message, LaserScan):
                worker.push_scan(message)
        assert told.wait(60.0)
        assert [str(error) for error in failures] == ["a bug"]
    worker.stop()


def test_who_looks_on_is_told_after_the_pose_is_handed_on_and_works_while_no_scan_waits(
    stream: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("contourslam.live.worker.OVERDUE", 1e6)
    session = mapping(EKF, LiveConfig(wait=2.0, max_waiting=100), clock=time.monotonic)
    happened: list[tuple[str, float]] = []
    rested = threading.Event()

    class Watching:
        def take(self, processed: Processed) -> None:
            happened.append(("taken", processed.stamp))

        def rest(self) -> None:
            happened.append(("rest", session.due(time.monotonic()) or 1.0))
            rested.set()

    def hand_on(processed: Processed) -> None:
        happened.append(("handed on", processed.stamp))

    worker = Worker(session, hand_on, clock=time.monotonic, failed=lambda error: None, onlooker=Watching())
    for _, message in stream(1.0).messages:  # all of them wait as it begins
        (worker.push_scan if isinstance(message, LaserScan) else worker.push_odometry)(message)
    worker.start()
    assert rested.wait(60.0)
    worker.stop()
    first = [what for what, _ in happened].index("rest")
    assert first >= 18 and [what for what, _ in happened[:first]] == ["handed on", "taken"] * (first // 2)
    assert all(due > 0.0 for what, due in happened if what == "rest")


class FakeSession:
    """One in which a scan always waits, on a clock of its own."""

    def __init__(self, *, mapped: bool) -> None:
        self.now, self.polls, self._mapped = 0.0, 0, mapped

    def due(self, now: float) -> float:
        return 0.0

    def poll(self, now: float, *, at_most: int) -> list[Any]:
        self.now, self.polls = self.now + 0.1, self.polls + 1
        return ["a scan"] if self._mapped else []

    def close(self) -> None:
        return None


@pytest.mark.parametrize("mapped", [True, False])
def test_who_looks_on_works_now_and_then_although_scans_always_wait(mapped: bool) -> None:
    fake, rests, rested = FakeSession(mapped=mapped), [], threading.Event()

    class Watching:
        def take(self, processed: Any) -> None:
            assert processed == "a scan"

        def rest(self) -> None:
            rests.append(fake.polls)
            if len(rests) == 3:
                rested.set()

    session: Any = fake
    worker = Worker(
        session, lambda processed: None, clock=lambda: fake.now, failed=lambda error: None, onlooker=Watching()
    )
    worker.start()
    assert rested.wait(60.0)
    worker.stop()
    assert all(50 <= between <= 52 for between in np.diff([0, *rests[:3]]))  # OVERDUE is 5 s
