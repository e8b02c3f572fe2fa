"""What the nodes of the robot's parts have in common: a part has a thread of its own, and is tried again for ever."""

import threading
import time
from collections.abc import Callable, Sequence

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import TransformStamped
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from tf2_msgs.msg import TFMessage

from contourslam.live.diagnostics import Diagnostic, Level
from contourslam.robot.device_errors import DeviceError
from contourslam_ros.frames import STATIC
from contourslam_ros.messages import diagnostic_message, header

FIRST_PAUSE, LONGEST_PAUSE = 0.2, 2.0  # s between two tries of a part that does not answer
REPEATED = 30.0  # s after which an unchanged trouble is logged again


class DeviceNode(Node):
    """A node around one part of the robot; what is done with the part is said by :meth:`work`.

    A part that cannot be used (unplugged, silent, of another user) is told as a diagnostic and in the log, with what to
    try, and tried again until it can be; only what no waiting mends (a wrong setting, a library that is missing) ends
    the node.

    Parameters
    ----------
    name : str
        Of the node.
    part : str
        Of what it works, for people: "lidar".

    Attributes
    ----------
    failure : BaseException or None
        Why the node cannot go on.
    trouble : str
        Why the part cannot be used now, and what to do; empty where it can.
    unanswered : str
        What that is before anything is known.
    """

    def __init__(self, name: str, part: str) -> None:
        super().__init__(name)
        self.failure: BaseException | None = None
        self.trouble = self.unanswered = f"the {part} has not answered yet"
        self._called = part
        self._logged, self._logged_at, self._ill = "", 0.0, False
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._run, name=part, daemon=True)

    def work(self, stopped: Callable[[], bool]) -> None:
        """Open the part and use it until `stopped` says so; called again after each return and each DeviceError."""
        raise NotImplementedError

    def diagnostics(self) -> Sequence[Diagnostic]:
        """Say how the part is while it can be used."""
        raise NotImplementedError

    def warm_up(self) -> None:
        """Do nothing: drivers have nothing that has to be compiled."""

    def start(self) -> None:
        """Publish, and begin with the part."""
        self._diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self._still = self.create_publisher(TFMessage, "/tf_static", STATIC)
        self.create_timer(1.0, self._send_diagnostics, clock=Clock(clock_type=ClockType.STEADY_TIME))
        self._thread.start()

    def stop(self) -> None:
        """Let go of the part."""
        self._ending.set()
        if self._thread.is_alive():
            self._thread.join(10.0)

    def place(self, *transforms: TransformStamped) -> None:
        """Say where the part sits on the robot, for good."""
        self._still.publish(TFMessage(transforms=list(transforms)))

    def well(self) -> None:
        """Note that the part can be used; for the thread of :meth:`work`."""
        if self.trouble:
            self.get_logger().info(f"the {self._called} works")
            self.trouble = self._logged = ""

    def _run(self) -> None:
        pause = FIRST_PAUSE
        while not self._ending.is_set():
            try:
                self.work(self._ending.is_set)
                pause = FIRST_PAUSE
                continue
            except DeviceError as error:
                if not self.trouble:  # it worked until now
                    pause = FIRST_PAUSE
                # A driver that has no patience gives up for a reason, which says more.
                self._tell(str(error.__cause__ if isinstance(error.__cause__, DeviceError) else error))
            except Exception as error:  # the node's main thread ends with it
                self.failure = error
                return
            self._ending.wait(pause)
            pause = min(2.0 * pause, LONGEST_PAUSE)

    def _tell(self, trouble: str) -> None:
        now = time.monotonic()
        self.trouble = trouble
        if trouble != self._logged or now - self._logged_at > REPEATED:
            self._logged, self._logged_at = trouble, now
            self.get_logger().error(f"{trouble}; it is tried again")

    def _send_diagnostics(self) -> None:
        told = (Diagnostic(Level.ERROR, self._called, self.trouble),) if self.trouble else self.diagnostics()
        worst = max(told, key=lambda one: one.level)
        if worst.level > Level.OK and not (self._ill or self.trouble):  # once, for its figures change each second
            self.get_logger().warning(worst.message)
        self._ill = worst.level > Level.OK
        head = header(self.get_clock().now().to_msg(), "")
        self._diagnostics.publish(diagnostic_message(head, self.get_fully_qualified_name(), told))
