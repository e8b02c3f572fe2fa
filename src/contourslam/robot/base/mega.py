"""Driver of the base: an Arduino Mega that turns two wheels, counts them, and reads an IMU."""

import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import suppress

from contourslam.closing import Closing
from contourslam.robot.base.commander import Commander
from contourslam.robot.base.link import BOOT, MegaLink
from contourslam.robot.base.messages import Ack, Hello, HelloReply, State
from contourslam.robot.base.odometry import BaseOdometry
from contourslam.robot.base.states import BaseState, StateReader
from contourslam.robot.config import BaseConfig
from contourslam.robot.device_errors import (
    DeviceError,
    DeviceNotFoundError,
    DevicePermissionError,
    DevicePowerError,
    DeviceSilentError,
    DeviceUnpluggedError,
)

_QUIET = 0.2  # s without a byte after which nothing is sent: a boot loader that hears bytes waits for a program
_NOISY = 3.0  # s of bytes without one sound frame
_ASK = 1.0  # s between two questions for what a greeting left out
_KEPT = 500  # states that wait for a reader
_MOST_RESETS, _RESET_SPAN = 3, 60.0  # more than so many in so many seconds is a supply that does not hold


class MegaBase(Closing):
    """The base on a serial port; a context manager that stops the robot at the end, also at an error or Ctrl-C.

    A thread of its own reads the base and sends it the wanted twist 50 times a second, as long as the caller wants it
    anew at least every 0.35 s. A port that goes away, or a base that falls silent, is opened again, at first after
    0.1 s, then after ever longer up to 2 s; meanwhile :meth:`drive` does nothing.

    Parameters
    ----------
    port : str, optional
        Such as ``/dev/ttyACM0``; by default the configuration's, else the only one that could be it.
    config : BaseConfig, optional
    patience : float
        How long a port that has gone, or a base that has fallen silent, is waited for, s; 0 gives up at once.
    clock : callable
        Host time, s.

    Attributes
    ----------
    config : BaseConfig
    info : HelloReply
        What the base says of itself.
    reconnections : int
        How often the port was opened anew.
    watchdog_stops : int
        How often the base stopped by itself, as no command came through.
    stalls : int
        How often it did, as a motor at full power turned nothing, or its encoder is dead. :meth:`stop`, or driving with
        zeros, lets it drive again.
    dropped : int
        States that nobody took in time.

    Raises
    ------
    DeviceError
        One of its kinds, when the base cannot be reached.
    MissingExtraError
        If pyserial is not installed.
    """

    def __init__(
        self,
        port: str | None = None,
        config: BaseConfig | None = None,
        *,
        patience: float = 30.0,
        clock: Callable[[], float] = time.time,
    ) -> None:
        self.config = config or BaseConfig()
        self._patience, self._clock = patience, clock
        self._link = MegaLink(port or self.config.port)
        self._reader = StateReader(self.config)
        self._commander = Commander(self._link, self.config)
        self.reconnections = self.watchdog_stops = self.stalls = self.dropped = 0
        self._changed = threading.Condition()
        self._states: deque[BaseState] = deque(maxlen=_KEPT)
        self._count = 0
        self._error: Exception | None = None
        self._resets: deque[float] = deque(maxlen=_MOST_RESETS + 1)
        self._closing, self._asked = False, 0.0
        self.info: HelloReply = self._link.open()
        self._thread = threading.Thread(target=self._run, name="base", daemon=True)
        self._thread.start()

    @property
    def name(self) -> str:
        """Name of the port."""
        return self._link.name

    @property
    def frames(self) -> int:
        """Sound frames until now."""
        return self._link.decoder.good

    @property
    def lost(self) -> int:
        """Frames that are missing by their sequence; no way is lost with them, as ticks are absolute."""
        return self._link.decoder.lost

    @property
    def refused(self) -> int:
        """Frames that came damaged; they are among the lost ones."""
        return sum(self._link.decoder.refused.values())

    @property
    def resets(self) -> int:
        """How often the board began anew."""
        return self._reader.resets

    @property
    def gyro_bias(self) -> tuple[float, float]:
        """Bias of the gyroscope about the upright axis, and its standard deviation, rad/s."""
        return self._reader.odometer.bias, self._reader.odometer.bias_sigma

    @property
    def state(self) -> BaseState | None:
        """The newest state; None before the first."""
        with self._changed:
            return self._states[-1] if self._states else None

    @property
    def odometry(self) -> BaseOdometry | None:
        """Where the base is by its wheels and its gyroscope; None before the first state."""
        state = self.state
        return None if state is None else state.odometry

    def drive(self, v: float, omega: float) -> None:
        """Drive so for the next 0.35 s at most; to be called again before they are over.

        Speeds are kept within the limits of the configuration, with the radius of the curve as it is wanted, and are
        reached as fast as its accelerations allow.

        Parameters
        ----------
        v : float
            Ahead, m/s.
        omega : float
            To the left, rad/s.

        Raises
        ------
        ConfigError
            If a value is not finite.
        DeviceError
            If the base is gone for good.
        """
        if self._error is not None:
            raise self._error
        self._commander.drive(v, omega)

    def stop(self) -> None:
        """Switch the motors off at once; told again until the base has heard it. No error where there is no base."""
        with suppress(DeviceError):
            self._commander.stop()

    def states(self, stopped: Callable[[], bool] = lambda: False) -> Iterator[BaseState]:
        """Yield every state from now on; several may do so at once.

        Parameters
        ----------
        stopped : callable
            Asked some times a second; the states end when it says so, or when the base is closed.

        Raises
        ------
        DeviceError
            One of its kinds: silent, noisy, power, unplugged.
        """
        with self._changed:
            seen = self._count
        while not stopped():
            with self._changed:
                if self._count == seen and self._error is None and not self._closing:
                    self._changed.wait(0.1)
                missed = max(self._count - seen - len(self._states), 0)
                self.dropped += missed
                new = list(self._states)[len(self._states) - (self._count - seen - missed) :]
                seen, error = self._count, self._error
            for state in new:
                if stopped():
                    return
                yield state
            if error is not None:
                raise error
            if self._closing:
                return

    def close(self) -> None:
        """Stop the robot and free the port; no error, for a port that has gone is closed too."""
        if not self._closing:
            self.stop()
            until = time.monotonic() + 0.3
            while self._commander.unheard and self._thread.is_alive() and time.monotonic() < until:
                time.sleep(0.01)
        with self._changed:
            self._closing = True
            self._changed.notify_all()
        self._thread.join(5.0)
        self._link.close()

    def _run(self) -> None:
        """Read and write until closed; an error is kept for who asks next."""
        heard = sound = time.monotonic()
        try:
            while not self._closing:
                try:
                    data = self._link.read()
                    read, now = self._clock(), time.monotonic()
                    heard = now if data else heard
                    sound = now if self._take(data, read) else sound
                    if now - heard > BOOT:
                        raise self._link.silent(now - heard)
                    if now - sound > BOOT + _NOISY:
                        raise self._link.noisy(now - sound)
                    if now - heard < _QUIET:
                        self._commander.go_on(now)
                except (DeviceUnpluggedError, DeviceSilentError) as error:
                    self._reconnect(error)
                    heard = sound = time.monotonic()
        except Exception as error:  # a bug among them: it must reach who drives, not end in this thread
            with self._changed:
                self._error = error
                self._changed.notify_all()

    def _take(self, data: bytes, read: float) -> bool:
        """Take in what came; whether there was anything sound in it."""
        frames = self._link.take(data)
        received = self._link.decoder.received
        for frame in frames:
            message = frame.message
            if isinstance(message, State):
                self._told(message, read, received - frame.begin)
            elif isinstance(message, Ack):
                self._commander.heard(message)
            elif isinstance(message, HelloReply):
                self.info = message
                self._reader.greeted()
        return bool(frames)

    def _told(self, message: State, read: float, behind: int) -> None:
        resets = self._reader.resets
        state = self._reader.take(message, read, behind)
        if state is None:
            return
        if self._reader.resets > resets:
            self._commander.halted()
            self._count_reset()
        if state.gyro is not None and not self.info.imu_kind and time.monotonic() - self._asked > _ASK:
            self._asked = time.monotonic()  # it greeted before it had found its IMU
            self._link.send(Hello())
        with self._changed:
            before = self._states[-1] if self._states else None
            self.watchdog_stops += state.watchdog and before is not None and not before.watchdog
            self.stalls += state.stalled and before is not None and not before.stalled
            self._states.append(state)
            self._count += 1
            self._changed.notify_all()

    def _count_reset(self) -> None:
        now = time.monotonic()
        while self._resets and now - self._resets[0] > _RESET_SPAN:
            self._resets.popleft()
        self._resets.append(now)
        if len(self._resets) > _MOST_RESETS:
            raise DevicePowerError(
                f"{self.name}: the base began anew {len(self._resets)} times within a minute; its supply dips: charge "
                "the battery, and feed the Mega apart from the motors"
            )

    def _reconnect(self, gone: DeviceError) -> None:
        """Open the port again once it is back."""
        self._link.close()
        self._commander.halted()
        pause, until = 0.1, time.monotonic() + self._patience
        last: DeviceError = gone
        while not self._closing:
            if time.monotonic() + pause > until:
                if not isinstance(last, DeviceUnpluggedError | DeviceNotFoundError | DevicePermissionError):
                    raise last
                raise DeviceUnpluggedError(
                    f"{self.name}: the base was unplugged and has not come back within {self._patience:.0f} s; plug it "
                    f"in and start again (last: {last})"
                ) from last
            wake = time.monotonic() + pause
            while time.monotonic() < wake and not self._closing:
                time.sleep(0.02)
            try:
                self.info = self._link.open(lambda: self._closing)
                self._reader.reopened()
                self.reconnections += 1
                return
            except DeviceError as error:
                last = error
            pause = min(2.0 * pause, 2.0)
