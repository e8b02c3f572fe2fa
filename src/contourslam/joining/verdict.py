"""What a joint needs, and how far from it two maps are."""

from typing import TypeVar

from contourslam.contour.contours import Floats
from contourslam.joining.joint import Evidence, Reason

# Each of these alone would be all the doubt that a joint may leave; parts of them add up. Set between maps that are
# known to overlap and maps that are known not to: docs/joining.md.
CONTRADICTED = 0.04  # part of the surfaces that were seen through, where corners tell nothing
# Furniture is moved, and where corners were found again by more than chance, that is likelier than another building.
BY_CHANCE, TWICE, MOST = 6, 8, 20  # corners; more than are there by chance that allow for twice as much; that count
RIVAL = 0.9  # what speaks for another way of laying them, as a part of what speaks for this one
# Walls of bare corridors are alike everywhere, and two that begin at a junction agree over dozens of metres.
BARE, LITTLE = 25.0, 10.0  # m of surfaces that both have: where corners tell nothing; where they tell much
HALF = 4  # corners; more than are there by chance, with which half as many metres as of bare walls will do
LEAST_WAY = 4.0  # m
ALIKE = 5.0  # m of surfaces; below, two maps have nothing alike
AGAINST = 2.0  # what a surface that was seen through counts against one that was found, where two ways are compared


Metres = TypeVar("Metres", float, Floats)


def worth(agreeing: Metres, through: Metres) -> Metres:
    """What speaks for a way of laying one map on another, m, may be negative.

    Parameters
    ----------
    agreeing : float or ndarray
        Length of the surfaces that both have, m.
    through : float or ndarray
        Of the surfaces of either that the other saw through, m.
    """
    return agreeing - AGAINST * through


def doubts(evidence: Evidence) -> dict[Reason, float]:
    """What is doubtful about a way of laying one map on another; together up to 1 is no hindrance to a joint."""
    corners = min(max(evidence.corners - BY_CHANCE, 0), MOST)
    return {
        "contradicted": evidence.contradicted / (CONTRADICTED * (1.0 + corners / TWICE)),
        "ambiguous": evidence.rival / RIVAL,
        "too little": max(BARE / (1.0 + corners / HALF), LITTLE) / max(evidence.agreeing, 1e-9),
    }


def hurdle(evidence: Evidence) -> float:
    """By what factor two maps miss what a joint needs; they are joined where it is not above 1."""
    return max(sum(doubts(evidence).values()), LEAST_WAY / max(evidence.way, 1e-9))


def reason(evidence: Evidence) -> Reason | None:
    """Why not to join; None where nothing speaks against it."""
    if evidence.agreeing < ALIKE:
        return "nothing alike"
    doubtful = doubts(evidence)
    if sum(doubtful.values()) > 1.0:
        return max(doubtful, key=lambda name: doubtful[name])
    return "too little" if evidence.way < LEAST_WAY else None
