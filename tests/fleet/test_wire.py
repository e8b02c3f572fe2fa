"""Messages as bytes: what is decoded lies within the stated bounds, and what is no message is a known failure."""

import math
import zlib
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from contourslam.errors import MessageError
from contourslam.fleet import wire_contours, wire_facts, wire_sightings
from contourslam.fleet.compact import Reader, Writer
from contourslam.fleet.facts import Answer, Fact, KeyframeFact, RelationFact, Report, Status, StretchFact
from contourslam.fleet.wire import HEAD, LONGEST, decode, encode, head

NAMES = st.sampled_from(["a", "robot_1", "X4.front-left", "r" * 64])
RUNS = st.integers(0, 2**63 - 1)
SEEDS = st.integers(0, 2**32 - 1)


def pose_of(rng: np.random.Generator) -> Any:
    return np.array([*10.0 ** rng.uniform(-3, 4, 2) * rng.choice([-1, 1], 2), rng.uniform(-math.pi, math.pi)])


def spread_of(rng: np.random.Generator) -> Any:
    """A covariance: standard deviations from a tenth of a millimetre to ten metres, as sharp or slanting as may be."""
    lower = np.eye(3)
    lower[np.tril_indices(3, -1)] = rng.uniform(-3.0, 3.0, 3)
    root = lower * 10.0 ** rng.uniform(-4.0, 1.0, 3)
    return root @ root.T


def contour_of(rng: np.random.Generator) -> Any:
    """Points anywhere, or along walls as a scan has them."""
    n, turn = int(rng.integers(0, 60)), rng.uniform(-math.pi, math.pi)
    points = rng.uniform(-50.0, 50.0, (n, 2))
    if rng.random() < 0.5:
        bearings = turn + 0.0125 * np.arange(n)
        ranges = np.minimum(3.0 / np.maximum(np.abs(np.cos(bearings)), 0.1), 9.0) + 0.01 * rng.standard_normal(n)
        points = ranges[:, None] * np.stack([np.cos(bearings), np.sin(bearings)], axis=1)
    points *= rng.random((n, 1)) > 0.02  # some at the very base
    turns = rng.uniform(-math.pi, math.pi, n)
    return np.concatenate([points, np.stack([np.cos(turns), np.sin(turns)], axis=1)], axis=1).astype(np.float32)


def sightings_of(rng: np.random.Generator) -> Any:
    rows = []
    for _ in range(int(rng.integers(0, 7))):
        (x, y), turn = rng.uniform(-80, 80, 2), rng.uniform(-math.pi, math.pi)
        xx, yy, tt = 10.0 ** rng.uniform(-7, 0, 3)
        share, (one, other) = rng.uniform(-0.9, 0.9), rng.uniform(0.1, 30.0, 2)
        if rng.random() < 0.5:
            rows.append([1, x, y, turn, 0, 0, -one, one, xx, 0, 0, share * math.sqrt(xx * tt), tt])
        else:
            xy, opening, convex = share * math.sqrt(xx * yy), rng.uniform(0.3, 3.0), rng.integers(2)
            rows.append([0, x, y, turn, opening, convex, one, other, xx, xy, yy, 0, tt])
    return np.array(rows, np.float32).reshape(-1, 13)


def fact_of(rng: np.random.Generator) -> Fact:
    kind = rng.integers(3)
    key, first = rng.integers(0, 10**6, 2).tolist()
    if kind == 0:
        stamp, blur = rng.uniform(-1e9, 3e9), rng.choice([0.0, 10.0 ** rng.uniform(-10, 0)])
        points, seen = contour_of(rng), sightings_of(rng)
        return KeyframeFact(key, float(stamp), pose_of(rng), float(blur), points, seen, int(rng.integers(9)))
    if kind == 1:
        robust, information = float(rng.choice([math.nan, 1.0, 3.0])), np.linalg.inv(spread_of(rng))
        information = 0.5 * (information + information.T)
        return RelationFact(
            first if rng.random() < 0.9 else -1, key, pose_of(rng), information, robust, rng.random() < 0.5
        )
    members = rng.integers(0, 10**6, int(rng.integers(1, 9))).tolist()
    return StretchFact(key, tuple(members), np.array([pose_of(rng) for _ in members]))


