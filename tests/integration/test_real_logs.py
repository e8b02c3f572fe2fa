"""The beginning of every real log at hand, through every detector: nothing fails, and the answer is a sane one."""

from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from contourslam.config import Config, SlamConfig
from contourslam.detectors import DETECTORS
from contourslam.evaluation.relations import judge, poses_at
from contourslam.recordings import open_recording, read_relations
from contourslam.replay import replay
from contourslam.scan import LaserScan, Odometry, TruePose

Floats = NDArray[np.float64]

DATA = Path(__file__).parents[2].parent / "shared" / "data"
LOGS = {
    "intel": "intel/intel.log.xz",
    "mit_csail": "mit_csail/mit-csail.clf.xz",
    "aces": "aces/aces.log.xz",
    "acapulco": "acapulco/acapulco.log.xz",
}
SCANS = 300
# Mean error over the known relative poses that the graph stays below: m, degrees.
KNOWN = {
    "intel": ("intel/intel.relations.xz", 0.030, 1.0),
    "mit_csail": ("mit_csail/mit-csail.relations.xz", 0.045, 1.0),
}
# Another system's poses, which are no truth: root mean square distance from them, m.
OTHERS = {
    "aces": ("aces/aces.gmapping_poses.txt.xz", 0.5),
    "acapulco": ("acapulco/acapulco.gmapping_poses.txt.xz", 0.5),
}


def beginning(path: Path, scans: int) -> Iterator[LaserScan | Odometry | TruePose]:
    """Messages up to and with so many scans."""
    for message in open_recording(path).messages():
        yield message
        scans -= isinstance(message, LaserScan)
        if scans == 0:
            return


def path_of(name: str) -> Path:
    path = DATA / name
    if not path.exists():
        pytest.skip(f"the real recordings are not here: no {name} in ../shared/data")
    return path


@cache
def messages_of(log: str) -> tuple[LaserScan | Odometry | TruePose, ...]:
    return tuple(beginning(path_of(LOGS[log]), SCANS))


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


@pytest.mark.parametrize("log", KNOWN)
def test_the_graph_keeps_within_centimetres_of_the_known_relative_poses(log: str) -> None:
    pytest.importorskip("gtsam", reason="needs the extra 'graph'")
    relations, metres, degrees = KNOWN[log]
    stamps, poses = read_relations(path_of(relations))
    result = replay(open_recording(path_of(LOGS[log])).messages(), Config(back_end="graph"))
    judged = judge(result, stamps, poses)
    assert result.complete
    assert judged.estimate.outside == 0
    assert judged.estimate.translation_summary.mean <= metres
    assert np.degrees(judged.estimate.rotation_summary.mean) <= degrees
    assert judged.odometry.translation_summary.mean > 1.0
    assert judged.online is not None
    assert judged.estimate.translation_summary.mean <= judged.online.translation_summary.mean
    assert len(result.loops) > 20


def test_a_log_with_zeros_for_odometry_is_mapped_from_its_scans() -> None:
    pytest.importorskip("gtsam", reason="needs the extra 'graph'")
    stamps, poses = read_relations(path_of(KNOWN["mit_csail"][0]))
    messages = (
        replace(message, pose=np.zeros(3)) if isinstance(message, Odometry) else message
        for message in open_recording(path_of(LOGS["mit_csail"])).messages()
    )
    judged = judge(replay(messages, Config(back_end="graph")), stamps, poses)
    assert judged.estimate.translation_summary.mean < 0.10


def distance(poses: Floats, reference: Floats) -> float:
    """Root mean square distance between two trajectories after a rigid motion that brings them together, m."""
    a, b = poses[:, :2] - poses[:, :2].mean(axis=0), reference[:, :2] - reference[:, :2].mean(axis=0)
    turn = np.arctan2(np.sum(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]), np.sum(a * b))
    cos, sin = np.cos(turn), np.sin(turn)
    return float(np.sqrt(np.mean(np.sum((a @ np.array([[cos, sin], [-sin, cos]]) - b) ** 2, axis=1))))


@pytest.mark.parametrize("log", OTHERS)
def test_the_graph_agrees_with_another_system_better_than_the_wheels_do(log: str) -> None:
    pytest.importorskip("gtsam", reason="needs the extra 'graph'")
    reference, metres = OTHERS[log]
    # The logger's stamp, the recording's stamp, x, y and heading.
    rows = np.loadtxt(path_of(reference), ndmin=2)
    result = replay(open_recording(path_of(LOGS[log])).messages(), Config(back_end="graph"))
    found, wheels = (poses_at(rows[:, 1], result.stamps, p) for p in (result.poses, result.odometry))
    apart = distance(found, rows[:, 2:5])
    assert result.complete
    assert apart <= metres
    assert apart < 0.5 * distance(wheels, rows[:, 2:5])
