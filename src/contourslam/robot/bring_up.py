"""All parts of the robot together: each in a thread of its own, what they say in one stream."""

import queue
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Literal, Protocol, Self

from contourslam.closing import Closing
from contourslam.errors import ContourslamError
from contourslam.recordings.picture import Picture
from contourslam.robot.base.states import BaseState
from contourslam.robot.config import RobotConfig
from contourslam.robot.device_errors import DeviceError
from contourslam.scan import LaserScan

PartName = Literal["lidar", "base", "camera", "recording"]
Stopped = Callable[[], bool]
_RETRY = 1.0  # s between two tries to open a part that failed
READY = 15.0  # s until each part must have said something: an X4 needs one to turn, a Mega up to three to start


class Lidar(Protocol):
    """:class:`contourslam.robot.lidar.ydlidar_x4.YdlidarX4`, or what stands for it."""

    def scans(self, stopped: Stopped) -> Iterator[LaserScan]:
        """Yield turns until told to stop."""

    def close(self) -> None:
        """Stop it and free its port."""


class Base(Protocol):
    """:class:`contourslam.robot.base.mega.MegaBase`, or what stands for it."""

    def states(self, stopped: Stopped) -> Iterator[BaseState]:
        """Yield what the base says of itself until told to stop."""

    def drive(self, v: float, omega: float) -> None:
        """Go ahead (m/s) and turn (rad/s); to be said again within 0.3 s."""

    def stop(self) -> None:
        """Switch the motors off."""

    def close(self) -> None:
        """Stop it and free its port."""


class Camera(Protocol):
    """:class:`contourslam.robot.camera.source.PictureSource`, or what stands for it."""

    def frames(self, stopped: Stopped) -> Iterator[Picture]:
        """Yield pictures until told to stop."""

    def close(self) -> None:
        """Free it."""


@dataclass(frozen=True, slots=True)
class Trouble:
    """A part has failed, or is there again.

    Attributes
    ----------
    stamp : float
        s.
    part : str
    message : str
        One line that says what to do; empty where the part is there again.
    """

    stamp: float
    part: PartName
    message: str


Event = LaserScan | BaseState | Picture | Trouble


@dataclass(frozen=True, slots=True)
class Openers:
    """How the parts are opened; None where the robot has no such part."""

    lidar: Callable[[], Lidar] | None = None
    base: Callable[[], Base] | None = None
    camera: Callable[[], Camera] | None = None


def openers(config: RobotConfig, *, patience: float = 30.0, rate: float = 2.0) -> Openers:
    """Give the ways to open the parts that a robot has.

    Parameters
    ----------
    config : RobotConfig
    patience : float
        How long a part that was unplugged is waited for before its trouble is told, s; it is waited for after that too.
    rate : float
        Pictures a second that are wanted of the camera.
    """

    def lidar() -> Lidar:
        from contourslam.robot.lidar.ydlidar_x4 import YdlidarX4

        return YdlidarX4(config.lidar.port, baud=config.lidar.baud, patience=patience)

    def base() -> Base:
        from contourslam.robot.base.mega import MegaBase

        return MegaBase(config=config.base, patience=patience)

    def camera() -> Camera:
        from contourslam.robot.camera.sources import open_source

        assert config.camera is not None
        model = config.camera.model
        return open_source(config.camera.source, width=model.width, height=model.height, rate=rate, patience=patience)

    return Openers(lidar, base, None if config.camera is None else camera)


