"""The beginning of every real log at hand, through every detector: nothing fails, and the answer is a sane one."""

from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from contourslam.config import Config, SlamConfig
from contourslam.detectors import DETECTORS
from contourslam.recordings import open_recording
from contourslam.replay import replay
from contourslam.scan import LaserScan, Odometry, TruePose

DATA = Path(__file__).parents[2].parent / "shared" / "data"
LOGS = {
    "intel": "intel/intel.log.xz",
    "mit_csail": "mit_csail/mit-csail.clf.xz",
    "aces": "aces/aces.log.xz",
    "acapulco": "acapulco/acapulco.log.xz",
}
SCANS = 300


def beginning(path: Path, scans: int) -> Iterator[LaserScan | Odometry | TruePose]:
    """Messages up to and with so many scans."""
    for message in open_recording(path).messages():
        yield message
        scans -= isinstance(message, LaserScan)
        if scans == 0:
            return


@cache
def messages_of(log: str) -> tuple[LaserScan | Odometry | TruePose, ...]:
    path = DATA / LOGS[log]
    if not path.exists():
        pytest.skip(f"the real recordings are not here: no {LOGS[log]} in ../shared/data")
    return tuple(beginning(path, SCANS))


@pytest.mark.parametrize("walls", [False, True], ids=["corners", "walls"])
@pytest.mark.parametrize("detector", DETECTORS)
@pytest.mark.parametrize("log", LOGS)
def test_every_detector_gets_through_the_beginning_of_every_real_log(log: str, detector: str, walls: bool) -> None:
    messages = messages_of(log)
    result = replay(messages, Config(detector=detector, slam=SlamConfig(walls=walls)))
    assert result.complete
    assert len(result.stamps) == SCANS
    assert np.isfinite(result.poses).all()
    assert np.linalg.eigvalsh(result.covariances).min() > 0.0
    assert result.corner_count.sum() > 10
    assert len(result.wall_map.ids) > 3 if walls else len(result.wall_map.ids) == 0
    assert len(result.corner_map.ids) > 0
    assert result.matched_count.sum() > 0 or not walls  # some landmarks were found again


@pytest.mark.parametrize("association", ["nearest", "mahalanobis", "mutual", "joint"])
def test_every_association_gets_through_a_real_log(association: str) -> None:
    result = replay(messages_of("intel"), Config(slam=SlamConfig(walls=True, association=association)))
    assert result.complete
    assert np.isfinite(result.poses).all()
    assert np.linalg.eigvalsh(result.covariances).min() > 0.0
