"""The fisheye camera of the live world: drawn in a process of its own, so that nothing else waits for the pictures."""

import contextlib
import multiprocessing
import os
import signal
from collections.abc import Callable, Iterator
from multiprocessing.connection import Connection

from contourslam.recordings.picture import Picture
from contourslam.robot.camera.source import PictureSource, never
from contourslam.robot.device_errors import DeviceError, DeviceUnpluggedError
from contourslam.simulation.camera import FisheyeCamera
from contourslam.simulation.config import CameraModel
from contourslam.simulation.room import Room

_READY = 180.0  # s; painting the walls takes some of them


class SimulatedCamera(PictureSource):
    """A source of pictures drawn where the world says that the robot is.

    Parameters
    ----------
    room : Room
    camera : CameraModel
    seed : int
        Of textures, noise and exposure.

    Attributes
    ----------
    poses : Connection
        Where the world sends stamps and poses.
    """

    def __init__(self, room: Room, camera: CameraModel, seed: int) -> None:
        super().__init__("simulated camera")
        context = multiprocessing.get_context("spawn")
        theirs, self.poses = context.Pipe(duplex=False)
        self._pictures, sent = context.Pipe(duplex=False)
        self._process = context.Process(
            target=_draw, args=(room, camera, seed, theirs, sent), name="camera", daemon=True
        )
        self._process.start()
        theirs.close()
        sent.close()

    def wait_until_ready(self) -> None:
        """Wait until walls are painted and graphics are open.

        Raises
        ------
        DeviceError
            If they cannot be.
        """
        if not self._pictures.poll(_READY):
            raise DeviceError(f"{self.name}: nothing was drawn within {_READY:.0f} s; is the machine very busy?")
        self._next()

    def frames(self, stopped: Callable[[], bool] = never) -> Iterator[Picture]:
        """See :meth:`PictureSource.frames`."""
        while not stopped():
            if self._pictures.poll(0.1):
                picture = self._next()
                if picture is not None:
                    yield picture

    def _next(self) -> Picture | None:
        """What the process says next: a picture, or None once it is ready."""
        try:
            said: Picture | str | None = self._pictures.recv()
        except (EOFError, OSError):
            raise DeviceUnpluggedError(f"{self.name}: its process has ended") from None
        if isinstance(said, str):
            raise DeviceError(f"{self.name}: {said}")
        return said

    def end(self) -> None:
        """End the process; the source is of no use afterwards."""
        self.poses.close()
        self._pictures.close()
        self._process.join(5.0)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()


def _draw(room: Room, camera: CameraModel, seed: int, poses: Connection, pictures: Connection) -> None:
    """What the process does: the newest pose is drawn, those before it are left out."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches all processes; the one that made this one ends it
    os.nice(10)  # the world and the robot's own computer have no time to lose
    with contextlib.suppress(EOFError, OSError):
        try:
            with FisheyeCamera(room, camera, seed=seed) as eye:
                eye.open()
                pictures.send(None)
                while True:
                    stamp, pose = poses.recv()
                    while poses.poll():
                        stamp, pose = poses.recv()
                    pictures.send(eye.picture(pose, stamp))
        except (EOFError, OSError):
            raise
        except Exception as error:
            pictures.send(f"{type(error).__name__}: {error}")
