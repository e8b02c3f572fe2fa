"""Three robots in the office joined by the server, over seeds and in bad air; and what a message costs it.

Cost is measured with reports that were recorded once: a few drives in each of some buildings, told by several robots
each, that set out one after the other. Robots of one building can be joined, those of different ones cannot. The server
gets one core: what it cannot do in a second of its CPU for a second of the fleet waits.
"""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time, thread_time

import numpy as np

from contourslam.cli.entry import main as contourslam
from contourslam.cli.run import DEFAULTS
from contourslam.fleet.channel import Air
from contourslam.fleet.facts import Answer, Report
from contourslam.fleet.inbox import Inbox
from contourslam.fleet.play import Fleet, play
from contourslam.fleet.play_robot import Player
from contourslam.fleet.reporter import Reporter
from contourslam.fleet.server import FleetServer
from contourslam.fleet.wire import decode, encode
from contourslam.geometry.poses import between
from contourslam.graph import GraphSlam
from contourslam.recordings import open_recording
from contourslam.report.fleet_metrics import fleet_metrics
from contourslam.report.svg.axes import Axes
from contourslam.report.svg.colours import BLUE, ORANGE
from contourslam.report.svg.drawing import drawing
from contourslam.scan import LaserScan, Odometry
from contourslam.simulation.buildings import office_building
from contourslam.simulation.long_drive import LongDrive
from table import ROOT, Table, publish

Told = list[tuple[float, bytes]]

SEEDS, ROBOTS, DURATION = (1, 2, 3), 3, 180.0
# All that may go wrong at once: the air, the first robot's program, the server's.
BAD, DIES = Air(loss=0.2, delay=5.0, repeat=0.1), 90.0  # s
COUNTS = (1, 2, 5, 10, 20, 50, 100)
BUILDINGS, DRIVES, LENGTH, LATER = (
    5,
    5,
    60.0,
    15.0,
)  # m of a drive; s by which a robot that tells the same sets out later
TICK = 1.0  # s
FIGURE = ROOT / "docs" / "pictures" / "fleet_cost.svg"


# Three robots in the office.


def office(seed: int, folder: Path) -> list[Player]:
    if not any(folder.iterdir()):
        told = ["--room", "office_building", "--robots", str(ROBOTS), "--duration", str(DURATION), "--seed", str(seed)]
        contourslam(["simulate", *told, "-o", str(folder / "robots")])
    players = []
    for path in sorted((folder / "robots").iterdir()):
        recording = open_recording(path)
        mount = None if recording.lidar_mount is None else np.array(recording.lidar_mount)
        players.append(Player(path.name, recording.messages(), mount))
    return players


def row(name: str, fleet: Fleet, beside: Fleet | None = None) -> list[object]:
    told = fleet_metrics(fleet)
    robots = told["robots"]
    late = [pair["joined"] - pair["met"] for pair in told["met"] if pair["met"] is not None and pair["joined"]]
    apart = sum(pair["met"] is not None and pair["joined"] is None for pair in told["met"])
    return [
        name, *(worst(robots, error) for error in ("rmse", "online_rmse", "odometry_rmse")),
        "-" if beside else f"{max(late):.1f}" + (f", {apart} pairs never" if apart else ""), len(told["maps"]),
        round(max(robot["bytes_per_second"] for robot in robots)),
        "-" if beside is None else f"{1e3 * off(fleet, beside):.1f}",
    ]  # fmt: skip


def worst(robots: list[dict[str, float]], error: str) -> str:
    return f"{max(robot[error] for robot in robots):.4f}"


def off(fleet: Fleet, other: Fleet) -> float:
    """Farthest that a robot's pose lies from where it lies in the other fleet's map, seen from a pose of the first."""
    tracks = [{r.name: r.final(f.maps[0]) for r in f.robots} for f in (fleet, other)]
    first = [next(iter(track.values())) for track in tracks]
    common = np.intersect1d(first[0][0], first[1][0])[-1]
    frames = [poses[np.searchsorted(times, common)] for times, poses in first]
    farthest = 0.0
    for name in tracks[0]:
        (a, p), (b, q) = (track[name] for track in tracks)
        _, i, j = np.intersect1d(a, b, return_indices=True)
        away = between(frames[0], p[i])[:, :2] - between(frames[1], q[j])[:, :2]
        farthest = max(farthest, float(np.hypot(*away.T).max()))
    return farthest


def accuracy() -> None:
    rows: list[list[object]] = []
    for seed in SEEDS:
        with TemporaryDirectory() as folder:
            good = play(office(seed, Path(folder)), DEFAULTS)
            rows.append(row(f"seed {seed}", good))
            players = office(seed, Path(folder))
            players[0] = replace(players[0], restarts=(DIES,))
            with TemporaryDirectory() as kept:
                bad = play(players, DEFAULTS, BAD, seed=seed, folder=Path(kept), server_restarts=(DIES + 20.0,))
            rows.append(row(f"seed {seed}, all that may go wrong", bad, good))
        for each in rows[-2:]:
            print(*each, sep=" | ", flush=True)
    columns = (
        "drive", "worst robot's RMSE in the common frame (m)", "online (m)", "raw odometry (m)",
        "last pair joined after having seen the same room (s)", "common maps", "most bytes/s of a robot",
        "farthest from the undisturbed map (mm)",
    )  # fmt: skip
    publish(Table("fleet", columns, rows))


# What a message costs.


