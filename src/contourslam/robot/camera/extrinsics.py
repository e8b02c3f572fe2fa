"""Where the camera sits beside the lidar: the lidar's points on a board must lie in the plane that the camera sees.

Nothing need be known of the place beforehand: all rotations are tried against the straight pieces of the scans.

References
----------
Q. Zhang and R. Pless, Extrinsic calibration of a camera and laser range finder, IROS 2004.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contourslam.geometry.rigid import inverse, rigid
from contourslam.robot.camera.board import Board
from contourslam.robot.camera.calibration import CalibrationError
from contourslam.robot.camera.plane_fit import PlaneFit, fit_planes
from contourslam.robot.camera.rotations import all_rotations
from contourslam.robot.camera.segments import straight_pieces

Floats = NDArray[np.float64]

LEAST_STANDS = 4
_NEAR = 0.6  # m: the camera is not farther from the lidar than this
_GRID_DEG = 15.0
_STARTS = 40  # of the rotations that fit most stands, how many are followed up
_GATES = (0.4, 0.2, 0.1, 0.06)  # m: how far a point may be off the plane, from the first round to the last
_CERTAIN, _MOST = 0.02, 0.7  # m: points so near to so many of the boards are no chance
_EDGE = 0.02  # m: a beam so close to the board's edge may have hit both the board and what is behind it
_FEWEST = 5  # points on a board
_SURE_M, _SURE_DEG, _GOOD_M, _GOOD_DEG = 0.05, 2.0, 0.01, 0.5
_MANY = 10  # stands


@dataclass(frozen=True)
class Stand:
    """A board that stands still, as the camera and the lidar see it.

    Attributes
    ----------
    name : str
        Such as its time.
    T_camera_board : ndarray, shape (4, 4)
        m.
    covariance : ndarray, shape (6, 6)
        Of a small turn (rad) of the board about its origin and of a small move (m), about and along the camera's axes.
    scans : tuple of ndarray, each of shape (n, 2)
        Points of scans taken meanwhile, in the order of the beams, lidar frame, m; NaN where nothing was hit.
    """

    name: str
    T_camera_board: Floats
    covariance: Floats
    scans: tuple[Floats, ...]


@dataclass(frozen=True)
class FittedStand:
    """A stand beside what the place found says of it.

    Attributes
    ----------
    name : str
    points : int
        Points of the lidar on the board; 0 where it was left out.
    rms : float
        Of their distances from its plane, m; NaN where it was left out.
    """

    name: str
    points: int
    rms: float


@dataclass(frozen=True)
class Extrinsics:
    """Where the camera sits beside the lidar.

    Attributes
    ----------
    T_lidar_camera : ndarray, shape (4, 4)
        m.
    covariance : ndarray, shape (6, 6)
        Of a small move (m) and a small turn (rad) of the camera, both along and about the lidar's axes.
    rms : float
        Of the points' distances from the boards' planes, m.
    stands : tuple of FittedStand
    warnings : tuple of str
        What to do better.
    """

    T_lidar_camera: Floats
    covariance: Floats
    rms: float
    stands: tuple[FittedStand, ...]
    warnings: tuple[str, ...]

    @property
    def sigma_position(self) -> float:
        """Standard deviation of the place in the direction that is known least, m."""
        return math.sqrt(float(np.linalg.eigvalsh(self.covariance[:3, :3])[-1]))

    @property
    def sigma_turn_deg(self) -> float:
        """Standard deviation of the turn about the axis that is known least, degrees."""
        return math.degrees(math.sqrt(float(np.linalg.eigvalsh(self.covariance[3:, 3:])[-1])))


def find_extrinsics(stands: Sequence[Stand], board: Board, *, margin: float = 0.0) -> Extrinsics:
    """Find where the camera sits beside the lidar.

    Parameters
    ----------
    stands : sequence of Stand
        At least 4, the board tilted differently in each; 15 or more are good.
    board : Board
    margin : float
        Of the board around its squares, m, which the lidar sees too.

    Returns
    -------
    Extrinsics

    Raises
    ------
    CalibrationError
        If there are too few stands, no place fits them, or they leave the place open; the message says what to do.
    """
    if len(stands) < LEAST_STANDS:
        raise CalibrationError(
            f"the board stood still before both camera and lidar {len(stands)} times, and {LEAST_STANDS} are the "
            "least; let it stand 15 times for some seconds, where the lidar's plane cuts it"
        )
    half = 0.5 * np.array(board.size) + margin
    boards = [stand.T_camera_board @ rigid(np.eye(3), board.middle) for stand in stands]
    points = [np.vstack(stand.scans) for stand in stands]
    points = [cloud[np.isfinite(cloud).all(axis=1)] for cloud in points]
    best: tuple[float, PlaneFit | None] = -math.inf, None
    for turn in _likely_turns(stands, boards, half):
        found = _follow(rigid(turn, np.zeros(3)), stands, boards, points, half)
        if found is None:
            continue
        score = float(sum(found.used)) - found.rms / _GATES[-1]
        if score > best[0]:
            best = score, found
        if sum(found.used) >= max(_MOST * len(stands), LEAST_STANDS + 2) and found.rms < _CERTAIN:
            break
    found = best[1]
    if found is None or sum(found.used) < LEAST_STANDS:
        raise CalibrationError(
            "no place of the camera makes the lidar's points lie on the boards; check --square and the lens, that the "
            "lidar's plane cuts the board, and that the board stood still"
        )
    return _told(stands, found)


def _likely_turns(stands: Sequence[Stand], boards: Sequence[Floats], half: Floats) -> list[Floats]:
    """Rotations from the lidar to the camera by which most boards have a straight piece of the scan in their plane."""
    turns = all_rotations(_GRID_DEG)
    reach = float(np.linalg.norm(half))
    score = np.zeros(len(turns))
    for stand, board in zip(stands, boards, strict=True):
        pieces = [piece for piece in straight_pieces(stand.scans[len(stand.scans) // 2]) if piece.length < 2.2 * reach]
        if not pieces:
            continue
        middle = np.array([[*piece.middle, 0.0] for piece in pieces])
        along = np.array([[*piece.direction, 0.0] for piece in pieces])
        normal, place = board[:3, 2], board[:3, 3]
        # The camera may be as far as _NEAR from the lidar: a piece is off the plane by no more, and turned little.
        at = np.einsum("rij,kj->rki", turns, middle) - place
        tilt = np.einsum("rij,kj,i->rk", turns, along, normal)
        off = np.abs(at @ normal) / _NEAR
        aside = np.maximum(np.linalg.norm(at, axis=-1) - reach, 0.0) / _NEAR
        fits = np.maximum(1.0 - np.maximum(off, aside), 0.0) * np.maximum(1.0 - np.abs(tilt) / 0.35, 0.0)
        score += np.sqrt(fits.max(axis=1))
    return [turns[i] for i in np.argsort(-score)[:_STARTS]]


def _follow(
    T_camera_lidar: Floats, stands: Sequence[Stand], boards: Sequence[Floats], points: Sequence[Floats], half: Floats
) -> PlaneFit | None:
    """Fit to the points near each board, with an ever closer gate."""
    found = None
    for gate in _GATES:
        for _ in range(3):
            chosen = [_on_board(T_camera_lidar, *pair, half, gate) for pair in zip(boards, points, strict=True)]
            if sum(len(cloud) >= _FEWEST for cloud in chosen) < LEAST_STANDS:
                return None
            found = fit_planes(
                T_camera_lidar,
                [stand.T_camera_board for stand in stands],
                [stand.covariance for stand in stands],
                [cloud if len(cloud) >= _FEWEST else cloud[:0] for cloud in chosen],
            )
            T_camera_lidar = found.T_camera_lidar
            if np.linalg.norm(T_camera_lidar[:3, 3]) > 2.0 * _NEAR:
                return None
    return found


def _on_board(T_camera_lidar: Floats, board: Floats, points: Floats, half: Floats, gate: float) -> Floats:
    """Points on a board, shape (n, 2), lidar frame: near its plane and within its edges."""
    T_board_lidar = inverse(board) @ T_camera_lidar
    local = points @ T_board_lidar[:3, :2].T + T_board_lidar[:3, 3]
    near = np.abs(local[:, 2]) < gate
    # While the place is poorly known, so is where the edges are.
    loose = max(gate - 0.06, -_EDGE) if gate > _GATES[-1] else -_EDGE
    near &= (np.abs(local[:, :2]) < half + loose).all(axis=1)
    return points[near]


def _told(stands: Sequence[Stand], found: PlaneFit) -> Extrinsics:
    T_lidar_camera = inverse(found.T_camera_lidar)
    # The fit's small move and turn are the lidar's, as the camera sees them; here they are the camera's.
    turn, place = T_lidar_camera[:3, :3], T_lidar_camera[:3, 3]
    x, y, z = place
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    change = np.zeros((6, 6))
    change[:3, :3], change[3:, 3:] = -turn, -turn
    change[:3, 3:] = cross @ turn
    covariance = change @ found.covariance @ change.T
    fitted = tuple(
        FittedStand(stand.name, count if used else 0, rms if used else math.nan)
        for stand, count, rms, used in zip(stands, found.counts, found.stand_rms, found.used, strict=True)
    )
    result = Extrinsics(T_lidar_camera, 0.5 * (covariance + covariance.T), found.rms, fitted, ())
    if result.sigma_position > _SURE_M or result.sigma_turn_deg > _SURE_DEG:
        raise CalibrationError(
            f"the stands leave the camera's place open ({result.sigma_position:.2f} m, {result.sigma_turn_deg:.1f} "
            "degrees): tilt the board forwards, backwards and to the sides by 20 to 45 degrees, each time differently"
        )
    return Extrinsics(T_lidar_camera, result.covariance, found.rms, fitted, _warnings(result))


def _warnings(result: Extrinsics) -> tuple[str, ...]:
    said = []
    used = [stand for stand in result.stands if stand.points]
    left_out = [stand.name for stand in result.stands if not stand.points]
    if len(used) < _MANY:
        said.append(f"only {len(used)} stands of the board were used: 15 or more are good")
    if left_out:
        said.append(f"left out, for no points of the lidar lie on the board there: {', '.join(left_out)}")
    if result.sigma_position > _GOOD_M or result.sigma_turn_deg > _GOOD_DEG:
        said.append(
            f"the place is known to {1000.0 * result.sigma_position:.0f} mm and {result.sigma_turn_deg:.1f} degrees "
            "only: more stands, the board tilted more and nearer, help"
        )
    if result.rms > 0.03:
        said.append(
            f"points are off the boards by {1000.0 * result.rms:.0f} mm: is the board flat, did it stand still?"
        )
    return tuple(said)
