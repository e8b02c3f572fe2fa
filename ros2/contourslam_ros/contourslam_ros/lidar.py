"""Node ``lidar``: the scans of a YDLidar X4."""

import sys
import threading
import time
from collections.abc import Callable, Sequence

from rclpy.qos import QoSProfile
from sensor_msgs.msg import LaserScan as ScanMessage
from std_srvs.srv import Trigger

from contourslam.live.diagnostics import Diagnostic, Level
from contourslam.robot.lidar.even_beams import even_beams
from contourslam.robot.lidar.figures import LidarTally
from contourslam.robot.lidar.ydlidar_x4 import YdlidarX4
from contourslam_ros.device_messages import place_message, scan_message
from contourslam_ros.device_node import DeviceNode
from contourslam_ros.part_settings import LidarConfig
from contourslam_ros.running import run
from contourslam_ros.settings import declare

LATE = 1.0  # s without a scan that are worth a word
FAILING = 0.02  # share of packets that fail their checksum, likewise


class Lidar(DeviceNode):
    """Publishes ``scan``; ``~/stop_motor`` lets the head rest and the port go until ``~/start_motor``.

    Raises
    ------
    ConfigError
        If a parameter or the robot's file is wrong.
    """

    def __init__(self) -> None:
        super().__init__("lidar", "lidar")
        self._config = declare(self, LidarConfig())
        self._part = self._config.load().lidar
        self._resting, self._at_rest = threading.Event(), threading.Event()
        self._lidar: YdlidarX4 | None = None
        self._tally, self._heard = LidarTally(), 0.0

    def start(self) -> None:
        """Publish, offer the services, and begin."""
        # Reliable, so that listeners of either kind hear it.
        self._scans = self.create_publisher(ScanMessage, "scan", QoSProfile(depth=10))
        self.create_service(Trigger, "~/start_motor", self._start_motor)
        self.create_service(Trigger, "~/stop_motor", self._stop_motor)
        super().start()
        if self._config.place_from_file:
            base, laser = self._config.named(self._config.base_frame), self._config.named(self._config.frame)
            self.place(place_message(base, laser, self._part.place))

    def work(self, stopped: Callable[[], bool]) -> None:
        """Publish a scan for each turn while they are wanted."""
        if self._resting.is_set():
            self._rest(stopped)
        frame, self._tally = self._config.named(self._config.frame), LidarTally()
        # No patience: the node itself opens the port again, and says meanwhile that it has gone.
        with YdlidarX4(
            self._config.port or self._part.port, baud=self._config.baud or self._part.baud, patience=0.0
        ) as lidar:
            self._lidar = lidar
            for scan in lidar.scans(lambda: stopped() or self._resting.is_set()):
                self._scans.publish(scan_message(even_beams(scan), frame))
                self._tally.add(scan)
                self._heard = time.monotonic()
                self.well()

    def _rest(self, stopped: Callable[[], bool]) -> None:
        self.trouble = ""
        self._at_rest.set()
        while self._resting.is_set() and not stopped():
            time.sleep(0.05)
        self._at_rest.clear()
        self.trouble = self.unanswered

    def diagnostics(self) -> Sequence[Diagnostic]:
        """Say how the scans come."""
        if self._resting.is_set():
            return (Diagnostic(Level.OK, "lidar", "at rest until ~/start_motor is called"),)
        if self._lidar is None:
            return (Diagnostic(Level.ERROR, "lidar", self.unanswered),)
        lidar, figures = self._lidar, self._tally.figures()
        values = {
            "port": lidar.name,
            "turns (1/s)": f"{figures.rate:.2f}",
            "beams": str(figures.beams),
            "returns (%)": f"{100.0 * figures.returns:.0f}",
            "noise (mm)": f"{1000.0 * figures.noise:.1f}",
            "packets": str(lidar.turns.parser.good),
            "failed packets": str(lidar.turns.parser.bad),
            "told again to scan": str(lidar.restarts),
        }
        silent = time.monotonic() - self._heard
        if silent > LATE:
            return (Diagnostic(Level.WARN, "lidar", f"no scan for {silent:.1f} s", values),)
        if lidar.turns.failing > FAILING:
            failing = f"{lidar.turns.failing:.0%} of the last packets fail their checksum; check the cable"
            return (Diagnostic(Level.WARN, "lidar", failing, values),)
        return (Diagnostic(Level.OK, "lidar", f"{figures.rate:.2f} turns/s of {figures.beams} beams", values),)

    def _stop_motor(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self._resting.set()
        response.success = self._at_rest.wait(3.0)
        response.message = "at rest" if response.success else "the lidar is to rest, but is still being asked something"
        return response

    def _start_motor(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self._resting.clear()
        response.success, response.message = True, "the motor is switched on as soon as the lidar answers"
        return response


def main() -> int:
    """Run the node until it is told to stop."""
    return run(Lidar)


if __name__ == "__main__":
    sys.exit(main())
