from collections.abc import Callable
from dataclasses import dataclass, replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from contourslam.config import Config
from contourslam.evaluation.consistency import nees
from contourslam.evaluation.detection import DetectionScore
from contourslam.evaluation.errors import pose_errors
from contourslam.evaluation.metrics import run_metrics
from contourslam.experiments.adaptation import Adaptation
from contourslam.experiments.compare import Comparison, SeedRuns
from contourslam.experiments.noise import NoiseSweep
from contourslam.experiments.refinement import Refinement
from contourslam.experiments.replays import variants
from contourslam.experiments.study import Study
from contourslam.geometry.poses import between, compose
from contourslam.scan import LaserScan, evenly_spaced
from contourslam.simulation.config import SimulationConfig
from contourslam.simulation.rooms import FURNISHED_ROOM
from contourslam.slam.landmark_map import CornerMap, WallMap
from contourslam.slam.result import Loop, RunResult

VOID = {"meta", "link", "img", "br", "hr"}

ROOM = np.array([[0.0, 0.0], [6.0, 0.0], [6.0, 4.0], [0.0, 4.0]])


class Page(HTMLParser):
    """Tags in their nesting, and the attributes of each."""

    def __init__(self, text):
        super().__init__()
        self.open, self.tags = [], []
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def all(self, tag):
        return [attributes for name, attributes in self.tags if name == tag]


@pytest.fixture(scope="session")
def parsed() -> type[Page]:
    """Read a page, which must be well nested."""
    return Page


@dataclass(frozen=True)
class Seen:
    """What a browser made of a page: its pictures and those that failed, what it asked for, complaints, px too wide."""

    images: int
    broken: list[str]
    requests: list[str]
    errors: list[str]
    overflow: int


@pytest.fixture
def browse(browser: Any) -> Callable[..., Seen]:
    """Open a page as a file in a real browser, and tell what it made of it."""

    def opened(file: Path, *, width: int) -> Seen:
        requests: list[str] = []
        errors: list[str] = []
        with browser.new_context(viewport={"width": width, "height": 900}) as context:
            page = context.new_page()
            page.on("request", lambda request: requests.append(request.url))
            page.on("console", lambda message: errors.append(message.text))
            page.on("pageerror", lambda error: errors.append(str(error)))
            page.goto(file.as_uri())
            images = page.evaluate("[...document.images].map((i) => [i.src, i.complete && i.naturalWidth > 0])")
            overflow = page.evaluate("document.documentElement.scrollWidth - document.documentElement.clientWidth")
        broken = [source for source, shown in images if not shown]
        return Seen(len(images), broken, [url for url in requests if url != file.as_uri()], errors, overflow)

    return opened


def square_map(rng: np.random.Generator) -> tuple[CornerMap, WallMap]:
    n = len(ROOM)
    factor = 0.006 * rng.standard_normal((n, 2, 2))
    corners = CornerMap(
        ids=np.array([3, 5, 8, 13]),
        positions=ROOM + 0.005 * rng.standard_normal((n, 2)),
        covariances=factor @ factor.transpose(0, 2, 1) + 1e-6 * np.eye(2),
        directions=np.array([0.785398, 2.356194, -2.356194, -0.785398]),
        openings=np.full(n, 1.5707963),
        convex=np.array([False, True, False, False]),
        observed=np.array([800, 640, 90, 700]),
        failed=np.array([10, 40, 60, 25]),
    )
    walls = WallMap(
        ids=np.array([1, 2, 4, 6]),
        end_points=np.stack([ROOM, np.roll(ROOM, -1, axis=0)], axis=1),
        end_point_covariances=np.broadcast_to(1e-5 * np.eye(2), (n, 2, 2, 2)).copy(),
        normals=np.array([-1.570796, 0.0, 1.570796, 3.1415926]),
        line_covariances=np.broadcast_to(np.diag([1e-6, 1e-5]), (n, 2, 2)).copy(),
        observed=np.array([900, 910, 870, 901]),
        failed=np.array([3, 4, 0, 9]),
    )
    return corners, walls


