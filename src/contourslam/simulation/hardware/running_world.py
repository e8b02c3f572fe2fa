"""The live world in a process of its own, so that nothing that the robot's computer does holds it up."""

import contextlib
import multiprocessing
import os
import signal
from collections.abc import Callable
from contextlib import AbstractContextManager
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from contourslam.closing import Closing
from contourslam.errors import ContourslamError
from contourslam.simulation.hardware.line import Damage
from contourslam.simulation.hardware.live_world import Board, LiveWorld, Record, WorldConfig

MakeBoard = Callable[[], AbstractContextManager[Board]]
Pose = tuple[float, float, float]
_READY, _DONE = 60.0, 20.0  # s until the world stands, and until it has told what happened
_BEFORE_OTHERS = -10
_LISTEN = 10  # steps between two looks for orders


class RunningWorld(Closing):
    """A world that runs from its making to :meth:`finish`; a context manager.

    Parameters
    ----------
    config : WorldConfig
    make_board : callable
        Makes the board, in the world's process; it must be one that can be sent there.
    folder : Path
        Where the links ``lidar`` and ``base`` to the ports are made.
    poses : Connection, optional
        Where a stamp and the true pose are sent every `period`, for a camera.
    period : float
        s.

    Raises
    ------
    ContourslamError
        If it does not come to stand, with the reason.
    """

    def __init__(
        self,
        config: WorldConfig,
        make_board: MakeBoard,
        folder: Path,
        *,
        poses: Connection | None = None,
        period: float = 1.0,
    ) -> None:
        self.lidar_port, self.base_port = folder / "lidar", folder / "base"
        context = multiprocessing.get_context("spawn")  # a fork would copy locks that other threads hold
        self._mine, theirs = context.Pipe()
        self._process = context.Process(
            target=_live, args=(config, make_board, folder, theirs, poses, period), name="world", daemon=True
        )
        self._process.start()
        theirs.close()
        self._record: Record | None = None
        self.start: Pose = self._answer(_READY)
        """True pose at the start: x (m), y (m), heading (rad)."""

    def unplug_lidar(self, seconds: float) -> None:
        """Pull the lidar's cable, and plug it in again so much later."""
        self._order("unplug", seconds)

    def damage(self, damage: Damage) -> None:
        """Damage bytes on both lines, both ways, from now on."""
        self._order("damage", damage)

    def finish(self) -> Record:
        """End it and tell what really happened."""
        if self._record is None:
            with contextlib.suppress(OSError):  # it has ended; its answer says why
                self._mine.send(("finish", None))
            self._record = self._answer(_DONE)
        return self._record

    def close(self) -> None:
        """End it."""
        self._mine.close()  # at which it ends by itself
        self._process.join(5.0)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()

    def _order(self, order: str, value: Any) -> None:
        try:
            self._mine.send((order, value))
        except OSError:  # it has ended; its answer says why
            self._answer(_DONE)

    def _answer(self, seconds: float) -> Any:
        try:
            if self._mine.poll(seconds):
                kind, content = self._mine.recv()
                if kind == "done":
                    return content
                raise ContourslamError(f"the simulated robot failed: {content}")
            reason = f"it did not answer within {seconds:.0f} s"
        except (EOFError, OSError):
            self._process.join(1.0)
            reason = f"its process ended with code {self._process.exitcode}"
        self.close()
        raise ContourslamError(f"the simulated robot failed: {reason}")


def _live(
    config: WorldConfig,
    make_board: MakeBoard,
    folder: Path,
    orders: Connection,
    poses: Connection | None,
    period: float,
) -> None:
    """What the process does."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches all processes; the one that made this one ends it
    with contextlib.suppress(OSError):  # without the rights to it, it runs like any other
        os.nice(_BEFORE_OTHERS)  # physics waits for nobody
    try:
        with make_board() as board:
            world = LiveWorld(config, board, folder)
            orders.send(("done", world.body.now.pose))
            _Conductor(world, orders, poses, period).run()
    except Exception as error:
        orders.send(("failed", f"{type(error).__name__}: {error}"))
        if not isinstance(error, ContourslamError):
            raise


class _Conductor:
    """Runs a world, listens for orders, and tells the camera where it is."""

    def __init__(self, world: LiveWorld, orders: Connection, poses: Connection | None, period: float) -> None:
        self._world, self._orders, self._poses, self._period = world, orders, poses, period
        self._steps, self._plug_at, self._picture_at, self._ended = 0, float("inf"), 0.5, False

    def run(self) -> None:
        self._world.run(lambda: self._ended, self._look)

    def _look(self, now: float) -> None:
        self._steps += 1
        if self._steps % _LISTEN:
            return
        if now >= self._plug_at:
            self._world.plug_lidar()
            self._plug_at = float("inf")
        if self._poses is not None and now >= self._picture_at:
            self._picture_at += self._period
            self._tell_pose(now)
        try:
            while self._orders.poll():
                order, value = self._orders.recv()
                self._obey(order, value, now)
        except (EOFError, OSError):  # nobody is there any more
            self._ended = True

    def _tell_pose(self, now: float) -> None:
        try:
            if self._poses is not None:
                self._poses.send((self._world.began + now, self._world.body.now.pose))
        except OSError:  # the camera has gone
            self._poses = None

    def _obey(self, order: str, value: Any, now: float) -> None:
        if order == "unplug":
            self._world.unplug_lidar()
            self._plug_at = now + value
        elif order == "damage":
            self._world.damage(value)
        else:
            self._orders.send(("done", self._world.record()))
            self._ended = True
