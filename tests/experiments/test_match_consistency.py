import numpy as np
import pytest

from contourslam.config import Config
from contourslam.experiments.match_consistency import bare_corridor, keyframe_errors, narrowed, tie_errors
from contourslam.scan import LaserScan
from contourslam.simulation.long_drive import building_drive

DRIVE = building_drive(60.0, 1)


def test_contour_matching_knows_how_wrong_its_relative_poses_are() -> None:
    found = keyframe_errors(DRIVE.messages(), Config(), DRIVE.lidar_mount)
    assert len(found.nees) > 100
    assert 1.5 < found.nees.mean() < 4.5
    assert (np.sqrt((found.errors**2).mean(axis=0)) < (0.02, 0.02, 0.006)).all()
    assert found.by_axis == pytest.approx(np.ones(3), abs=0.7)


def test_ties_to_places_of_another_pass_know_it_too() -> None:
    pytest.importorskip("gtsam", reason="needs the extra 'graph'")
    drive = building_drive(150.0, 0)
    found = tie_errors(drive.messages(), Config(), drive.lidar_mount)
    assert len(found.nees) > 20
    assert 1.2 < found.nees.mean() < 5.0


def test_a_bare_corridor_is_left_to_the_wheels() -> None:
    alone = keyframe_errors(bare_corridor(15.0, 0), Config(), np.zeros(3))
    assert np.median(np.sqrt(alone.covariances[:, 0, 0])) > 0.1
    assert (np.sqrt(alone.covariances[:, 2, 2]) < 0.01).all()
    both = keyframe_errors(bare_corridor(15.0, 0), Config(), np.zeros(3), wheels_too=True)
    assert (both.covariances[:, 0, 0] <= alone.covariances[:, 0, 0]).all()
    assert np.median(both.nees) < 6.0


def test_a_narrowed_scan_looks_ahead_only() -> None:
    scans = [m for m in narrowed(bare_corridor(1.0, 0)) if isinstance(m, LaserScan)]
    assert len(scans) == 10
    assert np.abs(scans[0].angles).max() <= np.pi / 2
    assert len(scans[0].angles) == len(scans[0].ranges) == len(scans[0].offsets) == 181
