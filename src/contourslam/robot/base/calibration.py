"""Wheel radii and wheel base from a drive: the wheels' word held against the way that SLAM found.

Between poses some way apart, the motion that the wheels' angles give through radii and base must be the one that SLAM
gives (Censi, Franchi, Marchionni and Oriolo, Simultaneous calibration of odometry and sensor parameters for mobile
robots, IEEE Transactions on Robotics 29, 2013; here by iterated least squares, which also follows long pieces of way).
"""

import dataclasses
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contourslam.errors import ConfigError
from contourslam.geometry.angles import wrap
from contourslam.geometry.poses import between, compose
from contourslam.robot.base.wheel_track import WheelTrack
from contourslam.robot.config import BaseConfig

Floats = NDArray[np.float64]

_PIECE, _PIECE_TURN = 1.0, 1.0  # m and rad; a piece of way ends where either is reached ...
_SHORTEST, _LONGEST = 0.5, 10.0  # s; ... within these
_FEWEST = 12  # pieces of way
_STEPS = 30
_CLOSE = 1e-9
_OUTLYING = 2.5  # standard deviations, from which on a piece counts for less (Cauchy)
_BELIEVED = 0.1  # fraction to which radii and base are known before; what a drive does not tell stays as it was
_LAG_SIGMA = 0.05  # s; how far wheels' and lidar's stamps are taken to be off
_TURNS_WANTED = 0.5 * math.pi  # rad to each side
_SIGMA_WANTED = 0.002
_PLACES = np.diag([0.03, 0.03, math.radians(3.0)])  # how well the lidar's place is taken to be known: m, m, rad


@dataclass(frozen=True, slots=True)
class PieceErrors:
    """How far the wheels are off SLAM over pieces of way of about a metre or a radian: root mean squares.

    Attributes
    ----------
    way : float
        m.
    turn : float
        rad.
    """

    way: float
    turn: float


@dataclass(frozen=True, slots=True)
class BaseCalibration:
    """What a drive tells of the wheels.

    Attributes
    ----------
    base : BaseConfig
        With the radii and the wheel base that were found.
    sigmas : ndarray, shape (3,)
        Standard deviations of left radius, right radius and wheel base, as fractions of them.
    covariance : ndarray, shape (3, 3)
        Of the three, m².
    lag : float
        By how much the wheels' stamps are late beside the lidar's, s.
    lidar_shift : ndarray, shape (3,)
        By how much the lidar sits elsewhere than was said: m, m, rad, in the frame of the base.
    lidar_sigmas : ndarray, shape (3,)
        Its standard deviations.
    before, after : PieceErrors
        With the radii and the base as they were believed, and as they were found.
    pieces : int
        Pieces of way.
    distance, left_turn, right_turn : float
        m driven, rad turned to either side.
    warnings : tuple of str
        What the drive lacked.
    """

    base: BaseConfig
    sigmas: Floats
    covariance: Floats
    lag: float
    lidar_shift: Floats
    lidar_sigmas: Floats
    before: PieceErrors
    after: PieceErrors
    pieces: int
    distance: float
    left_turn: float
    right_turn: float
    warnings: tuple[str, ...]


