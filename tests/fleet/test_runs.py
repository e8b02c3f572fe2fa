"""Facts of one run: what can be used of them, how far they hang together, and the views that they give."""

import math
from dataclasses import replace

import numpy as np
import pytest

from contourslam.fleet.facts import Fact, KeyframeFact, RelationFact, StretchFact
from contourslam.fleet.runs import Run


def keyframe(number: int, drive: int = 0) -> KeyframeFact:
    points = np.array([[1.0, 0.01 * number, -1.0, 0.0]], np.float32)
    where = np.array([0.4 * number, 0.0, 0.0])
    return KeyframeFact(number, 0.5 * number, where, 0.0, points, np.zeros((0, 13), np.float32), drive)


def relation(first: int, second: int, information: float = 1e4) -> RelationFact:
    return RelationFact(first, second, np.array([0.4, 0.0, 0.0]), information * np.eye(3), math.nan, False)


def run_of(*facts: Fact) -> Run:
    run = Run("robot", 1)
    for fact in facts:
        assert run.take(fact) == ""
    return run


def unplaced(number: int) -> bool:
    return number == 0


ODD: dict[str, Fact] = {
    "a keyframe out of turn": keyframe(3),
    "a keyframe of a drive before": keyframe(2, -1),
    "a keyframe nowhere": replace(keyframe(2), pose=np.array([0.0, 1e8, 0.0])),
    "a keyframe that saw what cannot be": replace(keyframe(2), seen=np.full((1, 13), 1e9, np.float32)),
    "a relation to itself": relation(1, 1),
    "a relation to what is not there": relation(0, 2),
    "a relation from before all": relation(-3, 1),
    "a relation of no information": relation(0, 1, 0.0),
    "a relation of too much": relation(0, 1, 1e17),
    "a relation of negative information": relation(0, 1, -1.0),
    "a relation of no number": relation(0, 1, math.nan),
    "a relation of no width": replace(relation(0, 1), robust=0.0),
    "a relation to nowhere": replace(relation(0, 1), pose=np.array([math.inf, 0.0, 0.0])),
    "an empty stretch": StretchFact(0, (), np.zeros((0, 3))),
    "a stretch of what is not there": StretchFact(0, (0, 2), np.zeros((2, 3))),
    "a stretch about what is not there": StretchFact(-1, (0,), np.zeros((1, 3))),
    "a stretch of negative numbers": StretchFact(0, (-1,), np.zeros((1, 3))),
    "a stretch as long as a country": StretchFact(0, (0, 1), np.array([[0.0, 0.0, 0.0], [1e5, 0.0, 0.0]])),
}


@pytest.mark.parametrize("odd", ODD.values(), ids=ODD)
def test_a_fact_that_cannot_be_is_left_out_and_told_of(odd: Fact) -> None:
    run = run_of(keyframe(0), keyframe(1))
    assert run.take(odd)
    assert (len(run.keyframes), run.relations, run.stretches) == (2, [], [])


def test_keyframes_are_placed_up_to_the_last_to_which_all_before_are_bound() -> None:
    run = run_of(*(keyframe(number) for number in range(6)), relation(0, 1), relation(1, 3))
    assert run.reach(unplaced) == 2
    run.take(relation(4, 2))  # two groups, each bound in itself
    assert run.reach(unplaced) == 2
    run.take(relation(3, 4))
    assert run.reach(unplaced) == 5
    assert run.reach(lambda number: number in (0, 5)) == 6  # the last is known from another run


def test_a_keyframe_bound_to_a_later_one_alone_waits_for_that() -> None:
    run = run_of(keyframe(0), keyframe(1), keyframe(2), relation(2, 1))
    assert run.reach(unplaced) == 1
    run.take(relation(0, 2))
    assert run.reach(unplaced) == 3


def test_views_are_given_once_and_go_on_where_they_were_left() -> None:
    every = [keyframe(number, drive=int(number >= 70)) for number in range(140)]
    whole, grown = run_of(*every), run_of(*every)
    begin, pieced = (0, 0), []
    for number in range(140):
        whole.place(number, again=False)
        grown.place(number, again=False)
        for (piece, k), view, members in grown.views(8.0, begin):
            pieced.append((view, members.tolist()))
            begin = piece, k + 1
    assert pieced == [(view, members.tolist()) for _, view, members in whole.views(8.0)]
    assert {first for (first, _), _ in pieced} == {0, 70}
    for (_, k), members in pieced:
        assert members[-1] - members[0] == 19  # 8 m
        assert members[0] % 70 == 10 * k  # one begins every 4 m


def test_what_another_run_has_told_of_is_in_no_view() -> None:
    run = run_of(*(keyframe(number) for number in range(100)))
    for number in range(100):
        run.place(number, again=number < 50)
    assert run.own == list(range(50, 100))
    assert min(members[0] for _, _, members in run.views(8.0)) == 50


def test_a_recording_mapped_twice_into_one_map_is_in_it_twice() -> None:
    again = replace(keyframe(0, 1), number=1)
    run = run_of(keyframe(0), again)
    assert len(set(run.identities)) == 2
    assert run.identities[0] == run_of(keyframe(0)).identities[0]
