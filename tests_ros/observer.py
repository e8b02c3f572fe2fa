"""Listens to a node in a thread of its own."""

import threading
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import rclpy
from contourslam_msgs.msg import LandmarkMap
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseWithCovarianceStamped, TransformStamped
from nav_msgs.msg import OccupancyGrid
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray

from contourslam.geometry.poses import between
from contourslam.recordings.ros_messages import POSE_COVARIANCE, odometry_from
from contourslam.simulation.simulate import SimulatedRun

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Observer:
    """What was heard so far.

    Attributes
    ----------
    poses : list of (float, float, ndarray, ndarray)
        When each came (monotonic), its stamp, pose (3,) and covariance (6, 6).
    transforms : list of TransformStamped
    told : list of (float, DiagnosticStatus)
        When it came, and what.
    """

    def __init__(self, namespace: str, name: str, common: "Observer | None" = None) -> None:
        self.node = rclpy.create_node(name, namespace=namespace)
        self.poses: list[tuple[float, float, np.ndarray, np.ndarray]] = []
        # Of all robots, and many: one node is enough to listen to them.
        self.transforms: list[TransformStamped] = [] if common is None else common.transforms
        self.told: list[tuple[float, DiagnosticStatus]] = []
        self.landmarks: LandmarkMap | None = None
        self.markers: MarkerArray | None = None
        self.grid: OccupancyGrid | None = None
        self.frames: set[str] = set()
        listen = self.node.create_subscription
        listen(PoseWithCovarianceStamped, "pose", self._on_pose, 1000)
        listen(LandmarkMap, "landmarks", lambda message: setattr(self, "landmarks", message), LATCHED)
        listen(MarkerArray, "markers", lambda message: setattr(self, "markers", message), LATCHED)
        listen(OccupancyGrid, "map", lambda message: setattr(self, "grid", message), LATCHED)
        if common is None:
            listen(TFMessage, "/tf", lambda message: self.transforms.extend(message.transforms), 1000)
        listen(DiagnosticArray, "/diagnostics", self._on_told, 100)  # last: see knows_its_node
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self.node)
        self._ended = False
        self._thread = threading.Thread(target=self._spin, daemon=True)
        self._thread.start()

    def _spin(self) -> None:
        while not self._ended:
            self._executor.spin_once(timeout_sec=0.2)

    def close(self) -> None:
        self._ended = True
        self._thread.join(5.0)
        self._executor.shutdown()
        self.node.destroy_node()

    def _on_pose(self, message: PoseWithCovarianceStamped) -> None:
        seen = odometry_from(message, POSE_COVARIANCE)
        self.frames.add(message.header.frame_id)
        self.poses.append((time.monotonic(), seen.stamp, seen.pose, np.array(message.pose.covariance).reshape(6, 6)))

    def _on_told(self, message: DiagnosticArray) -> None:
        self.told += [(time.monotonic(), status) for status in message.status]

    def trajectory(self) -> tuple[np.ndarray, np.ndarray]:
        """Stamps (t,) and poses (t, 3)."""
        rows = list(self.poses)
        return np.array([stamp for _, stamp, _, _ in rows]), np.array([pose for _, _, pose, _ in rows])

    def latest(self, name: str) -> DiagnosticStatus | None:
        """The last diagnostic whose name ends so."""
        return next((status for _, status in reversed(self._mine()) if status.name.endswith(name)), None)

    def _mine(self) -> list[tuple[float, DiagnosticStatus]]:
        within = self.node.get_namespace().rstrip("/") + "/"
        return [(when, status) for when, status in list(self.told) if status.name.startswith(within)]

    def knows_its_node(self, seconds: float = 300.0) -> bool:
        """Wait until all that the node publishes will be heard.

        A node sends only to those whom it has found. What was made last is found last, on both sides, and a node makes
        its diagnostics after its poses: where those are heard, so are these.
        """
        return wait_for(lambda: bool(self._mine()), seconds)

    def took_in(self, scans: float, unplaced: int = 0) -> int:
        """Wait for so many scans, and a pose of each but a few; give how many the node says that it took in."""
        wait_for(lambda: self._received() >= scans and len(self.poses) >= scans - unplaced, 10.0)
        return self._received()

    def _received(self) -> int:
        return int(figures(self.latest("scans")).get("received", 0))

    def said(self, *words: str, since: float = 0.0) -> bool:
        """Whether a diagnostic that is no OK holds all words."""
        texts = [s.message for when, s in self._mine() if when >= since and s.level != DiagnosticStatus.OK]
        return any(all(word in text for word in words) for text in texts)

    def faults(self) -> list[str]:
        """All that was ever found wrong, once each."""
        return sorted({f"{s.name}: {s.message}" for _, s in self._mine() if s.level != DiagnosticStatus.OK})

    def call(self, kind: Any, name: str, **fields: object) -> Any:
        """Call a service of the node."""
        client = self.node.create_client(kind, name)
        assert client.wait_for_service(10.0), f"no service {name}"
        future = client.call_async(kind.Request(**fields))
        assert wait_for(future.done, 20.0), f"{name} does not answer"
        return future.result()


def wait_for(condition: Callable[[], bool], seconds: float) -> bool:
    """Wait until something holds; whether it did in time."""
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            return False
        time.sleep(0.02)
    return True


def figures(status: DiagnosticStatus | None) -> dict[str, str]:
    """What a diagnostic says besides its message."""
    return {} if status is None else {value.key: value.value for value in status.values}


def error_of(drive: SimulatedRun, stamps: np.ndarray, poses: np.ndarray) -> np.ndarray:
    """How far off each pose is, m, in a map that begins where the drive has its first scan."""
    truth = between(drive.truth(np.array([drive.scans[0].stamp]))[0], drive.truth(stamps))
    return np.hypot(*(poses - truth)[:, :2].T)