@cache
def recorded(building: int, number: int) -> Told:
    """Reports of one drive, as a robot tells them that is answered at once."""
    drive, seed = LongDrive(office_building(3, building), LENGTH, 100 * building + number), number
    slam, reporter = GraphSlam(DEFAULTS, lidar_mount=drive.lidar_mount), Reporter("x", lambda: seed, rate=math.inf)
    told: Told = []
    heard, none = Inbox(), np.zeros(3)
    for message in drive.messages():
        if isinstance(message, Odometry):
            slam.push_odometry(message)
        elif isinstance(message, LaserScan):
            reporter.push(slam, slam.push_scan(message), message.stamp)
            for data in reporter.due(message.stamp):
                told.append((message.stamp, data))
                heard.take(data)
            heard.settle()
            reporter.answered(Answer("x", seed, *heard.state(("x", seed)), -1, ("x",), -1, none, np.zeros((3, 3))))
    return told


def told_by(robot: int) -> Iterator[tuple[float, bytes, int]]:
    """Messages of one robot, and its building; numbers go round the buildings, then the drives, then set out later."""
    building, drive, again = robot % BUILDINGS, robot // BUILDINGS % DRIVES, robot // (BUILDINGS * DRIVES)
    for now, data in recorded(building, drive):
        message = decode(data)
        if isinstance(message, Report):
            told = Report(f"robot{robot}", robot + 1, message.number, message.facts)
            yield now + LATER * again, encode(told), building


@dataclass(frozen=True)
class Cost:
    """What some robots cost the server."""

    robots: int
    messages: int
    placing: float  # CPU, ms a message
    slow: float  # the dearest round's
    search: float
    looks: int
    waiting: int
    common: int
    false: int
    busy: float  # CPU seconds a second of the fleet's
    sizes: list[tuple[int, float]]  # keyframes of the largest common map, and ms a message then


def cost(robots: Iterable[int]) -> Cost:
    numbers = list(robots)
    messages = sorted((row for robot in numbers for row in told_by(robot)), key=lambda row: row[0])
    server = FleetServer(clock=thread_time)  # other work on this machine does not count
    due, placing, searching, rounds, sizes = TICK, 0.0, 0.0, [0.0], []
    since = 0
    for now, data, _ in [*messages, (math.inf, b"", 0)]:
        if now >= due:
            began = process_time()
            server.tick(due, 0.0)
            placed = process_time() - began
            began = process_time()
            server.tick(due, max(TICK - placed, 0.0))
            searching += process_time() - began
            placing += placed
            rounds.append(placed)
            sizes.append((max((len(c) for c in server._commons.values()), default=0), 1e3 * placed / max(since, 1)))
            due, since = due + TICK, 0
        if now < math.inf:
            began = process_time()
            server.push(data)
            placing += process_time() - began
            since += 1
    seconds, count = messages[-1][0], len(messages)
    false = sum(len({int(name[5:]) % BUILDINGS for name in shared.members}) > 1 for shared in server._commons.values())
    return Cost(
        len(numbers), count, 1e3 * placing / count, max(rounds), 1e3 * searching / count, server.search.looks,
        len(server.search), len(server._commons), false, (placing + searching) / seconds, sizes,
    )  # fmt: skip


def costs() -> None:
    cost(range(2))  # compiles
    found = []
    for count in COUNTS:
        found.append(cost(range(count)))
        print(found[-1].robots, found[-1].placing, found[-1].search, found[-1].busy, found[-1].waiting, flush=True)
    rows = [
        [c.robots, c.messages, c.placing, c.search, round(c.slow, 2), round(c.busy, 2), c.looks, c.waiting, c.common,
         min(c.robots, BUILDINGS), c.false]
        for c in found
    ]  # fmt: skip
    columns = (
        "robots", "messages", "placing (ms a message)", "looking for joints (ms a message)",
        "dearest second's placing (s)", "CPU s a second", "views looked for", "views that wait at the end",
        "common maps", "buildings", "false joints",
    )  # fmt: skip
    publish(Table("fleet_cost", columns, rows))
    one = cost(BUILDINGS * k for k in range(20))  # all in one building: one map that grows
    steps: list[list[object]] = []
    edges = np.linspace(0, max(size for size, _ in one.sizes) + 1, 7)
    for low, high in pairwise(edges):
        inside = [ms for size, ms in one.sizes if low <= size < high]
        if inside:
            steps.append([f"{low:.0f} to {high:.0f}", float(np.mean(inside)), float(np.max(inside))])
    publish(Table("fleet_size", ("keyframes in the common map", "placing (ms a message)", "at most"), steps))
    draw(found)


def draw(found: list[Cost]) -> None:
    robots = np.log10([c.robots for c in found])
    most = max(max(c.placing, c.search) for c in found)
    axes = Axes(
        (-0.05, 2.05), (0.0, 1.1 * most), 560.0, 300.0, labels=("log10 of the number of robots", "ms a message")
    )
    for name, colour, values in (
        ("placing", BLUE, [c.placing for c in found]), ("looking for joints", ORANGE, [c.search for c in found]),
    ):  # fmt: skip
        axes.line(robots, np.array(values), colour, 1.8, name=name)
        axes.dots(np.column_stack([robots, values]), colour, 5.0)
    axes.legend([("placing", BLUE), ("looking for joints", ORANGE)])
    FIGURE.write_text(drawing([axes]).text)


def main() -> None:
    accuracy()
    costs()


if __name__ == "__main__":
    main()
