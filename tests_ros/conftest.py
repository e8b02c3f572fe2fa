"""A ROS graph of the tests' own, a simulated drive, and the processes that a test starts."""

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parent / "ros2" / "contourslam_ros")]
# Before rclpy is loaded, and for the processes: nobody else's nodes are heard. Ids up to 101 are safe on every system.
os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
os.environ["ROS_DOMAIN_ID"] = str(40 + os.getpid() % 60)
os.environ["PYTHONPATH"] = os.pathsep.join(sys.path[:2])

from observer import Observer  # noqa: E402  # the path and the environment come first
from player import Plan  # noqa: E402

from contourslam.scan import LaserScan, Odometry  # noqa: E402
from contourslam.simulation.simulate import SimulatedRun  # noqa: E402

SECONDS = 36.0


@pytest.fixture(scope="session")
def ros() -> Iterator[None]:
    import rclpy

    rclpy.init()
    yield
    rclpy.shutdown()


@pytest.fixture(scope="session")
def drive() -> SimulatedRun:
    """A drive through the furnished room."""
    from contourslam.simulation.config import SimulationConfig
    from contourslam.simulation.rooms import ROOMS
    from contourslam.simulation.simulate import simulate

    return simulate(ROOMS["furnished_room"], SimulationConfig(duration=SECONDS), seed=1)


@pytest.fixture(scope="session")
def recording(drive: SimulatedRun, tmp_path_factory: pytest.TempPathFactory) -> Path:
    from contourslam.recordings import write_recording

    path = tmp_path_factory.mktemp("drive") / "recording"
    x, y, yaw = drive.lidar_mount.tolist()
    write_recording(path, (m for m in drive.messages() if isinstance(m, LaserScan | Odometry)), lidar_mount=(x, y, yaw))
    return path


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Callable[..., subprocess.Popen[str]]]:
    """Start nodes as processes; they are ended with the test, and what they said is shown where it fails."""
    running: list[subprocess.Popen[str]] = []

    def begin(
        node: str, *, namespace: str = "", remap: dict[str, str] | None = None, **parameters: object
    ) -> subprocess.Popen[str]:
        words = [sys.executable, "-m", f"contourslam_ros.{node}", "--ros-args"]
        words += ["-r", f"__ns:=/{namespace}"] if namespace else []
        for name, topic in (remap or {}).items():
            words += ["-r", f"{name}:={topic}"]
        for name, value in parameters.items():
            shown = str(value).lower() if isinstance(value, bool) else value
            words += ["-p", f"{name.replace('__', '.')}:={shown}"]
        running.append(subprocess.Popen(words, stdout=sys.stderr, stderr=sys.stderr, text=True))
        return running[-1]

    yield begin
    for process in running:
        process.terminate()
    for process in running:
        try:
            process.wait(20.0)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


@pytest.fixture
def play(recording: Path, tmp_path: Path) -> Iterator[Callable[..., subprocess.Popen[str]]]:
    """Play the recording, in a process of its own."""
    running: list[subprocess.Popen[str]] = []

    def begin(**choices: object) -> subprocess.Popen[str]:
        plan = Plan(str(recording), **choices)  # type: ignore[arg-type]  # as the caller knows
        path = plan.write(tmp_path / f"plan{len(running)}.json")
        running.append(subprocess.Popen([sys.executable, str(HERE / "player.py"), str(path)], text=True))
        return running[-1]

    yield begin
    for process in running:
        process.kill()
        process.wait()


@pytest.fixture
def observe(ros: None) -> Iterator[Callable[..., Observer]]:
    """Listen to what a node publishes."""
    observers: list[Observer] = []

    def begin(namespace: str = "") -> Observer:
        observers.append(Observer(namespace, f"observer{len(observers)}"))
        return observers[-1]

    yield begin
    for observer in observers:
        observer.close()
