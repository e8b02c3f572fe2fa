"""What the commands that work through a recording have in common: options, reading, Ctrl-C, the result folder."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import tyro

from contourslam.cli.console import complain, note, prepare_folder, progress
from contourslam.cli.interrupt import INTERRUPTED, Interrupt, UntilStopped
from contourslam.cli.options import Flag, Json, Output, Overwrite
from contourslam.config import Config
from contourslam.errors import ConfigError, ContourslamError, MapError, RecordingError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from contourslam.recordings import Message
    from contourslam.report.occupancy import OccupancyGrid
    from contourslam.scan import LaserScan
    from contourslam.slam.mapper import Mapper
    from contourslam.slam.result import RunResult, ScanUpdate

_WARM_UP = 20  # scans


@dataclass(frozen=True)
class Reading:
    """Options of a command that works through a recording."""

    recording: tyro.conf.Positional[Path]
    """Recording to read: a file, or the folder of a rosbag2."""
    output: Output
    overwrite: Overwrite = False
    relations: Path | None = None
    """Judge the trajectory by these known relative poses: rows t1 t2 dx dy dz roll pitch yaw."""
    scan_topic: str | None = None
    """Topic of the scans; found by itself where there is only one."""
    odometry_topic: str | None = None
    """Topic of the wheel odometry; found by itself where there is only one."""
    truth_topic: str | None = None
    """Topic of the true poses; they serve the evaluation, and `run` for the first pose."""
    ignore_odometry: Flag = False
    """Go by the scans alone, as if the robot had no wheel odometry."""
    every: int = 1
    """Use every n-th scan only."""
    max_scans: int | None = None
    """Stop after this many scans."""
    grid: Flag = False
    """Render an occupancy grid for Nav2 too (map.pgm, map.yaml); it costs a second reading of the recording."""
    json: Json = False


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


class Work:
    """A recording that is worked through, from the options to the result folder.

    Parameters
    ----------
    options : Reading
    settings : Config

    Attributes
    ----------
    recording : Recording

    Raises
    ------
    ContourslamError
        If an option is wrong, the recording or the relations cannot be read, or the folder holds something.
    """

    def __init__(self, options: Reading, settings: Config) -> None:
        from contourslam.recordings import open_recording, read_relations

        if options.every < 1 or (options.max_scans is not None and options.max_scans < 1):
            raise ConfigError("--every and --max-scans must be at least 1")
        self._options, self._settings = options, settings
        self._relations = None if options.relations is None else read_relations(options.relations)
        self.recording = open_recording(
            options.recording,
            scan_topic=options.scan_topic,
            odometry_topic=options.odometry_topic,
            truth_topic=options.truth_topic,
        )
        prepare_folder(options.output, overwrite=options.overwrite)
        self._error: ContourslamError | None = None
        self._stopped, self._scans = False, 0

    def replay(
        self,
        make: "Callable[..., Mapper]",
        rehearse: "Callable[..., Mapper]",
        begin: "Callable[[Opening], NDArray[Any] | None]" = lambda opening: None,
        on_scan: "Callable[[LaserScan, ScanUpdate], None] | None" = None,
    ) -> "RunResult":
        """Replay the recording until it ends or Ctrl-C is pressed.

        Parameters
        ----------
        make, rehearse : callable
            Make the mapper, and one for the first scans before: to compile or to load the kernels is no part of the
            time per scan.
        begin : callable
            Gives the pose at the first scan, where it is known.
        on_scan : callable, optional
            Called after each scan.
        """
        from contourslam.replay import replay

        mount = self.recording.lidar_mount
        with Interrupt() as interrupt:
            messages = UntilStopped(self._chosen(self._options.max_scans), interrupt)
            try:
                opening = Opening(iter(messages))
                if opening.scans:
                    replay(opening.messages, self._settings, lidar_mount=mount, make=rehearse)
                pose = begin(opening)
                result = replay(
                    progress(opening.whole(), "message"),
                    self._settings,
                    initial_pose=pose,
                    lidar_mount=mount,
                    on_scan=on_scan,
                    make=make,
                )
            except (RecordingError, MapError):
                if interrupt.requested:  # it holds no scan because we stopped before the first
                    raise KeyboardInterrupt from None
                raise
        self._scans = len(result.stamps)
        complete = result.complete and not messages.interrupted
        self._error, self._stopped = messages.error, interrupt.requested and not complete
        return replace(result, complete=complete, skipped={**self.recording.skipped, **result.skipped})

    def _chosen(self, max_scans: int | None) -> "Iterator[Message]":
        """Yield messages, every n-th scan only, until so many of these, without odometry if it is to be ignored."""
        from contourslam.scan import LaserScan, Odometry

        scans = used = 0
        for message in self.recording.messages():
            if self._options.ignore_odometry and isinstance(message, Odometry):
                continue
            if isinstance(message, LaserScan):
                scans += 1
                if (scans - 1) % self._options.every:
                    continue
                used += 1
            yield message
            if used == max_scans:
                return

    def write(self, result: "RunResult", more: dict[str, Any], command: str) -> dict[str, Any]:
        """Write the result folder with its page, and give the metrics, with `more` among them."""
        from contourslam.evaluation.metrics import run_metrics
        from contourslam.evaluation.relations import judge
        from contourslam.report.result_folder import write_result_folder
        from contourslam.report.run_page import write_run_page

        options, settings = self._options, self._settings
        # A single scan has nothing to show.
        judged = None if self._relations is None or len(result.stamps) < 2 else judge(result, *self._relations)
        metrics = {"recording": options.recording.name} | run_metrics(result, relations=judged) | more
        grid = self._grid(result) if options.grid else None
        write_result_folder(options.output, result, settings, metrics, grid=grid, command=command)
        name = options.recording.name
        write_run_page(options.output, result, settings, metrics, judged, command=command, name=name)
        if grid is None:  # an earlier run's would not belong to this one
            for name in ("map.pgm", "map.yaml"):
                (options.output / name).unlink(missing_ok=True)
        for text in self.recording.notes:
            note(text)
        return metrics

    def _grid(self, result: "RunResult") -> "OccupancyGrid":
        """Read the recording again as far as it was used; a further Ctrl-C ends this, with what there is by then."""
        import numpy as np

        from contourslam.report.run_grid import run_grid

        lidar = self._settings.lidar
        mount = np.array(self.recording.lidar_mount or lidar.mount)
        with Interrupt() as interrupt:
            messages = UntilStopped(self._chosen(self._scans), interrupt)
            return run_grid(progress(messages, "message"), result, lidar_mount=mount, max_range=lidar.max_range)

    def exit_code(self) -> int:
        """Say what ended the work early, if anything did."""
        scans, folder = self._scans, self._options.output
        if self._error is not None:
            complain(f"{self._error}; the {scans} scans before it are in {folder}")
            return 1
        if self._stopped:
            complain(f"interrupted after {scans} scans; they are in {folder}")
            return INTERRUPTED
        return 0


def tell_errors(metrics: dict[str, Any], revised: str = "") -> None:
    """Print the errors against true poses and known relations, where there are any.

    Parameters
    ----------
    metrics : dict
    revised : str
        What becomes of the poses at the end, such as "refined".
    """
    if metrics["rmse"]:
        print(f"RMSE against the true poses: {_rmse(metrics['rmse'])}")
        if metrics["online_rmse"]:
            print(f"  as known at the time (online): {_rmse(metrics['online_rmse'])}")
        print(f"  raw odometry: {_rmse(metrics['odometry_rmse'])}")
    if "relations" in metrics:
        end = f", {revised} at the end" if "online_relations" in metrics else ""
        print(f"relation error{end}: {_relation_error(metrics['relations'])}")
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