def report_of(robot: str, run: int, seed: int) -> Report:
    rng = np.random.default_rng(seed)
    facts = tuple(fact_of(rng) for _ in range(int(rng.integers(0, 6))))
    return Report(robot, run, int(rng.integers(10**9)), facts)


def status_of(robot: str, run: int, seed: int) -> Status:
    rng = np.random.default_rng(seed)
    reports, keyframe = int(rng.integers(10**9)), int(rng.integers(-1, 10**6))
    return Status(robot, run, reports, keyframe, pose_of(rng), float(rng.uniform(-1e9, 3e9)))


def answer_of(robot: str, run: int, seed: int) -> Answer:
    rng = np.random.default_rng(seed)
    received, common = rng.integers(0, 10**9, 2).tolist()
    missing = tuple((received + np.cumsum(rng.integers(1, 9, int(rng.integers(6))))).tolist())
    members = tuple(["b", robot, "c.d"][: int(rng.integers(4))])
    spread = spread_of(rng) if rng.random() < 0.9 else np.zeros((3, 3))
    return Answer(robot, run, received, missing, common, members, int(rng.integers(-1, 99)), pose_of(rng), spread)


REPORTS = st.builds(report_of, NAMES, RUNS, SEEDS)
STATUSES, ANSWERS = st.builds(status_of, NAMES, RUNS, SEEDS), st.builds(answer_of, NAMES, RUNS, SEEDS)


def assert_near(pose: Any, told: Any, place: float, turn: float) -> None:
    np.testing.assert_allclose(pose[..., :2], told[..., :2], rtol=0, atol=0.51 * place)
    np.testing.assert_allclose(pose[..., 2], told[..., 2], rtol=0, atol=0.51 * turn)


def assert_same(one: Fact, told: Fact) -> None:
    """Hold a fact against what was told, within the bounds that the document states."""
    if isinstance(one, KeyframeFact):
        assert isinstance(told, KeyframeFact)
        assert (one.number, one.drive) == (told.number, told.drive)
        assert abs(one.stamp - told.stamp) < 1e-6
        assert_near(one.pose, told.pose, wire_facts.PLACE, wire_facts.HEADING)
        assert one.blur == pytest.approx(told.blur, rel=0.05)
        assert one.points.dtype == one.seen.dtype == np.float32
        assert_contour(one.points, told.points)
        assert_sightings(one.seen, told.seen)
    elif isinstance(one, RelationFact):
        assert isinstance(told, RelationFact)
        assert (one.first, one.second, one.tie) == (told.first, told.second, told.tie)
        assert one.robust == told.robust or math.isnan(one.robust) == math.isnan(told.robust) is True
        assert_near(one.pose, told.pose, wire_facts.APART, wire_facts.TURN)
        assert_spread(one.information, told.information)
    else:
        assert isinstance(told, StretchFact)
        assert (one.anchor, one.members) == (told.anchor, told.members)
        assert_near(one.seen, told.seen, wire_facts.APART, wire_facts.TURN)


def assert_contour(points: Any, told: Any) -> None:
    reach = np.hypot(told[:, 0], told[:, 1])
    off = np.hypot(*(points - told)[:, :2].astype(float).T)
    step = 2.0 * math.pi / wire_contours.BEARINGS
    assert (off <= np.hypot(0.51 * wire_contours.RANGE, 0.51 * step * reach) + 1e-5).all()
    turn = np.arccos(np.clip(np.sum(points[:, 2:] * told[:, 2:], axis=1), -1.0, 1.0))
    assert (turn <= math.pi / wire_contours.NORMALS + 1e-3).all()


def assert_sightings(seen: Any, told: Any) -> None:
    assert (seen[:, [0, 5]] == told[:, [0, 5]]).all()
    np.testing.assert_allclose(seen[:, 1:3], told[:, 1:3], rtol=0, atol=0.51 * wire_sightings.POINT)
    np.testing.assert_allclose(seen[:, 3:5], told[:, 3:5], rtol=0, atol=0.51 * wire_sightings.DIRECTION)
    np.testing.assert_allclose(seen[:, 6:8], told[:, 6:8], rtol=0, atol=1.01 * wire_sightings.LENGTH)
    np.testing.assert_allclose(seen[:, [8, 10, 12]], told[:, [8, 10, 12]], rtol=0.05)
    for column, other in ((9, 10), (11, 12)):
        both = np.sqrt(told[:, 8] * told[:, other])
        assert (
            np.abs(seen[:, column] - told[:, column]) <= (0.5 / wire_sightings.CORRELATION + 0.05) * both + 1e-9
        ).all()


