"""What a joint needs, and how far from it two maps are."""

from contourslam.joining.joint import Evidence, Reason

# Measured over maps that are known to be related or not: docs/joining.md.
MOST_CONTRADICTED = 0.03
MOST_RIVAL = 0.7
LEAST_WORTH = 25.0  # m of surfaces that both maps have, less what speaks against
LEAST_WAY = 4.0  # m
ALIKE = 5.0  # m of surfaces; below, two maps have nothing alike
AGAINST = 2.0  # what a surface that was seen through counts against one that was found


def worth(agreeing: float, contradicted: float) -> float:
    """What speaks for a way of laying one map on another, m, may be negative.

    Parameters
    ----------
    agreeing : float
        Length of the surfaces that both have, m.
    contradicted : float
        Part of the surfaces of either, where the other has looked, that the other saw through.
    """
    return agreeing * (1.0 - 2.0 * AGAINST * contradicted / max(1.0 - contradicted, 1e-9))


def hurdles(evidence: Evidence) -> dict[Reason, float]:
    """By what factor each limit of a joint is missed; two maps are joined where none is more than 1."""
    little = LEAST_WORTH / max(worth(evidence.agreeing, evidence.contradicted), 1e-9)
    return {
        "nothing alike": ALIKE / max(evidence.agreeing, 1e-9),
        "contradicted": evidence.contradicted / MOST_CONTRADICTED,
        "ambiguous": evidence.rival / MOST_RIVAL,
        "too little": max(little, LEAST_WAY / max(evidence.way, 1e-9)),
    }


def reason(evidence: Evidence) -> Reason | None:
    """Why not to join; None where nothing speaks against it."""
    return next((name for name, factor in hurdles(evidence).items() if factor > 1.0), None)
