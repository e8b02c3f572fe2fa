"""``contourslam run``: a recording to a trajectory and a map."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import tyro

from contourslam.cli.console import complain, note, prepare_folder, print_json, progress
from contourslam.cli.interrupt import INTERRUPTED, Interrupt, UntilStopped
from contourslam.cli.kept_map import KeptMap
from contourslam.cli.options import Flag, Json, Output, Overwrite, Settings
from contourslam.config import Config, SlamConfig
from contourslam.errors import ConfigError, MapError, RecordingError

if TYPE_CHECKING:
    from contourslam.recordings import Message, Recording
    from contourslam.report.occupancy import OccupancyGrid
    from contourslam.slam.result import RunResult

_WARM_UP = 20  # scans
_GRAPH = find_spec("gtsam") is not None
DEFAULTS = Config(
    back_end="graph" if _GRAPH else "ekf",
    slam=SlamConfig(walls=True, contour_matching=True),
)
"""The graph closes loops and so is the better one wherever GTSAM is installed. The filter gets what serves it on real
logs: walls, because corners alone are too few, and contour matching, because wheels slip."""


@dataclass(frozen=True)
class Run:
    """Map a recording: trajectory and map of corners and walls, into a folder.

    The recording is a rosbag (1, 2, MCAP) or a CARMEN log, plain, .gz or .xz. The folder gets index.html (a page about
    the run), map.svg, map.geojson, map.cmap (the map for other runs and robots), trajectory.tum (a pose at each scan
    and odometry reading), metrics.json, scans.csv and config.yaml, and where the run has them trajectory_online.tum
    (poses as known at the time, before the refinement), odometry.tum, loops.csv (the closed loops with their evidence)
    and relation_errors.csv; with --grid also map.pgm and map.yaml for Nav2's map server. Ctrl-C stops and keeps what is
    done.

    With --map the drive goes on in the map of an earlier run: its start is looked for there, corners and walls keep
    their ids, and map.cmap holds both drives.

    The back end is the graph, which closes loops and refines the whole map at the end, wherever the extra `graph`
    (GTSAM) is installed, else the paper's filter (ekf); --back-end chooses.

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
    ignore_odometry: Flag = False
    """Map from the scans alone, as if the robot had no wheel odometry."""
    every: int = 1
    """Use every n-th scan only."""
    max_scans: int | None = None
    """Stop after this many scans."""
    map: Path | None = None
    """Go on in this map, the map.cmap of an earlier run in the same building; the graph can."""
    initial_pose: tuple[float, float, float] | None = None
    """Where the drive begins: x (m), y (m), heading (degrees); in a map to go on in roughly, else it is looked for."""
    grid: Flag = False
    """Render an occupancy grid for Nav2 too (map.pgm, map.yaml); it costs a second reading of the recording."""
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


def _chosen(recording: "Recording", options: Run) -> "Iterator[Message]":
    """Yield messages, every n-th scan only, until so many of these, without odometry if it is to be ignored."""
    from contourslam.scan import LaserScan, Odometry

    scans = used = 0
    every, max_scans = options.every, options.max_scans
    for message in recording.messages():
        if options.ignore_odometry and isinstance(message, Odometry):
            continue
        if isinstance(message, LaserScan):
            scans += 1
            if (scans - 1) % every:
                continue
            used += 1
        yield message
        if used == max_scans:
            return


class Opening:
    """The first scans of a recording, kept for a rehearsal, so that the recording is read only once."""

    def __init__(self, messages: "Iterator[Message]") -> None:
        from contourslam.scan import LaserScan

        self._rest = messages
        self._error: RecordingError | None = None
        self.messages: list[Message] = []
        self.scans = 0
        try:
            for message in messages:
                self.messages.append(message)
                self.scans += isinstance(message, LaserScan)
                if self.scans == _WARM_UP:
                    break
        except RecordingError as error:
            self._error = error

    def growing(self) -> "Iterator[Message]":
        """Yield these, and then what follows them, which is kept too."""
        yield from self.messages
        if self._error is not None:
            return  # raised when the recording is mapped
        try:
            for message in self._rest:
                self.messages.append(message)
                yield message
        except RecordingError as error:
            self._error = error

    def whole(self) -> "Iterator[Message]":
        """Yield these and what follows them."""
        yield from self.messages
        if self._error is not None:
            raise self._error
        yield from self._rest