def assert_spread(matrix: Any, told: Any) -> None:
    """In no direction is a covariance or information off by more than an eighth."""
    root = np.linalg.cholesky(told)
    ratio = np.linalg.eigvalsh(np.linalg.solve(root, np.linalg.solve(root, matrix).T))
    assert 0.87 < ratio.min() <= ratio.max() < 1.15


@settings(max_examples=50)
@given(REPORTS)
def test_a_report_comes_back_within_the_stated_bounds(report: Report) -> None:
    told = decode(encode(report))
    assert head(encode(report)) == (report.robot, report.run, report.number)
    assert isinstance(told, Report)
    assert (told.robot, told.run, told.number) == (report.robot, report.run, report.number)
    assert len(told.facts) == len(report.facts)
    for one, other in zip(told.facts, report.facts, strict=True):
        assert_same(one, other)


@settings(max_examples=40)
@given(STATUSES)
def test_a_status_comes_back(status: Status) -> None:
    told = decode(encode(status))
    assert isinstance(told, Status)
    assert (told.robot, told.run, told.reports) == (status.robot, status.run, status.reports)
    assert told.keyframe == status.keyframe
    assert abs(told.stamp - status.stamp) < 1e-6
    assert_near(told.pose, status.pose, wire_facts.APART, wire_facts.TURN)


@settings(max_examples=40)
@given(ANSWERS)
def test_an_answer_comes_back(answer: Answer) -> None:
    told = decode(encode(answer))
    assert isinstance(told, Answer)
    for name in ("robot", "run", "received", "missing", "common", "members", "keyframe"):
        assert getattr(told, name) == getattr(answer, name)
    assert_near(told.pose, answer.pose, wire_facts.APART, wire_facts.TURN)
    if answer.covariance.any():
        assert_spread(told.covariance, answer.covariance)
    else:
        assert not told.covariance.any()


@settings(max_examples=50)
@given(REPORTS | STATUSES | ANSWERS)
def test_what_was_decoded_is_encoded_to_the_same_bytes(message: Report | Status | Answer) -> None:
    data = encode(message)
    assert encode(decode(data)) == data


def test_information_that_leaves_directions_open_stays_so() -> None:
    along = np.array([math.cos(0.7), math.sin(0.7), 0.0])
    for information in (np.zeros((3, 3)), 1e6 * np.outer(along, along), np.diag([0.0, 1e4, 0.0])):
        fact = RelationFact(0, 1, np.zeros(3), information, math.nan, False)
        data = encode(Report("a", 1, 0, (fact,)))
        told = decode(data)
        assert isinstance(told, Report)
        (back,) = told.facts
        assert isinstance(back, RelationFact)
        np.testing.assert_allclose(back.information, information, rtol=0.1, atol=0.03 * np.abs(information).max())
        assert np.linalg.matrix_rank(back.information, tol=1e-6) == np.linalg.matrix_rank(information)


@settings(max_examples=50)
@given(REPORTS | STATUSES | ANSWERS, st.data())
def test_a_message_with_one_wrong_bit_or_cut_short_is_refused(message: Report | Status | Answer, data: Any) -> None:
    whole = encode(message)
    at, bit = data.draw(st.integers(0, len(whole) - 1)), data.draw(st.integers(0, 7))
    wrong = bytearray(whole)
    wrong[at] ^= 1 << bit
    for damaged in (bytes(wrong), whole[:at], whole + b"\0"):
        for read in (decode, head):
            with pytest.raises(MessageError):
                read(damaged)


@settings(max_examples=100)
@given(st.binary(max_size=300) | st.binary(max_size=100).map(lambda tail: b"CF\x01" + tail))
@example(b"")
@example(b"CF")
def test_what_is_no_message_is_refused(data: bytes) -> None:
    with pytest.raises(MessageError):
        decode(data)


