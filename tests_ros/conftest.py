"""A ROS graph of the tests' own, a simulated drive, and the processes that a test starts."""

import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest
from observer import Observer
from player import Plan

from contourslam.scan import LaserScan, Odometry
from contourslam.simulation.simulate import SimulatedRun

HERE = Path(__file__).parent
# Nobody else's nodes are heard, and the processes find what the tests do. Ids up to 101 are safe on every system.
os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
os.environ["ROS_DOMAIN_ID"] = str(40 + os.getpid() % 60)
os.environ["PYTHONPATH"] = os.pathsep.join([str(HERE), str(HERE.parent / "ros2" / "contourslam_ros")])

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


class Processes:
    """Nodes and players of one test, each in a process of its own."""

    def __init__(self, recording: Path, folder: Path) -> None:
        self._recording, self._folder = recording, folder
        self._running: list[subprocess.Popen[str]] = []
        self._plans: dict[str, Plan] = {}

    def start(
        self, node: str, *, namespace: str = "", log: Path | None = None, **parameters: object
    ) -> "subprocess.Popen[str]":
        """Start a node; ``__`` in a parameter's name stands for a dot. What it says goes to `log`."""
        words = [sys.executable, "-m", f"contourslam_ros.{node}", "--ros-args"]
        words += ["-r", f"__ns:=/{namespace}"] if namespace else []
        for name, value in parameters.items():
            words += ["-p", f"{name.replace('__', '.')}:={str(value).lower() if isinstance(value, bool) else value}"]
        return self._run(words, log)

    def drive(self, observers: Iterable[Observer], *plans: dict[str, Any]) -> None:
        """Play as each plan says, all at once, when the nodes know who listens to them; until all have driven."""
        begun = self._folder / "begun"
        players = [self.play(begun=str(begun), **plan) for plan in plans]
        assert all(observer.knows_its_node() for observer in observers)
        begun.touch()
        assert [player.wait(200.0) for player in players] == [0] * len(players)
        begun.unlink()

    def play(self, **choices: Any) -> "subprocess.Popen[str]":
        """Play the recording as a :class:`Plan` says, as soon as a node listens."""
        robot = choices.get("namespace", "")
        path = self._folder / f"robot_{robot}.plan"
        self._plans[robot] = Plan(recording=str(self._recording), report=str(path.with_suffix(".report")), **choices)
        path.write_text(self._plans[robot].text())
        return self._run([sys.executable, str(HERE / "player.py"), str(path)])

    def played(self, namespace: str = "") -> dict[str, float]:
        """Give what was added to the recording's stamps (`shift`, s), and how many `scans` were sent."""
        return self._plans[namespace].played()

    def _run(self, words: list[str], log: Path | None = None) -> "subprocess.Popen[str]":
        with ExitStack() as stack:
            said = None if log is None else stack.enter_context(log.open("w"))
            self._running.append(subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=said, text=True))
        return self._running[-1]

    def end(self) -> None:
        """End what still runs, as a launch system does."""
        for process in self._running:
            process.send_signal(signal.SIGINT)
        for process in self._running:
            try:
                process.wait(30.0)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        self._running.clear()


def needs_kernels(item: pytest.Item) -> bool:
    return "compiled" in getattr(item, "fixturenames", ())


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Those that need what is compiled come last, when it is."""
    items.sort(key=needs_kernels)


@pytest.fixture(scope="session", autouse=True)
def compiling(request: pytest.FixtureRequest) -> Iterator["subprocess.Popen[bytes] | None"]:
    """Compile beside the tests that need no kernel."""
    if not any(map(needs_kernels, request.session.items)):
        yield None
        return
    with subprocess.Popen([sys.executable, str(HERE / "compiling.py")]) as process:
        yield process
        process.kill()


@pytest.fixture(scope="session")
def compiled(compiling: "subprocess.Popen[bytes]") -> None:
    """All kernels are in Numba's cache: else the nodes that start together would each compile them, for minutes."""
    assert compiling.wait() == 0


@pytest.fixture(scope="module")
def processes(compiled: None, recording: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Processes]:
    made = Processes(recording, tmp_path_factory.mktemp("processes"))
    yield made
    made.end()


@pytest.fixture(scope="module")
def parts(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Processes]:
    """Nodes of the robot's parts, which map nothing and so have nothing to compile."""
    made = Processes(Path(), tmp_path_factory.mktemp("parts"))
    yield made
    made.end()


@pytest.fixture(scope="module")
def observe(ros: None) -> Iterator[Callable[[str], Observer]]:
    """Listen to what a robot's node publishes."""
    observers: list[Observer] = []

    def begin(namespace: str = "") -> Observer:
        observers.append(Observer(namespace, f"observer{len(observers)}", observers[0] if observers else None))
        return observers[-1]

    yield begin
    for observer in observers:
        observer.close()