class Robot(Closing):
    """The robot; a context manager. Its motors are stopped first when it is left, whatever the reason.

    A part that fails is told of and tried again, and the others go on.

    Parameters
    ----------
    parts : Openers
    clock : callable
        Host time for the stamps of troubles, s.

    Attributes
    ----------
    state : BaseState or None
        What the base said of itself last.
    lidar, base : Lidar or None, Base or None
        The part as it was opened last, for its counters.
    """

    def __init__(self, parts: Openers, *, clock: Callable[[], float] = time.time) -> None:
        self._clock = clock
        self._events: queue.SimpleQueue[Event | BaseException] = queue.SimpleQueue()
        self._ending = threading.Event()
        self._base: Base | None = None  # while it is open
        self.lidar: Lidar | None = None
        self.base: Base | None = None
        self.state: BaseState | None = None
        self._troubles: dict[PartName, str] = {}
        self._heard: set[PartName] = set()
        self._ended: set[PartName] = set()
        works: dict[PartName, Callable[[], None]] = {}
        if parts.lidar is not None:
            works["lidar"] = partial(self._lidar, parts.lidar)
        if parts.base is not None:
            works["base"] = partial(self._drive_base, parts.base)
        if parts.camera is not None:
            works["camera"] = partial(self._camera, parts.camera)
        self._threads = {
            name: threading.Thread(target=self._keep, args=(name, work), name=name, daemon=True)
            for name, work in works.items()
        }

    def __enter__(self) -> Self:
        for thread in self._threads.values():
            thread.start()
        return self

    def close(self) -> None:
        """Stop the motors, then everything else."""
        self.stop()
        self._ending.set()
        for thread in self._threads.values():
            if thread.is_alive():
                thread.join(5.0)

    @property
    def parts(self) -> tuple[PartName, ...]:
        """Names of the parts it has."""
        return tuple(self._threads)

    @property
    def troubles(self) -> dict[PartName, str]:
        """Parts that do not work now, with what is wrong."""
        return dict(self._troubles)

    @property
    def ended(self) -> frozenset[PartName]:
        """Parts that have said all they had to say, as a film in the place of a camera."""
        return frozenset(self._ended)

    def drive(self, v: float, omega: float) -> None:
        """Go ahead (m/s) and turn (rad/s); said again at least three times a second, or the base stops.

        A base that cannot be reached now is no error: its watchdog stops it.
        """
        base = self._base
        if base is not None and not self._ending.is_set():
            with suppress(DeviceError):
                base.drive(v, omega)

    def stop(self) -> None:
        """Switch the motors off, as far as the base can be reached."""
        base = self._base
        if base is not None:
            with suppress(DeviceError):
                base.stop()

    def wait_until_ready(self, stopped: Stopped = lambda: False, *, seconds: float = READY) -> list[Event]:
        """Wait until the lidar and the base have said something, so that a wrong port is no surprise on the way.

        Parameters
        ----------
        stopped : callable
            Asked some times a second; ends the waiting.
        seconds : float
            How long to wait.

        Returns
        -------
        list of Event
            What has come meanwhile.

        Raises
        ------
        DeviceError
            Of a part that failed meanwhile, or said nothing.
        """
        events: list[Event] = []
        needed, until = set(self._threads) - {"camera"}, time.monotonic() + seconds
        while not needed <= self._heard and not stopped():
            event = self.next(0.1)
            if event is not None:
                events.append(event)
            if isinstance(event, Trouble) and event.part in needed and event.message:
                raise DeviceError(event.message)
            if time.monotonic() > until:
                silent = " and ".join(sorted(needed - self._heard))
                raise DeviceError(f"the {silent} said nothing within {seconds:.0f} s; check power and cables")
        return events

    def next(self, timeout: float) -> Event | None:
        """Give what was said next; None where nothing is within the time (s)."""
        try:
            event = self._events.get(timeout=timeout)
        except queue.Empty:
            return None
        if isinstance(event, BaseException):
            raise event
        return event

    # Each part's thread.

    def _keep(self, name: PartName, work: Callable[[], None]) -> None:
        """Run a part until the end, again and again where it fails."""
        try:
            while not self._ending.is_set():
                try:
                    work()
                    if name == "camera":  # a film or a folder has come to its end; what is live goes on until the end
                        self._ended.add(name)
                        return
                except ContourslamError as error:
                    self._tell(name, str(error))
                self._ending.wait(_RETRY)
        except BaseException as error:  # nobody else hears of it in a thread
            self._events.put(error)

    def _tell(self, name: PartName, message: str) -> None:
        if self._troubles.get(name, "") == message:
            return
        if message:
            self._troubles[name] = message
        else:
            self._troubles.pop(name, None)
        self._events.put(Trouble(self._clock(), name, message))

    def _said(self, name: PartName, event: Event) -> None:
        self._tell(name, "")
        self._events.put(event)
        self._heard.add(name)

    def _lidar(self, opened: Callable[[], Lidar]) -> None:
        self.lidar = lidar = opened()
        try:
            for scan in lidar.scans(self._ending.is_set):
                self._said("lidar", scan)
        finally:
            lidar.close()

    def _drive_base(self, opened: Callable[[], Base]) -> None:
        self._base = self.base = base = opened()
        try:
            for state in base.states(self._ending.is_set):
                self.state = state
                self._said("base", state)
        finally:
            self._base = None
            base.close()

    def _camera(self, opened: Callable[[], Camera]) -> None:
        camera = opened()
        try:
            for picture in camera.frames(self._ending.is_set):
                self._said("camera", picture)
        finally:
            camera.close()
