"""What a joint needs: doubts add up, and the largest is the reason."""

from dataclasses import replace

import pytest

from contourslam.joining.joint import Evidence
from contourslam.joining.verdict import CONTRADICTED, LEAST_WAY, doubts, hurdle, reason, worth

SURE = Evidence(corners=20, walls=20, agreeing=100.0, contradicted=0.0, way=20.0, rival=0.1)


def test_enough_to_go_by_and_nothing_against_is_a_joint() -> None:
    assert reason(SURE) is None
    assert hurdle(SURE) < 0.5


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ({"agreeing": 3.0}, "nothing alike"),
        ({"contradicted": 0.2}, "contradicted"),
        ({"rival": 0.95}, "ambiguous"),
        ({"agreeing": 9.0}, "too little"),
        ({"way": 2.0}, "too little"),
    ],
)
def test_each_doubt_alone_keeps_maps_apart(change: dict[str, float], why: str) -> None:
    poor = replace(SURE, **change)  # type: ignore[arg-type]
    assert reason(poor) == why
    assert hurdle(poor) > 1.0


def test_doubts_add_up() -> None:
    doubtful = Evidence(corners=0, walls=0, agreeing=80.0, contradicted=0.6 * CONTRADICTED, way=20.0, rival=0.45)
    assert max(doubts(doubtful).values()) < 1.0
    assert reason(doubtful) == "contradicted"


def test_only_corners_beyond_chance_excuse_what_was_seen_through() -> None:
    moved = replace(SURE, contradicted=2.0 * CONTRADICTED, rival=0.0)
    assert reason(moved) is None
    assert reason(replace(moved, corners=5)) == "contradicted"
    assert doubts(replace(moved, corners=5)) == doubts(replace(moved, corners=0))


def test_bare_walls_must_agree_over_more_than_walls_with_corners() -> None:
    """What two office floors had in common, seen in 12 m of way each: 38 m of corridor, and four corners by chance."""
    strangers = Evidence(corners=4, walls=12, agreeing=38.2, contradicted=0.0129, way=7.5, rival=0.301)
    assert reason(strangers) is not None
    assert hurdle(strangers) > 1.2
    assert reason(replace(strangers, corners=14)) is None


def test_a_verdict_and_its_hurdle_agree() -> None:
    for way in (0.5 * LEAST_WAY, LEAST_WAY, 10.0):
        for rival in (0.0, 0.5, 1.0):
            evidence = replace(SURE, way=way, rival=rival)
            assert (reason(evidence) is None) == (hurdle(evidence) <= 1.0)


def test_what_was_seen_through_counts_against() -> None:
    assert worth(50.0, 0.0) == 50.0
    assert worth(50.0, 11.0) < 30.0  # a tenth of what either map has there
    assert worth(50.0, 100.0) < 0.0
