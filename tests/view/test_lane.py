"""What is learnt by watching a mapper."""

from importlib.util import find_spec

import numpy as np
import pytest

from contourslam.config import Config
from contourslam.replay import make_mapper
from contourslam.scan import LaserScan, Odometry
from contourslam.view.lane import as_graph


@pytest.mark.skipif(find_spec("gtsam") is None, reason="no GTSAM")
def test_some_poses_of_a_graphs_path_are_those_of_all_to_the_bit(drive) -> None:
    mapper = make_mapper(Config(back_end="graph"))
    graph = as_graph(mapper)
    assert graph is not None and graph.path(np.empty(0, np.int64)).shape == (0, 3)
    scans = 0
    for message in drive(60):
        if isinstance(message, Odometry):
            mapper.push_odometry(message)
        elif isinstance(message, LaserScan):
            mapper.push_scan(message)
            scans += 1
            some = np.arange(scans - 1, -1, -3)
            np.testing.assert_array_equal(graph.path(some), graph.path()[some])
    assert 2 < len(graph._begins) < scans  # several keyframes, and scans between them