def calibrate(
    stamps: Floats, poses: Floats, track: WheelTrack, base: BaseConfig, lidar: tuple[float, float, float] | None = None
) -> BaseCalibration:
    """Find wheel radii and wheel base.

    Parameters
    ----------
    stamps : ndarray, shape (n,)
        Of the scans, s.
    poses : ndarray, shape (n, 3)
        Of the base at these times, as SLAM found them: m, m, rad.
    track : WheelTrack
        How the wheels turned.
    base : BaseConfig
        What is believed of it.
    lidar : tuple of (float, float, float), optional
        ``T_base_lidar`` that SLAM was told: m, m, rad; by default where the base is.

    Returns
    -------
    BaseCalibration

    Raises
    ------
    ConfigError
        If wheels and SLAM share too little of the way, or the robot hardly moved.
    """
    problem = _Problem(stamps, poses, track, np.array(lidar or (0.0, 0.0, 0.0)))
    start = np.array([base.left_radius, base.right_radius, base.wheel_base, 0.0, 0.0, 0.0, 0.0])
    found, covariance, scale = problem.solve(start)
    before, after = problem.errors(start), problem.errors(found)
    wheels = found[:3]
    if not ((wheels > 0.5 * start[:3]) & (wheels < 2.0 * start[:3])).all():
        raise ConfigError(
            "the wheels do not fit the way at all, a radius or the base would be off by half or more: are left and "
            "right, or the sign of a wheel, mixed up, or ticks_per_turn wrong?"
        )
    sigmas = np.sqrt(np.diag(covariance))
    left, right, wheel_base = (float(value) for value in wheels)
    fractions = sigmas[:3] / wheels
    turns = problem.turns(found)
    return BaseCalibration(
        dataclasses.replace(base, left_radius=left, right_radius=right, wheel_base=wheel_base),
        fractions,
        covariance[:3, :3],
        float(found[3]),
        found[4:],
        sigmas[4:],
        before,
        after,
        len(problem.first),
        problem.distance(found),
        *turns,
        _warnings(fractions, turns, scale),
    )


def _warnings(fractions: Floats, turns: tuple[float, float], scale: Floats) -> tuple[str, ...]:
    out = []
    for side, turn in zip(("left", "right"), turns, strict=True):
        if turn < _TURNS_WANTED:
            out.append(
                f"the robot turned to the {side} by {math.degrees(turn):.0f} degrees only; drive curves "
                "to both sides, or unequal wheels cannot be told from a wrong wheel base"
            )
    for name, fraction in zip(("left radius", "right radius", "wheel base"), fractions.tolist(), strict=True):
        if fraction > _SIGMA_WANTED:
            out.append(f"the {name} is known to {fraction:.1%} only; drive longer, with curves to both sides")
    if scale[0] > 0.05 or scale[2] > math.radians(3.0):
        out.append("wheels and SLAM agree poorly: the wheels slip, or SLAM lost its way; look at the map of the drive")
    return tuple(out)


