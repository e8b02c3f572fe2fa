"""``contourslam run``: a recording to a trajectory and a map."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import tyro

from contourslam.cli.console import complain, note, prepare_folder, print_json, progress
from contourslam.cli.interrupt import INTERRUPTED, Interrupt, UntilStopped
from contourslam.cli.options import Flag, Json, Output, Overwrite, Settings
from contourslam.config import Config, SlamConfig
from contourslam.errors import ConfigError, RecordingError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from contourslam.evaluation.relations import JudgedRelations
    from contourslam.recordings import Message, Recording
    from contourslam.report.occupancy import OccupancyGrid
    from contourslam.slam.result import RunResult

    Floats = NDArray[np.float64]

_WARM_UP = 20  # scans
DEFAULTS = Config(slam=SlamConfig(walls=True))
"""Walls are on: on real logs corners alone are too few."""


@dataclass(frozen=True)
class Run:
    """Map a recording: trajectory and map of corners and walls, into a folder.

    The recording is a rosbag (1, 2, MCAP) or a CARMEN log, plain, .gz or .xz. The folder gets index.html (a page about
    the run), trajectory.tum, map.geojson, map.pgm and map.yaml for Nav2's map server, map.png, metrics.json, scans.csv
    and config.yaml, and where the run has them trajectory_online.tum (poses as known at the time, before the
    refinement), loops.csv (the closed loops with their evidence) and relation_errors.csv.
    Ctrl-C stops and keeps what is done.

    Example: contourslam run intel.log.xz --relations intel.relations.xz -o out/intel
    """

    recording: tyro.conf.Positional[Path]
    """Recording to map: a file, or the folder of a rosbag2."""
    output: Output
    overwrite: Overwrite = False
    config: Path | None = None
    """Start from this configuration, the config.yaml of an earlier run; options given beside it win."""
    relations: Path | None = None
    """Judge the trajectory by these known relative poses: rows t1 t2 dx dy dz roll pitch yaw."""
    scan_topic: str | None = None
    """Topic of the scans; found by itself where there is only one."""
    odometry_topic: str | None = None
    """Topic of the wheel odometry; found by itself where there is only one."""
    truth_topic: str | None = None
    """Topic of the true poses; they serve the evaluation and the first pose only."""
    every: int = 1
    """Use every n-th scan only."""
    max_scans: int | None = None
    """Stop after this many scans."""
    no_grid: Flag = False
    """Leave out the occupancy grid (map.pgm, map.yaml), which costs a second reading of the recording."""
    json: Json = False
    settings: Settings = field(default_factory=lambda: DEFAULTS)

    @classmethod
    def starting_from(cls, arguments: Sequence[str]) -> Self:
        """Give the options' defaults: those of the file where ``--config FILE`` stands among the arguments.

        Raises
        ------
        ConfigError
            If the file is not a configuration.
        """
        settings = DEFAULTS
        for argument, following in zip(arguments, [*arguments[1:], ""], strict=True):
            name, equals, value = argument.partition("=")
            if name == "--config" and (value or following):
                from contourslam.report.config_file import read_config

                settings = read_config(Path(value if equals else following))
        return cls(recording=tyro.MISSING, output=tyro.MISSING, settings=settings)

    def execute(self, command: str) -> int:
        """Map the recording, write the folder and say how it went."""
        if self.every < 1 or (self.max_scans is not None and self.max_scans < 1):
            raise ConfigError("--every and --max-scans must be at least 1")
        return _run(self, command)


class _Reading:
    """The messages of a recording as the options want them; what passes by is kept where the evaluation needs it."""

    def __init__(self, recording: "Recording", options: Run) -> None:
        self._recording = recording
        self._every = options.every
        self.odometry_stamps: list[float] = []
        self.odometry_poses: list[Floats] = []

    def messages(self, max_scans: int | None) -> "Iterator[Message]":
        """Yield messages, every n-th scan only, until `max_scans` of these."""
        from contourslam.scan import LaserScan, Odometry

        scans = used = 0
        self.odometry_stamps.clear()
        self.odometry_poses.clear()
        for message in self._recording.messages():
            if isinstance(message, Odometry):
                self.odometry_stamps.append(message.stamp)
                self.odometry_poses.append(message.pose)
            if isinstance(message, LaserScan):
                scans += 1
                if (scans - 1) % self._every:
                    continue
                used += 1
            yield message
            if used == max_scans:
                return


def _run(options: Run, command: str) -> int:
    from contourslam.detectors import make_detector
    from contourslam.evaluation.metrics import run_metrics
    from contourslam.recordings import open_recording, read_relations
    from contourslam.replay import replay
    from contourslam.report.result_folder import write_result_folder
    from contourslam.report.run_page import write_run_page

    make_detector(options.settings.detector)  # an unknown name fails before any work is done
    relations = None if options.relations is None else read_relations(options.relations)
    recording = open_recording(
        options.recording,
        scan_topic=options.scan_topic,
        odometry_topic=options.odometry_topic,
        truth_topic=options.truth_topic,
    )
    prepare_folder(options.output, overwrite=options.overwrite)
    reading = _Reading(recording, options)
    mount = recording.lidar_mount
    with Interrupt() as interrupt:
        try:
            # Compiling is no part of the time per scan, and takes as long as some thousand of them.
            replay(UntilStopped(reading.messages(_WARM_UP), interrupt), options.settings, lidar_mount=mount)
            messages = UntilStopped(reading.messages(options.max_scans), interrupt)
            result = replay(progress(messages, "message"), options.settings, lidar_mount=mount)
        except RecordingError:
            if interrupt.requested:  # it holds no scan because we stopped before the first
                raise KeyboardInterrupt from None
            raise
    complete = result.complete and not messages.interrupted
    result = replace(result, complete=complete, skipped={**recording.skipped, **result.skipped})
    if len(result.stamps):
        judged = None if relations is None else _judge(result, reading, *relations)
        metrics = run_metrics(result, relations=judged)
        grid = None if options.no_grid else _grid(reading, result, options.settings, recording)
        notes = write_result_folder(options.output, result, options.settings, metrics, grid=grid, command=command)
        name = options.recording.name
        notes += write_run_page(options.output, result, options.settings, metrics, judged, command=command, name=name)
        if grid is None:  # an earlier run's would not belong to this one
            for name in ("map.pgm", "map.yaml"):
                (options.output / name).unlink(missing_ok=True)
        for text in (*recording.notes, *notes):
            note(text)
        _tell(options, metrics)
    if messages.error is not None:
        complain(f"{messages.error}; the {len(result.stamps)} scans before it are in {options.output}")
        return 1
    if interrupt.requested and not result.complete:
        complain(f"interrupted after {len(result.stamps)} scans; they are in {options.output}")
        return INTERRUPTED
    return 0


def _judge(result: "RunResult", reading: _Reading, stamps: "Floats", poses: "Floats") -> "JudgedRelations | None":
    """Hold the trajectory and raw odometry against known relative poses; a single scan has nothing to show."""
    import numpy as np

    from contourslam.evaluation.relations import judge

    if len(result.stamps) < 2:
        return None
    return judge(result, stamps, poses, np.array(reading.odometry_stamps), np.array(reading.odometry_poses))


def _grid(reading: _Reading, result: "RunResult", config: Config, recording: "Recording") -> "OccupancyGrid":
    """Read the recording again as far as it was used; a further Ctrl-C ends this, with what there is by then."""
    import numpy as np

    from contourslam.report.run_grid import run_grid

    lidar = config.lidar
    mount = recording.lidar_mount or (lidar.mount_x, lidar.mount_y, lidar.mount_yaw)
    with Interrupt() as interrupt:
        messages = UntilStopped(reading.messages(len(result.stamps)), interrupt)
        return run_grid(progress(messages, "message"), result, lidar_mount=np.array(mount), max_range=lidar.max_range)


def _tell(options: Run, metrics: dict[str, Any]) -> None:
    """Print what came out."""
    if options.json:
        print_json(metrics)
        return
    size = metrics["landmarks"]
    rate = metrics["scans_per_second"]
    print(
        f"{options.output}: {metrics['scans']} scans, {size['corners']} corners, {size['walls']} walls"
        + (f", {rate:.0f} scans/s" if rate else "")
    )
    if metrics["rmse"]:
        rmse, raw = metrics["rmse"], metrics["odometry_rmse"]
        print(
            f"RMSE against the true poses: x {rmse['x']:.3f} m, y {rmse['y']:.3f} m, heading {rmse['theta']:.4f} rad "
            f"(raw odometry {raw['x']:.3f}, {raw['y']:.3f}, {raw['theta']:.4f})"
        )
    if "relations" in metrics:
        print(f"relation error: {_relation_error(metrics['relations'])}")
        if "online_relations" in metrics:
            print(f"  as known at the time (online): {_relation_error(metrics['online_relations'])}")
        print(f"  raw odometry: {_relation_error(metrics['odometry_relations'])}")
    for reason, count in metrics["skipped"].items():
        print(f"skipped {count}: {reason}")


def _relation_error(errors: dict[str, Any]) -> str:
    translation, rotation = errors["translation"], math.degrees(errors["rotation"]["mean"])
    return f"{translation['mean']:.4f} m mean, {translation['median']:.4f} m median, {rotation:.2f}° mean"
