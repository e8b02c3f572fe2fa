"""Constellations found again: the right place, the look-alikes beside it, and nothing where nothing can be said."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from contourslam.geometry.angles import wrap
from contourslam.geometry.poses import between, compose, inverse, transform
from contourslam.matching.constellation import Constellation, Proposal, propose
from contourslam.matching.constellation_pairs import solve
from contourslam.matching.constellation_votes import stamp

Floats = NDArray[np.float64]

ANGLES = st.floats(-math.pi, math.pi)
ROOM = 5.0  # the rooms of the building stand so far apart, m
NONE = Constellation(*(np.empty(shape) for shape in ((0, 2), 0, 0, 0, 0, (0, 2, 2))))


def join(*parts: Constellation) -> Constellation:
    names = [field.name for field in dataclasses.fields(Constellation)]
    return Constellation(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))


def take(of: Constellation, corners: NDArray[np.bool_], walls: NDArray[np.bool_]) -> Constellation:
    return Constellation(
        of.corners[corners], of.directions[corners], of.openings[corners], of.convex[corners],
        of.normals[walls], of.end_points[walls],
    )  # fmt: skip


def move(of: Constellation, pose: Floats) -> Constellation:
    return Constellation(
        transform(pose, of.corners), wrap(of.directions + pose[2]), of.openings, of.convex,
        wrap(of.normals + pose[2]), transform(pose, of.end_points),
    )  # fmt: skip


def rectangle(x: float, y: float, width: float, height: float, *, convex: bool = False) -> Constellation:
    """Four corners and four walls, seen from inside, or from outside as a box."""
    corners = np.array([[x, y], [x + width, y], [x + width, y + height], [x, y + height]])
    ends = np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)
    normals = np.radians([-90.0, 0.0, 90.0, 180.0])
    if convex:
        ends, normals = ends[:, ::-1], wrap(normals + math.pi)
    directions, right = np.radians([45.0, 135.0, -135.0, -45.0]), np.full(4, 0.5 * math.pi)
    return Constellation(corners, directions, right, np.full(4, convex), normals, ends)


def building(seed: int, rooms: int = 4) -> Constellation:
    """Rooms of different sizes, a box in some of them, the whole turned."""
    rng = np.random.default_rng(seed)
    parts = []
    for column in range(rooms):
        for row in range(rooms):
            x, y = ROOM * column + rng.uniform(0.0, 0.4), ROOM * row + rng.uniform(0.0, 0.4)
            width, height = rng.uniform(2.5, 4.5, 2)
            parts.append(rectangle(x, y, width, height))
            if rng.random() < 0.6:
                at = rng.uniform(0.4, 1.2, 2)
                parts.append(rectangle(x + at[0], y + at[1], *rng.uniform(0.5, 1.2, 2), convex=True))
    return move(join(*parts), np.array([1.0, -2.0, 0.3]))


def look(known: Constellation, pose: Floats, rng: np.random.Generator, *, missed: float, false: int) -> Constellation:
    """What is within 6 m of `pose`, from there: with noise, some of it missed, some of it not in the map."""
    near = np.hypot(*(known.corners - pose[:2]).T) < 6.0
    near_walls = np.hypot(*(known.end_points.mean(axis=1) - pose[:2]).T) < 6.0
    seen = take(known, near & (rng.random(near.size) > missed), near_walls & (rng.random(near_walls.size) > missed))
    k, w = len(seen.directions), len(seen.normals)
    seen = move(seen, inverse(pose))
    clutter = np.arange(2 * false)
    walls = rng.uniform(-5.0, 5.0, (2 * false, 1, 2)) + np.array([[-0.5, 0.0], [0.5, 0.0]])
    return join(
        Constellation(
            seen.corners + 0.02 * rng.standard_normal((k, 2)),
            seen.directions + np.radians(1.5) * rng.standard_normal(k),
            seen.openings + np.radians(2.0) * rng.standard_normal(k),
            seen.convex,
            seen.normals,
            seen.end_points + 0.01 * rng.standard_normal((w, 2, 2)),
        ),
        Constellation(
            rng.uniform(-5.0, 5.0, (2 * false, 2)),
            rng.uniform(-3.0, 3.0, 2 * false),
            np.full(2 * false, 1.5),
            clutter % 2 == 0,
            np.full(2 * false, 0.5 * math.pi),
            walls,
        ),
    )


def is_near(proposal: Proposal, pose: Floats, distance: float = 0.1, turn_deg: float = 2.0) -> bool:
    off = between(pose, proposal.pose)
    return math.hypot(off[0], off[1]) < distance and abs(off[2]) < math.radians(turn_deg)


@settings(max_examples=60)
@given(seed=st.integers(0, 10**6), x=st.floats(3.0, 17.0), y=st.floats(3.0, 17.0), heading=ANGLES)
def test_a_place_is_found_again_anywhere_in_spite_of_noise_missing_and_false_landmarks(
    seed: int, x: float, y: float, heading: float
) -> None:
    known, rng = building(seed % 7), np.random.default_rng(seed)
    pose = compose(np.array([1.0, -2.0, 0.3]), np.array([x, y, heading]))
    best, *others = propose(look(known, pose, rng, missed=0.3, false=2), known)
    assert is_near(best, pose)
    assert best.residual < 0.05
    assert all(other.score < 0.8 * best.score for other in others)


@settings(max_examples=40)
@given(seed=st.integers(0, 10**6), heading=ANGLES)
def test_every_proposal_lies_in_the_window_and_the_right_one_comes_first(seed: int, heading: float) -> None:
    known, rng = building(seed % 7), np.random.default_rng(seed)
    pose = np.array([*rng.uniform(4.0, 12.0, 2), heading])
    window = np.array([3.0, 2.0, math.radians(20.0)])
    guess = compose(pose, np.zeros(3)) + rng.uniform(-0.9, 0.9, 3) * window
    proposals = propose(look(known, pose, rng, missed=0.3, false=2), known, guess=guess, window=window)
    assert is_near(proposals[0], pose)
    for proposal in proposals:
        off = proposal.pose - guess
        assert (np.abs([off[0], off[1], float(wrap(off[2]))]) <= window).all()


def test_a_place_outside_of_the_window_is_not_proposed() -> None:
    known, pose = building(1), np.array([8.0, 8.0, 1.0])
    seen = look(known, pose, np.random.default_rng(1), missed=0.2, false=0)
    far = propose(seen, known, guess=pose + np.array([4.0, 0.0, 0.0]), window=np.array([1.0, 1.0, 0.3]))
    assert not any(is_near(proposal, pose, 0.5) for proposal in far)


@settings(max_examples=25)
@given(seed=st.integers(0, 10**6), x=st.floats(-20.0, 20.0), turn=ANGLES)
def test_a_rigid_motion_of_the_map_moves_the_proposal_with_it(seed: int, x: float, turn: float) -> None:
    known, rng, motion = building(seed % 7), np.random.default_rng(seed), np.array([x, -x, turn])
    seen = look(known, np.array([*rng.uniform(4.0, 12.0, 2), turn]), rng, missed=0.2, false=1)
    before, after = propose(seen, known)[0], propose(seen, move(known, motion))[0]
    assert is_near(after, compose(motion, before.pose), 0.02, 0.5)
    assert after.score == pytest.approx(before.score, rel=0.05)


@settings(max_examples=25)
@given(seed=st.integers(0, 10**6))
def test_only_landmarks_of_one_kind_within_the_tolerances_are_pairs(seed: int) -> None:
    known, rng = building(seed % 7), np.random.default_rng(seed)
    pose = np.array([*rng.uniform(4.0, 12.0, 2), rng.uniform(-3.0, 3.0)])
    seen = look(known, pose, rng, missed=0.3, false=3)
    for proposal in propose(seen, known, tolerance=0.15, angle_tolerance_deg=6.0):
        moved, (i, j), (m, n) = move(seen, proposal.pose), proposal.corner_pairs.T, proposal.wall_pairs.T
        assert (seen.convex[i] == known.convex[j]).all()
        assert len(set(j)) == len(j)
        assert (np.hypot(*(moved.corners[i] - known.corners[j]).T) < 0.15).all()
        assert (np.abs(wrap(moved.directions[i] - known.directions[j])) < math.radians(6.0)).all()
        assert (np.abs(wrap(moved.normals[m] - known.normals[n])) < math.radians(6.0)).all()


@pytest.mark.parametrize("convex", [False, True])
def test_corners_of_the_other_kind_or_another_opening_are_never_found_again(convex: bool) -> None:
    whole = building(2)
    known = take(whole, whole.convex == convex, np.zeros(len(whole.normals), bool))
    assert len(propose(known, known)[0].corner_pairs) == len(known.directions)
    assert propose(dataclasses.replace(known, convex=~known.convex), known, min_pairs=1) == ()
    assert propose(dataclasses.replace(known, openings=known.openings - 0.5), known, min_pairs=1) == ()


def corridor(doors: int, *, odd: int = -1) -> Constellation:
    """Two long walls with a door niche every 4 m on one side; one of the niches may be wider."""
    parts = [rectangle(4.0 * i, 1.0, 1.6 if i == odd else 1.0, 0.4) for i in range(doors)]
    ends = np.array([[[-2.0, -1.0], [4.0 * doors, -1.0]]])
    long = Constellation(*(np.empty(s) for s in ((0, 2), 0, 0, 0)), np.array([-0.5 * math.pi]), ends)
    return join(*parts, long)


def test_in_a_corridor_of_equal_doors_the_runner_up_is_near_the_best() -> None:
    known, pose = corridor(6), np.array([9.0, 0.0, 0.2])
    near = np.abs(known.corners[:, 0] - 10.5) < 3.0
    near_walls = np.append(np.abs(known.end_points[:-1].mean(axis=1)[:, 0] - 10.5) < 3.0, True)
    seen = move(take(known, near, near_walls), inverse(pose))
    first, second, *_ = propose(seen, known)
    assert second.score > 0.95 * first.score
    unlike = corridor(6, odd=3)
    first, second, *_ = propose(move(take(unlike, near, near_walls), inverse(pose)), unlike)
    assert is_near(first, pose)
    assert second.score < 0.7 * first.score


def test_a_bare_corridor_gives_no_place() -> None:
    known = take(corridor(6), np.zeros(24, bool), np.ones(25, bool))
    straight = take(known, np.zeros(0, bool), np.abs(np.sin(known.normals)) > 0.9)
    assert propose(straight, straight, min_pairs=1) == ()


def test_two_walls_across_each_other_suffice_where_two_pairs_are_asked_for() -> None:
    known = take(rectangle(1.0, -1.0, 3.0, 2.5), np.zeros(4, bool), np.array([True, True, False, False]))
    pose = np.array([0.4, 0.7, -2.0])
    assert is_near(propose(move(known, inverse(pose)), known, min_pairs=2)[0], pose)
    assert propose(move(known, inverse(pose)), known, min_pairs=3) == ()


def test_pieces_of_one_wall_are_one_landmark() -> None:
    known = take(rectangle(1.0, -1.0, 3.0, 2.5), np.zeros(4, bool), np.array([True, True, False, False]))
    (a, b), rest = known.end_points[0], known.end_points[1:]
    pieces = [[a, 0.6 * a + 0.4 * b], [0.4 * a + 0.6 * b, b]]
    seen = dataclasses.replace(
        known, normals=known.normals[[0, 0, 1]], end_points=np.concatenate([np.array(pieces), rest])
    )
    assert sorted(propose(seen, known, min_pairs=2)[0].wall_pairs.tolist()) == [[0, 0], [1, 0], [2, 1]]
    assert propose(seen, known, min_pairs=3) == ()


def test_nothing_comes_of_empty_sets() -> None:
    known = building(4)
    assert propose(NONE, known) == ()
    assert propose(known, NONE) == ()
    assert propose(NONE, NONE, guess=np.zeros(3), window=np.ones(3)) == ()


def test_one_landmark_alone_is_no_place_unless_it_is_asked_for() -> None:
    known = building(4)
    one = take(known, np.arange(len(known.directions)) == 3, np.zeros(len(known.normals), bool))
    assert propose(one, known) == ()
    assert len(propose(one, known, min_pairs=1, keep=3)) == 3


def test_proposals_are_few_distinct_and_best_first() -> None:
    known = building(5)
    seen = look(known, np.array([8.0, 6.0, 0.5]), np.random.default_rng(5), missed=0.5, false=3)
    proposals = propose(seen, known, keep=4)
    scores = [proposal.score for proposal in proposals]
    assert len(proposals) == 4
    assert scores == sorted(scores, reverse=True)
    for i, one in enumerate(proposals):
        assert not any(is_near(one, other.pose, 0.45, 12.0) for other in proposals[:i])


def test_bad_arguments_are_named() -> None:
    known = building(6, rooms=1)
    with pytest.raises(ValueError, match="window needs a guess"):
        propose(known, known, window=np.ones(3))
    with pytest.raises(ValueError, match="tolerance"):
        propose(known, known, tolerance=0.0)
    with pytest.raises(ValueError, match="guess and window must be three finite numbers"):
        propose(known, known, guess=np.array([0.0, math.nan, 0.0]), window=np.ones(3))
    with pytest.raises(ValueError, match="end_points"):
        dataclasses.replace(known, normals=known.normals[1:])
    with pytest.raises(ValueError, match="directions"):
        dataclasses.replace(known, directions=known.directions * math.nan)


@settings(max_examples=200)
@given(
    x=st.floats(-3.0, 15.0), y=st.floats(-3.0, 12.0), angle=ANGLES, half=st.floats(0.0, 8.0), reach=st.floats(0.1, 2.0)
)
def test_a_strip_of_votes_covers_what_lies_near_its_segment(
    x: float, y: float, angle: float, half: float, reach: float
) -> None:
    mask = np.zeros((9, 12), dtype=np.uint64)
    tx, ty = math.cos(angle), math.sin(angle)
    stamp(mask, np.uint64(4), x, y, tx, ty, half, reach)
    v, u = np.mgrid[:9, :12] + 0.5
    along, across = tx * (u - x) + ty * (v - y), np.abs(-ty * (u - x) + tx * (v - y))
    assert (mask[(np.abs(along) < half - reach - 1.0) & (across <= reach)] == 4).all()
    assert (mask[(np.abs(along) > half + 2.0 * reach + 2.0) | (across > reach + 1.0)] == 0).all()


@settings(max_examples=50)
@given(seed=st.integers(0, 10**6), turn=st.floats(-0.05, 0.05))
def test_right_pairs_lead_to_the_right_pose(seed: int, turn: float) -> None:
    from contourslam.matching.constellation import _rows

    known = building(seed % 7, rooms=2)
    truth = np.array([4.0, 3.0, 2.0])
    local, pairs = _rows(move(known, inverse(truth))), np.arange(len(known.directions) + len(known.normals))
    pose = truth + np.array([0.1, -0.2, turn])
    for _ in range(4):
        pose = solve(local, _rows(known), pose, pairs, 0.075, 0.05)
    np.testing.assert_allclose(pose, truth, atol=1e-3)