@pytest.fixture(scope="session")
def make_run() -> Callable[..., RunResult]:
    """A run through a 6 m by 4 m room whose errors are as large as its covariance says."""

    def make(detector: str = "matched_filter", seed: int = 0, scans: int = 300, complete: bool = True) -> RunResult:
        rng = np.random.default_rng(seed)
        turn = np.linspace(0.0, 4.0 * np.pi, scans)
        truth = np.stack(
            [3.0 + 2.0 * np.sin(turn), 2.0 - 1.2 * np.cos(turn), np.arctan2(1.2 * np.sin(turn), 2.0 * np.cos(turn))],
            axis=-1,
        )
        sigma = np.array([0.008, 0.006, 0.002])
        steps = between(truth[:-1], truth[1:]) * np.array([1.01, 1.0, 1.012])
        odometry = [truth[0]]
        for step in steps:
            odometry.append(compose(odometry[-1], step))
        corners, walls = square_map(rng)
        return RunResult(
            detector=detector,
            stamps=100.0 + 0.1 * np.arange(scans),
            poses=truth + sigma * rng.standard_normal((scans, 3)),
            covariances=np.broadcast_to(np.diag(sigma**2), (scans, 3, 3)).copy(),
            odometry=np.array(odometry),
            truth=truth,
            nis=rng.chisquare(4, scans),
            nis_dof=np.full(scans, 4),
            matched_count=np.full(scans, 2),
            corner_count=np.full(scans, 3),
            wall_count=np.full(scans, 4),
            corner_map=corners,
            wall_map=walls,
            seconds={"contour": 0.02 * scans / 300, "detection": 0.05, "refinement": 0.02, "correction": 0.04},
            skipped={},
            complete=complete,
        )

    return make


@pytest.fixture(scope="session")
def make_graph_run(make_run) -> Callable[..., RunResult]:
    """The same drive as the graph back end would hand it on: online poses, matching quality and closed loops."""

    def make(seed: int = 0, scans: int = 300, loops: int = 5) -> RunResult:
        run = make_run(seed=seed, scans=scans)
        rng = np.random.default_rng(seed + 1000)
        half = scans // 2
        closed = tuple(
            Loop(
                earlier_stamp=float(run.stamps[i * half // loops]),
                later_stamp=float(run.stamps[half + i * half // loops]),
                relative_pose=between(run.poses[i * half // loops], run.poses[half + i * half // loops]),
                covariance=np.diag([1e-4, 2e-4, 3e-6]) + 1e-7,
                shift=np.array([0.4 / (1 + i), -0.1, 0.02]) * (-1) ** i,
                method="constellation" if i % 2 else "search",
                pairs=int(rng.integers(40, 200)),
                residual=float(rng.uniform(0.005, 0.02)),
                overlap=float(rng.uniform(0.5, 1.0)),
                runner_up=float(rng.uniform(0.0, 0.9)),
            )
            for i in range(loops)
        )
        return replace(
            run,
            back_end="graph",
            online_poses=run.poses + np.array([0.02, 0.02, 0.004]) * rng.standard_normal((scans, 3)),
            quality=np.clip(rng.normal(0.9, 0.05, scans), 0.0, 1.0),
            loops=closed,
        )

    return make


@pytest.fixture(scope="session")
def room_scan() -> Callable[..., LaserScan]:
    """A noiseless scan of the 6 m by 4 m room from a pose inside it."""

    def scan(pose: np.ndarray, stamp: float = 0.0, beams: int = 360) -> LaserScan:
        angles = 2.0 * np.pi * np.arange(beams) / beams
        direction = np.stack([np.cos(angles + pose[2]), np.sin(angles + pose[2])], axis=-1)
        with np.errstate(divide="ignore"):
            to_walls = np.stack(
                [(np.where(direction[:, i] >= 0, ROOM[2, i], 0.0) - pose[i]) / direction[:, i] for i in (0, 1)]
            )
        ranges = to_walls.min(axis=0)
        return evenly_spaced(
            stamp, ranges, angle_min=0.0, angle_increment=2.0 * np.pi / beams, range_min=0.05, range_max=20.0
        )

    return scan


@pytest.fixture(scope="session")
def make_study(make_run) -> Callable[..., Study]:
    """A study of two detectors over three seeds, made of synthetic runs instead of simulated ones."""

    def make(
        detectors: tuple[str, ...] = ("matched_filter", "teh_chin"), seeds: int = 3, complete: bool = True
    ) -> Study:
        done = []
        for seed in range(seeds):
            runs = SeedRuns(seed)
            for i, variant in enumerate(variants(detectors)):
                run = make_run(variant.detector, seed=10 * seed + i, scans=80)
                runs.metrics[variant] = run_metrics(run)
                runs.nees[variant] = nees(pose_errors(run.poses, run.truth), run.covariances)
                if seed == 0:
                    runs.results[variant] = run
            done.append(runs)
        comparison = Comparison(FURNISHED_ROOM, detectors, Config(), SimulationConfig(), tuple(done), complete)
        single = {name: run_metrics(make_run(name, seed=77)) for name in detectors}
        score = DetectionScore(*np.full((4, 3), 5), np.full(5, 0.008), np.full(5, 0.03), 5, 4)
        return Study(
            comparison,
            NoiseSweep(np.array([0.0, 0.02]), (single, single), True),
            Refinement(single, single, dict.fromkeys(detectors, score), True),
            Adaptation(single, single, True),
            complete,
        )

    return make
