"""Node ``base``: an Arduino Mega with two wheels, an IMU and a battery; drives by ``cmd_vel``."""

import math
import sys
import time
from collections.abc import Callable, Sequence

from geometry_msgs.msg import Twist, TwistStamped
from nav_msgs.msg import Odometry as OdometryMessage
from rclpy.clock import Clock, ClockType
from rclpy.publisher import Publisher
from sensor_msgs.msg import BatteryState, Imu, JointState, MagneticField
from tf2_msgs.msg import TFMessage

from contourslam.errors import ConfigError
from contourslam.live.diagnostics import Diagnostic, Level
from contourslam.recordings.ros_messages import stamp_of
from contourslam.robot.base.health import BaseHealth, base_values, motion_words
from contourslam.robot.base.mega import MegaBase
from contourslam.robot.base.states import BaseState
from contourslam.robot.device_errors import DeviceError
from contourslam_ros.device_messages import (
    battery_message,
    field_message,
    imu_message,
    odometry_message,
    wheels_message,
)
from contourslam_ros.device_node import DeviceNode
from contourslam_ros.frames import SENT
from contourslam_ros.messages import transform_message
from contourslam_ros.part_settings import BaseNodeConfig
from contourslam_ros.running import run
from contourslam_ros.settings import declare

AGAIN = 0.05  # s between two of the driver's being told the same; it holds a command for 0.35 s
AVERAGED = 0.02  # s over which the base averages gyroscope and accelerometer
ACCELERATION_SIGMA = 0.02  # m/s², of that average: 0.003 m/s² per root Hz by an MPU-9250's data sheet
COMPASS_SIGMA = 1e-6  # T


class Base(DeviceNode):
    """Obeys ``cmd_vel``; publishes ``odom``, its transform, ``joint_states``, ``imu`` and ``battery_state``.

    Raises
    ------
    ConfigError
        If a parameter or the robot's file is wrong.
    """

    def __init__(self) -> None:
        super().__init__("base", "base")
        self._config = declare(self, BaseNodeConfig())
        self._part = self._config.load().base
        self._odom, self._frame = (
            self._config.named(name) for name in (self._config.odom_frame, self._config.base_frame)
        )
        self._base: MegaBase | None = None
        self._health = BaseHealth()
        self._heard = self._battery_told = 0.0
        self._wanted: tuple[float, float] | None = None
        self._until = 0.0

    def start(self) -> None:
        """Publish, subscribe, and begin."""
        self._odometry = self.create_publisher(OdometryMessage, "odom", 50)
        self._transforms = self.create_publisher(TFMessage, "/tf", SENT)
        self._wheels = self.create_publisher(JointState, "joint_states", 50)
        self._imu = self.create_publisher(Imu, "imu/data", 50)
        self._compass = self.create_publisher(MagneticField, "imu/mag", 50)
        self._battery = self.create_publisher(BatteryState, "battery_state", 10)
        super().start()
        kind, take = (TwistStamped, self._take_stamped) if self._config.stamped_cmd_vel else (Twist, self._take)
        self.create_subscription(kind, "cmd_vel", take, 1)
        self.create_timer(AGAIN, self._say_again, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def work(self, stopped: Callable[[], bool]) -> None:
        """Publish what the base says."""
        # For ever: the driver opens a port that has gone again by itself, and its odometry goes on from where it was.
        with MegaBase(self._config.port or self._part.port, self._part, patience=math.inf) as base:
            self._base = base
            try:
                for state in base.states(stopped):
                    self._heard = time.monotonic()
                    self._health.take(state)
                    self.well()
                    self._publish(state)
            finally:
                self._base = None

    def _publish(self, state: BaseState) -> None:
        message = odometry_message(state.odometry, self._odom, self._frame)
        self._odometry.publish(message)
        if self._config.publish_tf:
            moved = transform_message(message.header, self._frame, state.odometry.pose)
            self._transforms.publish(TFMessage(transforms=[moved]))
        if _is_heard(self._wheels):
            self._wheels.publish(wheels_message(state.wheels()))
        inertial = state.inertial()
        if inertial is not None and _is_heard(self._imu):
            gyro_sigma = self._part.gyro_sigma / math.sqrt(AVERAGED)
            self._imu.publish(imu_message(inertial, self._frame, gyro_sigma, ACCELERATION_SIGMA))
        if state.compass is not None and _is_heard(self._compass):
            self._compass.publish(field_message(state.stamp, state.compass, self._frame, COMPASS_SIGMA))
        if state.battery is not None and self._heard - self._battery_told > 1.0:
            self._battery_told = self._heard
            self._battery.publish(battery_message(state.stamp, state.battery))

    def _take_stamped(self, message: TwistStamped) -> None:
        age = self.get_clock().now().nanoseconds * 1e-9 - stamp_of(message.header)
        if abs(age) > self._config.cmd_vel_timeout:
            why = f"cmd_vel is not obeyed: its stamp is {age:.2f} s old; are the clocks of the two computers set alike?"
            self.get_logger().warning(why, throttle_duration_sec=5.0)
            return
        self._take(message.twist)

    def _take(self, message: Twist) -> None:
        self._wanted = message.linear.x, message.angular.z
        self._until = time.monotonic() + self._config.cmd_vel_timeout
        self._say_again()

    def _say_again(self) -> None:
        """Tell the driver what is wanted, as long as it is."""
        base, wanted = self._base, self._wanted
        if base is None or wanted is None:
            return
        try:
            if time.monotonic() < self._until:
                base.drive(*wanted)
                return
            base.stop()
        except ConfigError as error:
            base.stop()
            self.get_logger().warning(f"cmd_vel is not obeyed: {error}", throttle_duration_sec=5.0)
        except DeviceError:
            pass  # it is told by the thread that reads the base
        self._wanted = None

    def diagnostics(self) -> Sequence[Diagnostic]:
        """Say how the base is."""
        base, state = self._base, self._health.state
        if base is None or state is None:
            return (Diagnostic(Level.ERROR, "base", self.unanswered),)
        values = base_values(base, state)
        if warnings := self._health.warnings(time.monotonic() - self._heard):
            return (Diagnostic(Level.WARN, "base", "; ".join(warnings), values),)
        return (Diagnostic(Level.OK, "base", motion_words(state), values),)


def _is_heard(publisher: Publisher) -> bool:
    return bool(publisher.get_subscription_count())


def main() -> int:
    """Run the node until it is told to stop."""
    return run(Base)


if __name__ == "__main__":
    sys.exit(main())