def _run(options: Run, command: str) -> int:
    from contourslam.detectors import make_detector
    from contourslam.evaluation.metrics import run_metrics
    from contourslam.evaluation.relations import judge
    from contourslam.recordings import open_recording, read_relations
    from contourslam.replay import replay
    from contourslam.report.result_folder import write_result_folder
    from contourslam.report.run_page import write_run_page

    settings = options.settings
    make_detector(settings.detector)  # an unknown name fails before any work is done
    continued = KeptMap(settings, options.map, options.initial_pose)
    relations = None if options.relations is None else read_relations(options.relations)
    recording = open_recording(
        options.recording,
        scan_topic=options.scan_topic,
        odometry_topic=options.odometry_topic,
        truth_topic=options.truth_topic,
    )
    prepare_folder(options.output, overwrite=options.overwrite)
    mount = recording.lidar_mount
    with Interrupt() as interrupt:
        messages = UntilStopped(_chosen(recording, options), interrupt)
        try:
            opening = Opening(iter(messages))
            if opening.scans:  # to compile or to load the kernels is no part of the time per scan
                replay(opening.messages, settings, lidar_mount=mount)
            continued.find_start(opening, mount)
            result = replay(
                progress(opening.whole(), "message"), settings, initial_pose=continued.pose, lidar_mount=mount,
                make=continued.make,
            )  # fmt: skip
        except (RecordingError, MapError):
            if interrupt.requested:  # it holds no scan because we stopped before the first
                raise KeyboardInterrupt from None
            raise
    complete = result.complete and not messages.interrupted
    result = replace(result, complete=complete, skipped={**recording.skipped, **result.skipped})
    if len(result.stamps):
        # A single scan has nothing to show.
        judged = None if relations is None or len(result.stamps) < 2 else judge(result, *relations)
        metrics = run_metrics(result, relations=judged) | {"back_end_reason": _reason(settings)}
        grid = _grid(recording, result, options) if options.grid else None
        write_result_folder(options.output, result, settings, metrics, grid=grid, command=command)
        name = options.recording.name
        write_run_page(options.output, result, settings, metrics, judged, command=command, name=name)
        if grid is None:  # an earlier run's would not belong to this one
            for name in ("map.pgm", "map.yaml"):
                (options.output / name).unlink(missing_ok=True)
        continued.keep(options.output / "map.cmap", options.recording.name)
        for text in (*recording.notes, *continued.notes):
            note(text)
        _tell(options, metrics)
    if messages.error is not None:
        complain(f"{messages.error}; the {len(result.stamps)} scans before it are in {options.output}")
        return 1
    if interrupt.requested and not result.complete:
        complain(f"interrupted after {len(result.stamps)} scans; they are in {options.output}")
        return INTERRUPTED
    return 0


def _reason(settings: Config) -> str:
    """Say why it is this back end."""
    if settings.back_end != DEFAULTS.back_end:
        return "as asked for"
    if _GRAPH:
        return "the default, for GTSAM is installed"
    return "GTSAM is not installed: `pip install 'contourslam[graph]'` brings the graph, which closes loops"


def _grid(recording: "Recording", result: "RunResult", options: Run) -> "OccupancyGrid":
    """Read the recording again as far as it was used; a further Ctrl-C ends this, with what there is by then."""
    import numpy as np

    from contourslam.report.run_grid import run_grid

    lidar = options.settings.lidar
    mount = recording.lidar_mount or lidar.mount
    with Interrupt() as interrupt:
        messages = UntilStopped(_chosen(recording, replace(options, max_scans=len(result.stamps))), interrupt)
        return run_grid(progress(messages, "message"), result, lidar_mount=np.array(mount), max_range=lidar.max_range)


def _tell(options: Run, metrics: dict[str, Any]) -> None:
    """Print what came out."""
    if options.json:
        print_json(metrics)
        return
    size = metrics["landmarks"]
    rate = metrics["scans_per_second"]
    print(
        f"{options.output}: {metrics['scans']} scans, {size['corners']} corners, {size['walls']} walls, "
        f"{metrics['loops']} loops" + (f", {rate:.0f} scans/s" if rate else "")
    )
    print(f"back end: {metrics['back_end']} ({metrics['back_end_reason']})")
    if metrics["rmse"]:
        print(f"RMSE against the true poses: {_rmse(metrics['rmse'])}")
        if metrics["online_rmse"]:
            print(f"  as known at the time (online): {_rmse(metrics['online_rmse'])}")
        print(f"  raw odometry: {_rmse(metrics['odometry_rmse'])}")
    if "relations" in metrics:
        last = "refined" if options.settings.graph.refine else "as known"  # all loops count in both
        revised = f", {last} at the end" if "online_relations" in metrics else ""
        print(f"relation error{revised}: {_relation_error(metrics['relations'])}")
        if "online_relations" in metrics:
            print(f"  as known at the time (online): {_relation_error(metrics['online_relations'])}")
        print(f"  raw odometry: {_relation_error(metrics['odometry_relations'])}")
    for reason, count in metrics["skipped"].items():
        print(f"skipped {count}: {reason}")


def _rmse(rmse: dict[str, Any]) -> str:
    return f"x {rmse['x']:.3f} m, y {rmse['y']:.3f} m, heading {rmse['theta']:.4f} rad"


def _relation_error(errors: dict[str, Any]) -> str:
    translation, rotation = errors["translation"], math.degrees(errors["rotation"]["mean"])
    return f"{translation['mean']:.4f} m mean, {translation['median']:.4f} m median, {rotation:.2f}° mean"
