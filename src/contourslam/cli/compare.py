"""``contourslam compare``: runs held against each other, or the paper's experiment; either with its report."""

import shlex
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import tyro

from contourslam.cli.console import Bar, chosen, complain, keep_apart, make_way, note, prepare_folder, print_json
from contourslam.cli.evaluate import print_table
from contourslam.cli.interrupt import INTERRUPTED, Interrupt
from contourslam.cli.options import Flag, Json, Output, Overwrite, Settings
from contourslam.config import Config
from contourslam.errors import ConfigError

if TYPE_CHECKING:
    from contourslam.experiments.parallel import Observer

_WITH_FOLDERS = {"--truth", "--relations", "--output", "--overwrite", "--json"}
DETECTORS = ("matched_filter", "wu", "teh_chin", "curvature_scale_space")


@dataclass(frozen=True)
class Compare:
    """Compare runs, or without any the landmark detectors in a simulated room.

    With result folders: what differs between the runs, their errors side by side, trajectories of the same recording
    over one another, and how sure each difference is. The folder gets index.html (the report, opens offline), tables
    as CSV and LaTeX, figures as SVG and PDF, and metrics.json. Only --truth, --relations, --output, --overwrite and
    --json go with folders.

    Without folders: drives through a room once per seed and replays each drive through every detector, with corners
    only, as in the paper, and with walls. The folder gets index.html, its figures, metrics.json and the first drive's
    recording. Ctrl-C stops and reports what is done.

    Example: contourslam compare out/ekf out/graph -o out/comparison
    """

    folders: tyro.conf.Positional[tuple[Path, ...]] = ()
    """Folders that `contourslam run` wrote, to be compared; the first one is what the others are laid upon."""
    truth: Path | None = None
    """True trajectory to judge the runs by: rows t x y z qx qy qz qw (TUM) or t x y theta."""
    relations: Path | None = None
    """Known relative poses to judge the runs by: rows t1 t2 dx dy dz roll pitch yaw."""
    output: Output = Path("comparison")
    overwrite: Overwrite = False
    room: str = "furnished_room"
    """Room to drive through: furnished_room, office_corridor, large_hall or office_building."""
    seeds: int = 10
    """How many drives; their seeds are 0, 1, 2, ..."""
    detectors: tuple[str, ...] = DETECTORS
    """Detectors to compare."""
    duration: float | None = None
    """Length of a drive, s; two laps where left out, 180 s at least."""
    lidar: str = "paper"
    """Lidar: paper (500 beams at 10 Hz) or ydlidar_x4 (varying beams, drop-outs)."""
    no_noise_sweep: Flag = False
    """Leave out the error against range noise from 0 to 5 cm."""
    no_details: Flag = False
    """Leave out raw against refined corners, and the detectors without our adaptations."""
    jobs: int = 0
    """Processes to use; 0 for one per core."""
    json: Json = False
    settings: Settings = field(default_factory=Config)

    def execute(self, command: str) -> int:
        """Compare the runs, or run the experiments; write the report and print its table."""
        given = {word.partition("=")[0].replace("_", "-") for word in shlex.split(command) if word.startswith("--")}
        if self.folders:
            if others := sorted(given - _WITH_FOLDERS):
                raise ConfigError(
                    f"{', '.join(others)}: of the simulated comparison, and not for result folders; leave it out, "
                    "or the folders"
                )
            return self._runs(command)
        if only := sorted(given & {"--truth", "--relations"}):
            raise ConfigError(f"{', '.join(only)}: judges result folders; name those that are to be compared")
        return self._detectors(command)

    def _runs(self, command: str) -> int:
        """Compare result folders."""
        from contourslam.report.runs_page import write_runs_report
        from contourslam.report.runs_reading import read_runs

        keep_apart(self.output, self.folders)
        runs = read_runs(self.folders, truth=self.truth, relations=self.relations)
        prepare_folder(self.output, overwrite=self.overwrite)
        for text in [text for run in runs for text in run.notes]:
            note(text)
        metrics = write_runs_report(self.output, runs, command=command)
        if self.json:
            print_json(metrics)
        else:
            print_table({run.name: run.metrics for run in runs})
            print(f"\nreport: {self.output / 'index.html'}")
        return 0

    def _detectors(self, command: str) -> int:
        """Run the experiments, write the report and print Table I."""
        if self.seeds < 1 or self.jobs < 0:
            raise ConfigError("--seeds must be at least 1 and --jobs 0 or more")
        from contourslam.detectors import make_detector
        from contourslam.experiments.noise import LEVELS
        from contourslam.experiments.parallel import cores
        from contourslam.experiments.study import study
        from contourslam.report.comparison_metrics import comparison_metrics
        from contourslam.report.html import write_report
        from contourslam.simulation.config import LIDARS, SimulationConfig
        from contourslam.simulation.rooms import ROOMS

        for name in self.detectors:
            make_detector(name)
        room = chosen("room", self.room, ROOMS)
        simulation = SimulationConfig(duration=self.duration, lidar=chosen("lidar", self.lidar, LIDARS))
        prepare_folder(self.output, overwrite=self.overwrite)
        recording = self.output / "recording"
        make_way(recording, overwrite=self.overwrite)
        with Interrupt() as interrupt, _Stages(interrupt) as stages:
            outcome = study(
                room,
                range(self.seeds),
                detectors=self.detectors,
                config=self.settings,
                simulation=simulation,
                noise_levels=() if self.no_noise_sweep else LEVELS,
                details=not self.no_details,
                recording=recording,
                jobs=self.jobs or cores(),
                observe=stages.observe,
            )
        if not any(seed.metrics for seed in outcome.comparison.seeds):
            complain("interrupted before the first replay was done; there is nothing to report")
            return INTERRUPTED
        metrics = comparison_metrics(outcome, command=command)
        write_report(self.output, outcome, command=command)
        if self.json:
            print_json(metrics)
        else:
            _print_table(metrics)
            print(f"\nreport: {self.output / 'index.html'}")
        if interrupt.requested and not outcome.complete:
            complain(f"interrupted; {self.output} reports what was done")
            return INTERRUPTED
        return 0


