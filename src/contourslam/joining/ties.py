"""Keyframes of one map tied to the places of another: what binds the two in one graph."""

import numpy as np

from contourslam.contour.contours import Floats
from contourslam.geometry.poses import between_one, inverse
from contourslam.graph.places import FARTHEST, PRIOR
from contourslam.joining.chart import Chart
from contourslam.joining.joint import Tie
from contourslam.joining.laying import LEAST_OVERLAP, Laid
from contourslam.matching.align import align
from contourslam.matching.certainty import hold, match_covariance


def ties_of(first: Chart, second: Chart, laid: Laid) -> tuple[Tie, ...]:
    """Tie each keyframe that fits to the nearest place of the first map, where it fits that alone too."""
    found: list[Tie] = []
    for key, pose in zip(laid.keyframes[laid.fits].tolist(), laid.poses[laid.fits], strict=True):
        anchor = first.place_near(pose)
        cells, held = first.place(anchor)
        contour = second.contour(key)
        guess = between_one(first.frames.poses[anchor], pose)
        aligned = align(contour, cells, guess, PRIOR)
        if aligned.overlap < LEAST_OVERLAP or (np.abs(between_one(guess, aligned.pose)) > FARTHEST).any():
            continue
        own = hold(contour, cells, aligned.pose)
        covariance = match_covariance(own, aligned.pose, held, np.zeros(3), float(second.frames.blurs[key]))
        found.append(Tie(anchor, key, aligned.pose, covariance))
    return tuple(found)


def turned_tie(tie: Tie) -> Tie:
    """Give a tie as one of the second map's place to the first one's keyframe."""
    return Tie(tie.second, tie.first, inverse(tie.pose), _turned(tie.covariance, tie.pose))


def _turned(covariance: Floats, pose: Floats) -> Floats:
    """Covariance of the inverse of a pose, in the frame of what was the first: through the adjoint of the pose."""
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    adjoint = np.array([[cos, -sin, pose[1]], [sin, cos, -pose[0]], [0.0, 0.0, 1.0]])
    return np.asarray(adjoint @ covariance @ adjoint.T)
