"""What the back ends show to those who watch."""

from dataclasses import replace
from importlib.util import find_spec

import numpy as np
import pytest

from contourslam.config import Config
from contourslam.geometry.poses import compose, transform
from contourslam.replay import make_mapper
from contourslam.scan import Odometry

BACK_ENDS = ["ekf", pytest.param("graph", marks=pytest.mark.skipif(find_spec("gtsam") is None, reason="no GTSAM"))]


@pytest.fixture
def drive(room, scan_of):
    """A robot that goes along a room, 0.1 m a scan."""
    segments = room([(0, 0), (6, 0), (6, 4), (0, 4)], [(3, 1), (3.5, 1), (3.5, 1.5), (3, 1.5)])

    def along(mapper, scans=30):
        for i in range(scans):
            pose = np.array([1.0 + 0.1 * i, 2.5, 0.02 * i])
            scan = replace(
                scan_of(segments, compose(pose, mapper.mount), beams=360, sigma=0.005, seed=i), stamp=float(i)
            )
            mapper.push_odometry(Odometry(float(i), pose))
            yield pose, mapper.push_scan(scan)

    return along


@pytest.mark.parametrize("back_end", BACK_ENDS)
def test_a_look_names_what_was_matched_and_how_far_it_was_off(back_end, drive) -> None:
    config = Config(back_end=back_end)
    mapper = make_mapper(config, initial_pose=np.array([1.0, 2.5, 0.0]), lidar_mount=np.array([0.1, 0.0, 0.3]))
    assert mapper.look is None
    assert mapper.contours is None
    named = 0
    for pose, update in drive(mapper):
        look = mapper.look
        assert len(mapper.contours.points) > 100
        if look is None or look.stamp != update.stamp:
            continue
        corners = len(look.detection.corners)
        assert len(look.ids) == corners + len(look.detection.walls) == len(look.innovations)
        assert set(update.matched) <= set(look.ids.tolist())
        mapped = mapper.corner_map()
        seen = transform(compose(pose, mapper.mount), look.detection.corners.positions)
        for number, place, off in zip(look.ids[:corners].tolist(), seen, look.innovations, strict=False):
            if number in update.matched:
                named += 1
                assert np.hypot(*off) < 0.1
                there = mapped.positions[mapped.ids == number]
                assert not len(there) or np.hypot(*(there[0] - place)) < 0.1
    assert named > 10


@pytest.mark.skipif(find_spec("gtsam") is None, reason="no GTSAM")
def test_the_path_and_the_loops_of_a_graph_can_be_had_while_it_grows(drive) -> None:
    mapper = make_mapper(Config(back_end="graph"), initial_pose=np.array([1.0, 2.5, 0.0]))
    assert mapper.path().shape == (0, 3)
    for i, (pose, _) in enumerate(drive(mapper)):
        path = mapper.path()
        assert len(path) == i + 1
        np.testing.assert_allclose(path[-1], pose, atol=0.05)
    finished = mapper.finish()
    np.testing.assert_array_equal(mapper.path(), finished.poses)
    assert mapper.loops() == finished.loops
    assert mapper.loops(len(finished.loops)) == ()
