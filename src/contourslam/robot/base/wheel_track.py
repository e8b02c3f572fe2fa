"""How far the wheels turned during a drive: from their own readings, or from odometry that was made of them."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from contourslam.errors import RecordingError
from contourslam.geometry.poses import between
from contourslam.recordings.recording import Recording
from contourslam.robot.config import BaseConfig
from contourslam.scan import Odometry

Floats = NDArray[np.float64]

_JUMP = 1.0  # m, or rad of the base's heading, between two readings: the driver was started again


@dataclass(frozen=True, slots=True)
class WheelTrack:
    """Angles of the wheels.

    Attributes
    ----------
    stamps : ndarray, shape (n,)
        Rising, s.
    angles : ndarray, shape (n, 2)
        Left and right, ahead is up, rad.
    source : str
        Topic or kind of message they are from.
    """

    stamps: Floats
    angles: Floats
    source: str

    def at(self, times: Floats) -> Floats:
        """Angles at any times (s), shape (m, 2); before the first reading and after the last they stand still."""
        return np.column_stack([np.interp(times, self.stamps, column) for column in self.angles.T])


def read_track(recording: Recording, base: BaseConfig) -> WheelTrack:
    """Read the wheels' angles of a recording; where it has none, undo its odometry.

    Parameters
    ----------
    recording : Recording
    base : BaseConfig
        With which its odometry was made; the angles themselves do not depend on it.

    Raises
    ------
    RecordingError
        If it holds neither, or is damaged.
    """
    readings = list(recording.wheel_readings())
    if len(readings) > 1:
        stamps = np.array([reading.stamp for reading in readings])
        track = _rising(stamps, np.array([reading.angles for reading in readings]), "the wheels' angles")
        return replace(track, angles=_joined(track.angles, base))
    odometry = [message for message in recording.messages() if isinstance(message, Odometry)]
    if len(odometry) < 2:
        raise RecordingError(
            f"{recording.path}: holds neither wheel angles (sensor_msgs/JointState) nor odometry; record the base, too"
        )
    return track_from_odometry(np.array([o.stamp for o in odometry]), np.array([o.pose for o in odometry]), base)


def track_from_odometry(stamps: Floats, poses: Floats, base: BaseConfig) -> WheelTrack:
    """Undo odometry: the angles that its poses were made of.

    Parameters
    ----------
    stamps : ndarray, shape (n,)
        s.
    poses : ndarray, shape (n, 3)
        Of wheel odometry alone: m, m, rad.
    base : BaseConfig
        With which it was made.
    """
    steps = between(poses[:-1], poses[1:])
    turn = steps[:, 2]
    # Readings are near enough that the arc is as long as its chord over sinc; backwards is where the chord points back.
    chord = np.hypot(steps[:, 0], steps[:, 1])
    ahead = steps[:, 0] * np.cos(0.5 * turn) + steps[:, 1] * np.sin(0.5 * turn)
    way = np.sign(ahead) * chord / np.sinc(turn / (2.0 * np.pi))
    jumped = (np.abs(way) > _JUMP) | (np.abs(turn) > _JUMP)
    half = np.where(jumped, 0.0, 0.5 * turn * base.wheel_base)
    way = np.where(jumped, 0.0, way)
    angles = np.column_stack([(way - half) / base.left_radius, (way + half) / base.right_radius])
    return _rising(stamps, np.concatenate([np.zeros((1, 2)), np.cumsum(angles, axis=0)]), "the odometry")


def _joined(angles: Floats, base: BaseConfig) -> Floats:
    """Angles without the jumps that a driver makes that was started again: the wheels stood still meanwhile."""
    steps = np.diff(angles, axis=0)
    jumped = (np.abs(steps * [base.left_radius, base.right_radius]) > _JUMP).any(axis=1, keepdims=True)
    return np.concatenate([angles[:1], angles[:1] + np.cumsum(np.where(jumped, 0.0, steps), axis=0)])


def _rising(stamps: Floats, angles: Floats, source: str) -> WheelTrack:
    order = np.argsort(stamps, kind="stable")
    stamps, angles = stamps[order], angles[order]
    kept = np.concatenate([[True], np.diff(stamps) > 0.0])
    return WheelTrack(stamps[kept], angles[kept], source)
