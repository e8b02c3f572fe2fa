"""What robots and the fleet server cost on the wire: every byte counted on a network of namespaces, headers and all.

Two robots and the server stand in network namespaces of their own, which only a bridge joins, as computers on one
radio. Each robot's own scans stay in its namespace. What crosses a robot's cable is counted, both ways, from Ethernet's
header on, discovery and all. Runs in the environment of the ROS 2 tests, on Linux, with ``unshare`` and ``ip``:

    .venv-ros/bin/python benchmarks/bench_fleet_wire.py --write
"""

import os
import select
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections import Counter
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path

from table import ROOT, Table, publish

PATHS = [str(ROOT / "tests_ros"), str(ROOT / "ros2" / "contourslam_ros")]
sys.path[:0] = PATHS
DOMAIN = 37
os.environ |= {"ROS_DOMAIN_ID": str(DOMAIN), "FASTDDS_BUILTIN_TRANSPORTS": "UDPv4"}
os.environ["PYTHONPATH"] = os.pathsep.join(PATHS)

ROBOTS = ("robot1", "robot2")
SECONDS = 150.0  # of driving
COUNTED = 130.0  # of them, the last ones: finding each other when all starts is told apart
PORTS = 7400 + 250 * DOMAIN  # the first that DDS gives to a domain; those for data are odd
ETHERNET, IP, UDP, EVERYTHING = 14, 20, 8, 3


@dataclass
class Cable:
    """What crossed a robot's cable."""

    name: str
    began: float = 0.0
    ended: float = 0.0
    sent: Counter[str] = field(default_factory=Counter)
    got: Counter[str] = field(default_factory=Counter)
    frames: Counter[str] = field(default_factory=Counter)

    def rate(self, *kinds: str) -> float:
        """Bytes a second, both ways."""
        chosen = kinds or tuple({*self.sent, *self.got})
        return sum(self.sent[k] + self.got[k] for k in chosen) / (self.ended - self.began)


def kind_of(frame: bytes, begun: dict[tuple[bytes, bytes], str]) -> str:
    """Tell what a frame carries: "data" of topics, "discovery" of DDS, or what is neither."""
    if frame[12:14] != b"\x08\x00" or frame[23] != 17:
        return "other"
    packet = frame[ETHERNET:]
    key = packet[12:16], packet[4:6]  # of one datagram all fragments are alike, and only the first has the ports
    if (packet[6] & 0x1F) == 0 and packet[7] == 0:
        port = int.from_bytes(packet[IP + 2 : IP + 4], "big") - PORTS
        begun[key] = "other" if not 0 <= port < 250 else "data" if port % 2 else "discovery"
    return begun.get(key, "other")


def count(cables: list[Cable], seconds: float) -> None:
    """Count what crosses the cables for so long."""
    with ExitStack() as stack:
        sockets: dict[socket.socket, tuple[Cable, dict[tuple[bytes, bytes], str]]] = {}
        for cable in cables:
            listening = stack.enter_context(socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.ntohs(EVERYTHING)))
            listening.bind((cable.name, 0))
            sockets[listening] = cable, {}
            cable.began = time.monotonic()
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0.0:
            for listening in select.select(list(sockets), [], [], left)[0]:
                frame, address = listening.recvfrom(1 << 16)
                cable, begun = sockets[listening]
                kind = kind_of(frame, begun)
                # Seen from the bridge: what goes out there comes in at the robot.
                into = cable.got if address[2] == socket.PACKET_OUTGOING else cable.sent
                into[kind] += len(frame)
                cable.frames[kind] += 1
        for cable in cables:
            cable.ended = time.monotonic()


def ip(*words: str, at: int | None = None) -> None:
    """Set up the network, of this namespace or that of a process."""
    inside = [] if at is None else ["nsenter", "--target", str(at), "--net"]
    subprocess.run([*inside, "ip", *words], check=True)


def network(stack: ExitStack) -> dict[str, int]:
    """Make a bridge here and a namespace for each robot; gives a process that lives in each."""
    ip("link", "set", "lo", "up")
    ip("link", "add", "air", "type", "bridge", "mcast_snooping", "0")
    ip("address", "add", "10.9.0.1/24", "dev", "air")
    ip("link", "set", "air", "up")
    ip("route", "add", "default", "dev", "air")
    living = {}
    for number, robot in enumerate(ROBOTS):
        holder = subprocess.Popen(["unshare", "--net", "sleep", "infinity"])
        stack.callback(holder.wait)
        stack.callback(holder.kill)
        own = Path("/proc/self/ns/net").readlink()
        while Path(f"/proc/{holder.pid}/ns/net").readlink() == own:
            time.sleep(0.01)
        ip("link", "add", f"to_{robot}", "type", "veth", "peer", "name", "radio")
        ip("link", "set", f"to_{robot}", "master", "air", "up")
        ip("link", "set", "radio", "netns", str(holder.pid))
        ip("link", "set", "lo", "up", at=holder.pid)
        ip("address", "add", f"10.9.0.{10 + number}/24", "dev", "radio", at=holder.pid)
        ip("link", "set", "radio", "up", at=holder.pid)
        ip("route", "add", "default", "dev", "radio", at=holder.pid)
        living[robot] = holder.pid
    return living


