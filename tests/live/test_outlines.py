"""The keyframes' contours, drawn up while no scan waits."""

from pathlib import Path

import numpy as np
import pytest

from contourslam.config import Config, LiveConfig, SlamConfig
from contourslam.geometry.poses import compose
from contourslam.live.session import Session
from contourslam.live.start import localization, mapping
from contourslam.live.warming import INNER, OUTER, _drive, _scan, _sides
from contourslam.scan import Odometry

GRAPH = Config(back_end="graph", slam=SlamConfig(walls=True, contour_matching=True))
WALLS = np.concatenate([_sides(OUTER), _sides(INNER)])
DRIVE = _drive(0.25)


def driven(session: Session) -> Session:
    for number, pose in enumerate(DRIVE):
        now = 0.1 * number
        session.push_odometry(Odometry(now, pose), now)
        session.push_odometry(Odometry(now + 0.04, pose), now + 0.04)
        session.push_scan(_scan(now, pose, WALLS), now + 0.04)
        session.poll(now + 0.05)
    return session


def distance_to_walls(points: np.ndarray) -> np.ndarray:
    first, along = WALLS[:, 0], WALLS[:, 1] - WALLS[:, 0]
    part = np.clip(((points[:, None] - first) * along).sum(axis=2) / (along**2).sum(axis=1), 0.0, 1.0)
    return np.asarray(np.linalg.norm(points[:, None] - first - part[..., None] * along, axis=2).min(axis=1))


def test_contours_of_the_graph_lie_on_the_walls_once_they_were_asked_for() -> None:
    pytest.importorskip("gtsam")
    session = driven(mapping(GRAPH, LiveConfig()))
    assert session.latest_outlines() is None
    assert session.due(100.0) == 0.0
    session.poll(100.0)
    found = session.latest_outlines()
    assert found is not None
    assert found.version == session.map_version
    assert len(found.poses) == len(found.points) > 5
    for pose, points in zip(found.poses, found.points, strict=True):
        at = compose(np.asarray(DRIVE[0]), compose(pose, np.column_stack([points[:, :2], np.zeros(len(points))])))
        assert np.median(distance_to_walls(at[:, :2])) < 0.03
    assert session.latest_outlines() is found  # and is not drawn up again
    assert session.due(100.0) != 0.0


def test_the_filter_keeps_none_and_localisation_has_those_of_its_map(tmp_path: Path) -> None:
    pytest.importorskip("gtsam")
    of_filter = driven(mapping(Config(slam=GRAPH.slam), LiveConfig()))
    of_filter.latest_outlines()
    of_filter.poll(100.0)
    none = of_filter.latest_outlines()
    assert none is not None
    assert none.points == ()
    mapped = driven(mapping(GRAPH, LiveConfig()))
    mapped.save(tmp_path / "map.cmap")
    mapped.latest_outlines()
    mapped.poll(100.0)
    known = localization(GRAPH, LiveConfig(), tmp_path / "map.cmap")
    known.latest_outlines()
    known.poll(100.0)
    ours, theirs = mapped.latest_outlines(), known.latest_outlines()
    assert ours is not None
    assert theirs is not None
    np.testing.assert_allclose(theirs.poses, ours.poses, atol=1e-9)
    np.testing.assert_array_equal(np.concatenate(theirs.points), np.concatenate(ours.points))
