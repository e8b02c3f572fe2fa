"""Which sightings are one landmark, and which never are, however near."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from contourslam.geometry.poses import compose_one
from contourslam.graph.association import NONE, TAKEN, TIGHT_GATES, WIDE_GATES, associate, near, unlikeness
from contourslam.graph.landmark_index import empty_index, insert, likest
from contourslam.graph.sightings import CONVEX, DIRECTION, END, KIND, START, X, Y

Floats = NDArray[np.float64]
Row = Callable[..., Floats]

POSES = st.tuples(st.floats(-50, 50), st.floats(-50, 50), st.floats(-math.pi, math.pi)).map(np.array)
GATES = pytest.mark.parametrize("gates", [WIDE_GATES, TIGHT_GATES], ids=["wide", "tight"])


def moved(row: Floats, pose: Floats) -> Floats:
    out = row.copy()
    out[X : DIRECTION + 1] = compose_one(pose, row[X : DIRECTION + 1])
    return out


@GATES
@given(pose=POSES)
def test_a_landmark_is_like_itself_wherever_it_is_seen_from(
    corner_row: Row, wall_row: Row, gates: Floats, pose: Floats
) -> None:
    for row in (corner_row(1.0, 2.0, 0.5), wall_row(1.0, 2.0, 0.5)):
        assert unlikeness(moved(row, pose), moved(row, pose), gates) == pytest.approx(0.0, abs=1e-9)


@GATES
@given(pose=POSES)
def test_look_alikes_never_pair(corner_row: Row, wall_row: Row, gates: Floats, pose: Floats) -> None:
    corner, wall = moved(corner_row(1.0, 2.0, 0.5), pose), moved(wall_row(1.0, 2.0, 0.5), pose)
    hollow = corner.copy()
    hollow[CONVEX] = 0.0
    strangers = [
        (hollow, corner),
        (moved(corner_row(1.0, 2.0, 0.5 + math.pi / 2), pose), corner),
        (moved(corner_row(1.0, 2.0, 0.5, opening=math.radians(130.0)), pose), corner),
        (moved(corner_row(1.4, 2.0, 0.5), pose), corner),
        (corner, wall),
        (wall, corner),
        (moved(wall_row(1.0, 2.0, 0.5 + math.pi), pose), wall),  # the other face of a partition
        (moved(wall_row(1.2, 2.0, 0.5), pose), wall),
        (moved(wall_row(1.0, 2.0, 0.65), pose), wall),
    ]
    for seen, known in strangers:
        assert unlikeness(seen, known, gates) == math.inf


@GATES
def test_pieces_of_a_wall_pair_where_they_overlap_or_nearly_touch(wall_row: Row, gates: Floats) -> None:
    known = wall_row(3.0, 0.0, 0.0, length=2.0)
    assert unlikeness(wall_row(3.0, 1.5, 0.0, length=2.0), known, gates) < 1.0
    assert unlikeness(wall_row(3.0, 2.2, 0.0, length=2.0), known, gates) < 1.0
    assert unlikeness(wall_row(3.0, 2.9, 0.0, length=2.0), known, gates) == math.inf  # a door lies between


def test_two_lines_are_compared_where_both_were_seen(wall_row: Row) -> None:
    """A short piece, tilted by noise, lies on its wall; a long wall that crosses it at the far end does not count."""
    known = wall_row(0.0, 5.0, 0.0, length=10.0)
    short = wall_row(0.0, 9.5, math.radians(5.0), length=1.0)
    assert unlikeness(short, known, WIDE_GATES) < 1.0
    assert unlikeness(known, short, WIDE_GATES) < 1.1


def test_of_two_corners_the_likelier_gets_the_landmark(corner_row: Row) -> None:
    table = np.array([corner_row(0.0, 0.0), corner_row(5.0, 0.0)])
    seen = np.array([corner_row(0.15, 0.0), corner_row(0.05, 0.0), corner_row(9.0, 0.0)])
    chosen = associate(seen, table, np.array([0, 1]), WIDE_GATES)
    assert chosen.tolist() == [TAKEN, 0, NONE]


def test_two_pieces_of_a_wall_in_one_scan_are_both_of_it(wall_row: Row) -> None:
    table = np.array([wall_row(2.0, 0.0, length=6.0)])
    seen = np.array([wall_row(2.0, -2.0, length=1.0), wall_row(2.02, 2.0, length=1.0)])
    assert associate(seen, table, np.array([0]), WIDE_GATES).tolist() == [0, 0]


def test_only_those_asked_are_chosen(corner_row: Row) -> None:
    table = np.array([corner_row(0.0, 0.0), corner_row(0.1, 0.0)])
    assert associate(table[:1], table, np.array([1]), WIDE_GATES).tolist() == [1]
    assert associate(table[:1], table, np.array([], np.int64), WIDE_GATES).tolist() == [NONE]


def test_what_is_near_counts_the_reach_of_walls_and_leaves_out_free_rows(corner_row: Row, wall_row: Row) -> None:
    table = np.array(
        [corner_row(3.0, 0.0), corner_row(8.0, 0.0), wall_row(9.0, 0.0, length=12.0), corner_row(1.0, 0.0)]
    )
    table[3, KIND] = -1.0
    assert near(table, 4, 0.0, 0.0, 5.0).tolist() == [0, 2]


def test_the_index_finds_what_asking_everyone_finds(corner_row: Row, wall_row: Row) -> None:
    chance = np.random.default_rng(5)
    corners = [corner_row(*chance.uniform(-6, 6, 2), chance.choice([0.0, 1.6]), convex=False) for _ in range(150)]
    walls = [
        wall_row(*chance.uniform(-6, 6, 2), chance.choice([0.0, 0.8, 3.1]), length=chance.uniform(0.5, 9.0))
        for _ in range(150)
    ]
    table = np.array(corners + walls)
    index = empty_index(table)
    for i, row in enumerate(table):
        insert(index, row, i)
    seen = table[chance.permutation(len(table))].copy()
    seen[:, X : Y + 1] += chance.normal(0.0, 0.2, (len(seen), 2))
    seen[:, START] -= 0.5
    seen[:, END] += 0.3
    paired = 0
    for row in seen:
        costs = [unlikeness(row, known, WIDE_GATES) for known in table]
        expected = -1 if min(costs) == math.inf else int(np.argmin(costs))
        assert likest(index, table, row, WIDE_GATES) == expected
        paired += expected >= 0
    assert 100 < paired < 300