def started(
    stack: ExitStack,
    words: list[str],
    *,
    at: int | None = None,
    reach: str = "SUBNET",
    calm: bool = False,
    log: Path | None = None,
) -> None:
    """Start a program, in the namespace of a process; it is ended with the stack."""
    inside = [] if at is None else ["nsenter", "--target", str(at), "--net"]
    said = subprocess.DEVNULL if log is None else stack.enter_context(log.open("w"))
    around = os.environ | {"ROS_AUTOMATIC_DISCOVERY_RANGE": reach}
    if calm:
        around["FASTDDS_DEFAULT_PROFILES_FILE"] = str(ROOT / "ros2" / "contourslam_ros" / "config" / "fleet_dds.xml")
    process = subprocess.Popen([*inside, *words], env=around, stdout=subprocess.DEVNULL, stderr=said)

    def end() -> None:
        process.send_signal(signal.SIGINT)
        try:
            process.wait(30.0)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()

    stack.callback(end)


def slam(robot: str) -> list[str]:
    """Start a robot's mapping."""
    named = ["-r", f"__ns:=/{robot}", "-p", f"frame_prefix:={robot}/", "-p", f"fleet:={robot}"]
    return [sys.executable, "-m", "contourslam_ros.slam", "--ros-args", *named]


def player(folder: Path, robot: str, odometry: str) -> list[str]:
    """Play a robot's recording."""
    from player import Plan

    report = str(folder / f"{robot}.report")
    plan = Plan(str(folder / robot), report, namespace=robot, prefix=f"{robot}/", odometry=odometry)
    (folder / f"{robot}.plan").write_text(plan.text())
    return [sys.executable, str(ROOT / "tests_ros" / "player.py"), str(folder / f"{robot}.plan")]


def heard(log: Path, text: str) -> None:
    """Wait until a program has said something."""
    end = time.monotonic() + 300.0
    while text not in log.read_text():
        if time.monotonic() > end:
            raise SystemExit(f"{log.name} did not say {text!r}:\n{log.read_text()}")
        time.sleep(0.1)


LISTEN = """
import rclpy
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import LaserScan
rclpy.init()
node = rclpy.create_node("listener")
for robot in {robots!r}:
    node.create_subscription(LaserScan, f"/{{robot}}/scan", lambda message: None, qos_profile_sensor_data)
rclpy.spin(node)
"""


def measure(
    folder: Path, living: dict[str, int], *, fleet: bool, reach: str = "SUBNET", calm: bool = False
) -> list[Cable]:
    """Let the robots drive, and count.

    Parameters
    ----------
    folder : Path
        With their recordings.
    living : dict of str to int
        A process in the namespace of each robot.
    fleet : bool
        They map and tell the server; else their scans are listened to from outside.
    reach : str
        How far the discovery of a robot's other nodes goes.
    calm : bool
        Nodes of the fleet say seldom that they are there, as config/fleet_dds.xml has it.
    """
    cables = [Cable(f"to_{robot}") for robot in ROBOTS]
    with ExitStack() as stack:
        if fleet:
            log = folder / f"server_{reach}.log"
            kept = f"folder:={folder / f'kept_{reach}'}"
            server = [sys.executable, "-m", "contourslam_ros.fleet_server", "--ros-args", "-p", kept]
            started(stack, server, calm=calm, log=log)
            heard(log, "ready")
            for robot in ROBOTS:
                log = folder / f"{robot}_{reach}.log"
                started(stack, slam(robot), at=living[robot], calm=calm, log=log)
                heard(log, "ready")
        else:
            started(stack, [sys.executable, "-c", LISTEN.format(robots=ROBOTS)])
        for robot in ROBOTS:
            words = player(folder, robot, "topic" if fleet else "none")
            started(stack, words, at=living[robot], reach=reach)
        time.sleep(SECONDS - COUNTED)
        count(cables, COUNTED - 5.0)
    return cables


def inside() -> None:
    """Measure; in a network namespace of our own."""
    from contourslam.recordings import write_recording
    from contourslam.scan import LaserScan, Odometry
    from contourslam.simulation.config import SimulationConfig
    from contourslam.simulation.rooms import ROOMS
    from contourslam.simulation.simulate import simulate

    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        for seed, robot in enumerate(ROBOTS):
            drive = simulate(ROOMS["office_corridor"], SimulationConfig(duration=SECONDS), seed=seed)
            x, y, yaw = drive.lidar_mount.tolist()
            messages = [m for m in drive.messages() if isinstance(m, LaserScan | Odometry)]
            write_recording(folder / robot, messages, lidar_mount=(x, y, yaw))
        living = network(stack)
        alone = measure(folder, living, fleet=True, reach="LOCALHOST", calm=True)
        public = measure(folder, living, fleet=True)
        raw = measure(folder, living, fleet=False)
    cases = {
        "fleet, with fleet_dds.xml, its other nodes on the robot alone": (alone, "2,000"),
        "fleet, as ROS 2 comes, with one more node": (public, ""),
        "raw scans": (raw, ""),
    }
    rows = [
        [f"{cable.name.removeprefix('to_')}, {name}", *figures(cable), target]
        for name, (cables, target) in cases.items()
        for cable in cables
    ]
    columns = ["500 beams at 10 Hz, driving", "B/s", "out", "in", "topics", "discovery", "other", "frames/s", "target"]
    publish(Table("fleet_wire", columns, rows))


def figures(cable: Cable) -> list[float]:
    """Bytes a second, all and in parts, and frames a second."""
    spent = cable.ended - cable.began
    ways = [sum(way.values()) / spent for way in (cable.sent, cable.got)]
    return [cable.rate(), *ways, *map(cable.rate, ("data", "discovery", "other")), sum(cable.frames.values()) / spent]


def main() -> None:
    if "--inside" in sys.argv:
        inside()
        return
    user = [] if os.geteuid() == 0 else ["--map-root-user"]
    os.execvp("unshare", ["unshare", "--net", *user, sys.executable, *sys.argv, "--inside"])


if __name__ == "__main__":
    main()