@settings(max_examples=150)
@given(st.sampled_from([b"R", b"S", b"A", b"X"]), st.binary(max_size=12), st.binary(max_size=300), st.booleans())
def test_nonsense_with_a_right_checksum_is_a_message_or_refused(
    kind: bytes, name: bytes, tail: bytes, sound: bool
) -> None:
    body = (b"\x02ab" + bytes(8) if sound else name) + tail
    data = HEAD.pack(b"CF", 1, kind, zlib.crc32(kind + body)) + body
    try:
        message = decode(data)
    except MessageError:
        return
    again = encode(message)  # whatever was accepted can be passed on
    assert encode(decode(again)) == again


@settings(max_examples=80)
@given(REPORTS, st.data())
def test_a_report_altered_under_a_right_checksum_is_a_message_or_refused(report: Report, data: Any) -> None:
    whole = encode(report)
    body = bytearray(whole[HEAD.size :])
    for _ in range(data.draw(st.integers(1, 4))):
        body[data.draw(st.integers(0, len(body) - 1))] = data.draw(st.integers(0, 255))
    wrong = HEAD.pack(b"CF", 1, b"R", zlib.crc32(b"R" + bytes(body))) + bytes(body)
    try:
        told = decode(wrong)
    except MessageError:
        return
    assert isinstance(told, Report)
    for fact in told.facts:
        if isinstance(fact, KeyframeFact):
            assert np.isfinite(fact.points).all() and np.isfinite(fact.seen).all()


def test_another_version_is_told_from_damage() -> None:
    data = bytearray(encode(Status("a", 1, 0, -1, np.zeros(3), 0.0)))
    data[2] = 2
    with pytest.raises(MessageError, match="version 2, and this program knows 1; update"):
        decode(bytes(data))


def test_a_message_longer_than_any_is_not_even_looked_at() -> None:
    with pytest.raises(MessageError, match="longer than any"):
        decode(bytes(LONGEST + 1))


@pytest.mark.parametrize("name", ["", "-a", "a b", "a/b", "..", "ä", "a" * 65, "a\n"])
def test_a_name_that_is_none_is_not_sent(name: str) -> None:
    with pytest.raises(MessageError, match="cannot be a robot's name"):
        encode(Status(name, 1, 0, -1, np.zeros(3), 0.0))


@pytest.mark.parametrize("wrong", [math.nan, math.inf, 1e300])
def test_numbers_that_are_none_are_not_sent(wrong: float) -> None:
    pose, points = np.array([wrong, 0.0, 0.0]), np.zeros((1, 4), np.float32)
    seen = np.zeros((1, 13), np.float32)
    with np.errstate(over="ignore"):
        many: list[Fact] = [
            KeyframeFact(0, 0.0, pose, 0.0, points, seen),
            KeyframeFact(0, wrong, np.zeros(3), 0.0, points, seen),
            KeyframeFact(0, 0.0, np.zeros(3), wrong, points, seen),
            KeyframeFact(0, 0.0, np.zeros(3), 0.0, points + np.float32(wrong), seen),
            KeyframeFact(0, 0.0, np.zeros(3), 0.0, points, seen + np.float32(wrong)),
            RelationFact(0, 1, pose, np.eye(3), math.nan, False),
            RelationFact(0, 1, np.zeros(3), np.full((3, 3), wrong), math.nan, False),
            StretchFact(0, (0,), pose[None]),
        ]
    for fact in many:
        with pytest.raises(MessageError):
            encode(Report("a", 1, 0, (fact,)))
    for message in (Status("a", 1, 0, -1, pose, 0.0), Status("a", 1, 0, -1, np.zeros(3), wrong)):
        with pytest.raises(MessageError):
            encode(message)


def test_a_contour_with_more_points_than_any_is_not_sent() -> None:
    with pytest.raises(MessageError, match="20001 points"):
        wire_contours.to_steps(np.zeros((20_001, 4), np.float32))
    with pytest.raises(MessageError, match="within 655 m"):
        wire_contours.to_steps(np.array([[700.0, 0.0, 1.0, 0.0]], np.float32))


def test_numbers_that_lead_out_of_the_plane_make_no_contour() -> None:
    writer = Writer(np.array(wire_facts.SIZES))
    writer.put(wire_contours.BEARING, 0)
    writer.put(wire_contours.RANGES + 3, -5)
    with pytest.raises(MessageError, match="leaves the plane"):
        wire_contours.take_contour(Reader(writer.packed(), np.array(wire_facts.SIZES)), 1)
