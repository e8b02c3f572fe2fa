"""Pictures taken on a drive, among its other messages."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from contourslam.geometry.rigid import rigid
from contourslam.recordings.picture import Picture
from contourslam.scan import Odometry
from contourslam.simulation.camera import FisheyeCamera
from contourslam.simulation.drive import Drive, Progress
from contourslam.simulation.simulate import Message, SimulatedRun


def film(
    run: SimulatedRun, camera: FisheyeCamera, *, rate: float | None = None, progress: Progress | None = None
) -> Iterator[Message | Picture]:
    """All messages of a run with pictures in between; each comes right after the first odometry not older than it.

    The drive and all its other messages are as without a camera. A picture is taken as it is asked for, so that no
    more than one is held.

    Parameters
    ----------
    run : SimulatedRun
    camera : FisheyeCamera
        Of the same room.
    rate : float, optional
        Pictures per second of the drive; the camera's own where left out. The first is taken at 0 s.
    progress : callable, optional
        Called with the fraction done, 0 to 1.

    Yields
    ------
    LaserScan, Odometry, TruePose or Picture

    Raises
    ------
    ResultError, MissingExtraError
        As :meth:`~contourslam.simulation.camera.FisheyeCamera.picture`.
    """
    each = 1.0 / (rate or camera.camera.rate)
    taken, end = 0, float(run.drive.times[-1])
    for message in run.messages():
        yield message
        while isinstance(message, Odometry) and (stamp := round(taken * each, 9)) <= message.stamp:
            yield camera.picture(base_pose(run.drive, stamp, camera.robot.wheel_radius), stamp)
            taken += 1
            if progress is not None:
                progress(min(stamp / end, 1.0))


def base_pose(drive: Drive, stamp: float, wheel_radius: float) -> NDArray[np.float64]:
    """True pose of the base at a time (s) with its tilts: T_world_base, shape (4, 4), its origin on the floor."""
    at = stamp / (drive.times[1] - drive.times[0])
    step = min(int(at), len(drive.times) - 2)
    part = at - step
    # Two physics steps differ so little that the mean of their rotations is one, too.
    rotation = (1.0 - part) * drive.rotations[step] + part * drive.rotations[step + 1]
    axle = (1.0 - part) * drive.positions[step] + part * drive.positions[step + 1]
    return rigid(rotation, axle - wheel_radius * rotation[:, 2])
