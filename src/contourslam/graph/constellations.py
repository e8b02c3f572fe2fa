"""The corners and walls around the robot, and those it saw long ago, as constellations that can be held together."""

import numpy as np

from contourslam.contour.contours import Floats, Ints
from contourslam.geometry.poses import inverse, transform
from contourslam.graph.sightings import CONVEX, DIRECTION, END, KIND, OPENING, START, X, Y
from contourslam.matching.constellation import Constellation, Proposal, propose
from contourslam.slam.measurement import CORNER, WALL

LEAST_SCORE, MOST_RIVAL = 1.0, 0.8  # of a proposal that is taken to its word; of the next one beside it
LEAST_PAIRS = 4  # landmarks found again, a corner among them
LEAST_LANDMARKS = 6  # around the robot, for a try to be worth while


def constellation(table: Floats, rows: Ints, frame: Floats) -> Constellation:
    """Give rows of the table of landmarks, in the world, as a constellation seen from `frame`."""
    chosen = table[rows]
    back = inverse(frame)
    corners, walls = chosen[chosen[:, KIND] == CORNER], chosen[chosen[:, KIND] == WALL]
    tangents = np.column_stack([-np.sin(walls[:, DIRECTION]), np.cos(walls[:, DIRECTION])])
    middles = walls[:, [X, Y]]
    ends = [middles + walls[:, [column]] * tangents for column in (START, END)]
    return Constellation(
        transform(back, corners[:, [X, Y]]),
        corners[:, DIRECTION] + back[2],
        corners[:, OPENING],
        corners[:, CONVEX] > 0.5,
        walls[:, DIRECTION] + back[2],
        transform(back, np.stack(ends, axis=1)),
    )


def recognise(
    local: Constellation, known: Constellation, guess: Floats, window: Floats
) -> tuple[Proposal, float] | None:
    """Find what is around the robot among what it saw long ago.

    Parameters
    ----------
    local : Constellation
        Seen from the robot.
    known : Constellation
        In the world.
    guess, window : ndarray, shape (3,)
        The robot in the world as far as it is known, and the half widths of the window about it: m, m, rad.

    Returns
    -------
    (Proposal, float) or None
        Where the robot is, and the score of the best other place as a part of this one's; None where nothing is found
        that stands out.
    """
    if len(local.normals) + 2 * len(local.directions) < LEAST_LANDMARKS or not len(local.directions):
        return None
    found = propose(local, known, guess=guess, window=window, keep=2)
    if not found:
        return None
    best = found[0]
    rival = found[1].score / best.score if len(found) > 1 else 0.0
    corners, walls = len(set(best.corner_pairs[:, 1].tolist())), len(set(best.wall_pairs[:, 1].tolist()))
    if best.score < LEAST_SCORE or rival > MOST_RIVAL or not corners or corners + walls < LEAST_PAIRS:
        return None
    return best, rival