class _Problem:
    """Pieces of way, and how well wheels with given parameters explain them.

    The parameters are left radius, right radius, wheel base (m), lag (s), and the lidar's shift (m, m, rad).
    """

    def __init__(self, stamps: Floats, poses: Floats, track: WheelTrack, lidar: Floats) -> None:
        self.track, self.lidar = track, lidar
        order = np.argsort(stamps, kind="stable")
        inside = (stamps[order] > track.stamps[0] + 0.1) & (stamps[order] < track.stamps[-1] - 0.1)
        self.stamps, poses = stamps[order][inside], poses[order][inside]
        self.first, self.last = _pieces(self.stamps, poses)
        if len(self.first) < _FEWEST:
            raise ConfigError(
                f"only {len(self.first)} pieces of way of a metre or a radian are in the drive; drive longer, a few "
                "minutes with curves to both sides are best"
            )
        # What SLAM really knows is how the lidar moved; where the base is beside it, it was told.
        seen = compose(poses, lidar)
        self.seen = between(seen[self.first], seen[self.last])

    def moved(self, parameters: Floats) -> Floats:
        """Motion of the base over each piece by its wheels, shape (k, 3)."""
        left, right, wheel_base, lag = parameters[:4].tolist()
        times = np.union1d(self.track.stamps, self.stamps + lag)
        angles = self.track.at(times)
        ways = np.diff(angles, axis=0) * [left, right]
        way, turn = ways.mean(axis=1), (ways[:, 1] - ways[:, 0]) / wheel_base
        heading = np.concatenate([[0.0], np.cumsum(turn)])
        middle, chord = heading[:-1] + 0.5 * turn, way * np.sinc(turn / (2.0 * math.pi))
        steps = np.stack([chord * np.cos(middle), chord * np.sin(middle)], axis=1)
        position = np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])
        at = np.searchsorted(times, self.stamps + lag)
        rolled = np.column_stack([position[at], heading[at]])
        return between(rolled[self.first], rolled[self.last])

    def residuals(self, parameters: Floats) -> Floats:
        """What the lidar moved otherwise than the wheels say, shape (k, 3): m, m, rad."""
        place = self.lidar + parameters[4:]
        moved = self.moved(parameters)
        carried = between(np.broadcast_to(place, moved.shape), compose(moved, place))
        out = self.seen - carried
        out[:, 2] = wrap(out[:, 2])
        return out

    def errors(self, parameters: Floats) -> PieceErrors:
        off = self.residuals(parameters)
        return PieceErrors(
            float(np.sqrt(np.mean(off[:, 0] ** 2 + off[:, 1] ** 2))), float(np.sqrt(np.mean(off[:, 2] ** 2)))
        )

    def distance(self, parameters: Floats) -> float:
        return float(np.linalg.norm(self.moved(parameters)[:, :2], axis=1).sum())

    def turns(self, parameters: Floats) -> tuple[float, float]:
        """Angles turned to the left and to the right, rad; a radian at most each, so that nothing wraps."""
        turn = self.moved(parameters)[:, 2]
        return float(turn[turn > 0.0].sum()), float(-turn[turn < 0.0].sum())

    def solve(self, start: Floats) -> tuple[Floats, Floats, Floats]:
        """Least squares by Gauss and Newton, where outlying pieces count for less.

        Returns
        -------
        found : ndarray, shape (7,)
        covariance : ndarray, shape (7, 7)
            From the scatter of the residuals themselves.
        scale : ndarray, shape (3,)
            That scatter: m, m, rad.
        """
        prior = np.diag([*(_BELIEVED * start[:3]) ** -2.0, _LAG_SIGMA**-2, *np.diag(_PLACES) ** -2.0])
        small = np.array([1e-6, 1e-6, 1e-5, 1e-4, 1e-5, 1e-5, 1e-5])
        found = start.copy()
        for _ in range(_STEPS):
            off = self.residuals(found)
            scale = np.maximum(1.4826 * np.median(np.abs(off - np.median(off, axis=0)), axis=0), [1e-4, 1e-4, 1e-4])
            weights = 1.0 / (1.0 + ((off / scale) ** 2).sum(axis=1) / (3.0 * _OUTLYING**2))
            columns = [
                (self.residuals(found - step) - self.residuals(found + step)) / (2.0 * width)
                for step, width in zip(np.diag(small), small, strict=True)
            ]
            jacobian = np.stack(columns, axis=2) / scale[:, None]  # of what the wheels explain
            weighted = jacobian * weights[:, None, None]
            information = np.einsum("kip,kiq->pq", weighted, jacobian) + prior
            pull = np.einsum("kip,ki->p", weighted, off / scale) + prior @ (start - found)
            try:
                step = np.linalg.solve(information, pull)
            except np.linalg.LinAlgError as error:
                raise ConfigError("the drive tells nothing of the wheels: the robot did not move") from error
            step[:3] = np.clip(step[:3], -0.3 * found[:3], 0.3 * found[:3])
            found = found + step
            if np.abs(step[:3] / found[:3]).max() < _CLOSE:
                break
        return found, np.linalg.inv(information), scale


def _pieces(stamps: Floats, poses: Floats) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Cut the way into pieces: numbers of the scans at which each begins and ends."""
    first, last, begin = [], [], 0
    way = turn = 0.0
    steps = between(poses[:-1], poses[1:])
    for k, (dx, dy, dtheta) in enumerate(steps.tolist(), start=1):
        way, turn = way + math.hypot(dx, dy), turn + abs(dtheta)
        elapsed = stamps[k] - stamps[begin]
        if elapsed > _LONGEST:
            begin, way, turn = k, 0.0, 0.0
        elif elapsed >= _SHORTEST and (way >= _PIECE or turn >= _PIECE_TURN):
            first.append(begin)
            last.append(k)
            begin, way, turn = k, 0.0, 0.0
    return np.array(first, dtype=np.int64), np.array(last, dtype=np.int64)
