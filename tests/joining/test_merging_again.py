"""Overlaps that the solution so far does not know are found, however far off within its doubt, and no others."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from contourslam.config import Config
from contourslam.geometry.poses import between, between_one, compose, compose_one, interpolate, inverse
from contourslam.maps import Relations, SavedMap
from contourslam.scan import LaserScan, Odometry, TruePose

pytest.importorskip("gtsam", reason="needs the extra 'graph'")
pytest.importorskip("shapely", reason="needs the extra 'simulation'")

from contourslam.graph import GraphSlam, kept
from contourslam.joining.again import Again, look_again
from contourslam.joining.building import build, keyframes_of
from contourslam.joining.joint import Evidence, Joint, Tie
from contourslam.joining.merging import remember_all, solve_map
from contourslam.simulation.long_drive import building_drive

Floats = NDArray[np.float64]
CONFIG = Config(back_end="graph")
LENGTH = 52.0
OFF = np.array([0.7, -0.5, 0.04])  # where the second map is thought to lie, beside where it lies
DOUBT = np.diag([0.3**2, 0.3**2, 0.02**2])


@cache
def mapped(building: int, first: float, until: float) -> SavedMap:
    drive = building_drive(LENGTH, building)
    messages = [m for m in drive.messages() if isinstance(m, LaserScan | Odometry)]
    slam = GraphSlam(CONFIG, lidar_mount=drive.lidar_mount)
    for message in messages[int(first * len(messages)) : int(until * len(messages))]:
        if isinstance(message, Odometry):
            slam.push_odometry(message)
        else:
            slam.push_scan(message)
    slam.finish()
    return kept(slam, {})


def true_at(stamps: Floats) -> Floats:
    rows = np.array([(m.stamp, *m.pose) for m in building_drive(LENGTH, 0).messages() if isinstance(m, TruePose)])
    return interpolate(rows[:, 0], rows[:, 1:], stamps)


def found(second: SavedMap, frame: Floats, *, tied: bool = False) -> tuple[list[Again], SavedMap]:
    """What is found where a second map is thought to lie in the first, known as well as DOUBT says."""
    built = build([mapped(0, 0.0, 0.52), second], np.array([np.zeros(3), frame]), {}).saved
    keyframes, relations = keyframes_of(built), built.relations
    assert relations is not None
    covariances = np.where((keyframes.drives == 1)[:, None, None], DOUBT, keyframes.covariances)
    begin = int(np.argmax(keyframes.drives == 1))
    pose = between_one(keyframes.poses[begin - 1], keyframes.poses[begin])
    bound = Relations(  # as of a joint whose other ties were all dropped, or of a tie at each keyframe
        np.append(relations.first, begin - 1),
        np.append(relations.second, begin),
        np.vstack([relations.poses, pose]),
        np.concatenate([relations.information, np.eye(3)[None]]),
        np.append(relations.robust, 3.0),
        np.append(relations.ties, True),
    )
    saved = replace(built, keyframes=replace(keyframes, covariances=covariances), relations=bound)
    memory = remember_all(saved, CONFIG)
    if tied:
        ends = [np.flatnonzero(keyframes.drives == drive) for drive in (0, 1)]
        first, second = (np.resize(keys, len(keyframes)) for keys in ends)
        bound = replace(bound, first=first, second=second)
    else:
        bound = relations
    return look_again(memory, keyframes_of(saved), bound), saved


def beside() -> Floats:
    """Where the frame of the second map truly lies in the first's, and OFF from there."""
    first, second = (keyframes_of(mapped(0, *part)) for part in ((0.0, 0.52), (0.52, 1.0)))
    start = between_one(true_at(first.stamps[:1])[0], true_at(second.stamps[:1])[0])
    return compose_one(compose_one(first.poses[0], start), OFF)


def test_an_overlap_out_of_reach_of_an_alignment_is_found_and_put_right() -> None:
    ties, saved = found(mapped(0, 0.52, 1.0), beside())
    assert len(ties) >= 2
    keyframes = keyframes_of(saved)
    true = true_at(keyframes.stamps)
    anchors = remember_all(saved, CONFIG).places.list
    for tie in ties:
        anchor = anchors[tie.place].anchor
        assert keyframes.drives[anchor] != keyframes.drives[tie.keyframe]
        off = between_one(between_one(true[anchor], true[tie.keyframe]), tie.pose)
        assert np.hypot(off[0], off[1]) < 0.1
        assert abs(off[2]) < 0.03


def test_what_is_tied_already_is_not_looked_for() -> None:
    assert found(mapped(0, 0.52, 1.0), beside(), tied=True)[0] == []


@pytest.mark.parametrize("building", [1])
def test_a_building_that_only_lies_there_is_not_taken_for_this_one(building: int) -> None:
    assert found(mapped(building, 0.0, 0.3), compose(beside(), np.array([0.3, 0.2, 0.0])))[0] == []


@pytest.mark.parametrize("off", [np.array([1.3, 0.0, 0.0]), np.array([0.0, -1.3, 0.0])], ids=["along", "across"])
def test_a_map_that_hangs_on_one_loose_tie_is_put_right_as_far_as_that_leaves_it_open(off: Floats) -> None:
    maps = mapped(0, 0.0, 0.52), mapped(0, 0.52, 1.0)
    first, second = map(keyframes_of, maps)
    last = len(first.stamps) - 1
    true = true_at(np.concatenate([first.stamps, second.stamps]))
    seen = compose_one(between_one(true[last], true[last + 1]), off)
    loose = Tie(last, 0, seen, np.diag([0.6**2, 0.6**2, 0.02**2]))
    frame = compose_one(compose_one(first.poses[last], seen), inverse(second.poses[0]))
    joint = Joint(frame, (loose,), Evidence(5, 5, 30.0, 0.0, 9.0, 0.1), "search")
    built = build(maps, np.array([np.zeros(3), frame]), {(0, 1): joint}).saved
    poses = keyframes_of(solve_map(built, CONFIG)).poses
    error = between(compose(poses[0], between(true[0], true)), poses)[last + 1 :, :2]
    assert np.median(np.hypot(*error.T)) < 0.1