class _Stages:
    """Shows the experiments one after the other, each with its bar."""

    def __init__(self, interrupt: Interrupt) -> None:
        self._interrupt = interrupt
        self._bar: Bar | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.__exit__()

    def observe(self, stage: str) -> "Observer":
        """Begin a stage: end the last one's bar and start another."""
        from contourslam.experiments.parallel import Observer

        self.__exit__()
        note(f"{stage} ...")
        bar = self._bar = Bar(stage)
        return Observer(lambda done, total: bar.to(done / total), lambda: self._interrupt.requested)


def _print_table(metrics: dict[str, Any]) -> None:
    """Print Table I: ours with corners only and with walls, and the paper's."""
    seeds = len(metrics["seeds"])
    print(f"RMSE in {metrics['room']}, mean over {seeds} drives; x and y in m, heading in rad\n")
    print(f"{'':<24}{'corners only':^26}{'with walls':^26}{'the paper':^26}")
    print(f"{'':<24}" + f"{'x':>8}{'y':>8}{'heading':>9} " * 3)
    walls = metrics["with_walls"]["detectors"]
    for name, found in metrics["detectors"].items():
        ours = [
            {key: value["mean"] for key, value in table["rmse"].items()} for table in (found, walls.get(name)) if table
        ]
        printed = metrics["paper"].get(name)
        columns = [*ours, *[{}] * (2 - len(ours)), printed["rmse"] if printed else {}]
        print(f"{name:<24}" + "".join(_cells(column) for column in columns))
    print(f"{'raw odometry':<24}" + _cells(_means(metrics["odometry"])))


def _means(table: dict[str, Any] | None) -> dict[str, float] | None:
    rmse = table and table["rmse"]
    return rmse and {coordinate: value["mean"] for coordinate, value in rmse.items()}


def _cells(rmse: dict[str, float] | None) -> str:
    if not rmse:
        return f"{'-':>8}{'-':>8}{'-':>9} "
    return f"{rmse['x']:8.3f}{rmse['y']:8.3f}{rmse['theta']:9.4f} "
