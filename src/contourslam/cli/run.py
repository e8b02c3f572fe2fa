"""``contourslam run``: a recording to a trajectory and a map."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Self

import tyro

from contourslam.cli.console import complain, note, print_json
from contourslam.cli.kept_map import KeptMap
from contourslam.cli.options import Settings
from contourslam.cli.reading import Opening, Reading, Work, tell_errors
from contourslam.config import Config, SlamConfig

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from contourslam.view.rerun_watch import LoggedRun

_GRAPH = find_spec("gtsam") is not None
DEFAULTS = Config(
    back_end="graph" if _GRAPH else "ekf",
    slam=SlamConfig(walls=True, contour_matching=True),
)
"""The graph closes loops and so is the better one wherever GTSAM is installed. The filter gets what serves it on real
logs: walls, because corners alone are too few, and contour matching, because wheels slip."""

_ENOUGH, _MATCHED = 50, 0.8  # scans and their mean quality, from which a map without a corner is odd
_APART = 5.0  # NIS of the graph: wheels that are right give below 2, a lidar that looks backwards 20


@dataclass(frozen=True)
class Run(Reading):
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

    config: Path | None = None
    """Start from this configuration, the config.yaml of an earlier run; options given beside it win."""
    map: Path | None = None
    """Go on in this map, the map.cmap of an earlier run in the same building; the graph can."""
    initial_pose: tuple[float, float, float] | None = None
    """Where the drive begins: x (m), y (m), heading (degrees); in a map to go on in roughly, else it is looked for."""
    rerun: Annotated[Path | None, tyro.conf.arg(metavar="FILE.rrd")] = None
    """Log the mapping scan by scan into this file too, for the Rerun viewer."""
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
                from contourslam.settings_file import read_settings

                settings = read_settings(Path(value if equals else following), Config)
        return cls(recording=tyro.MISSING, output=tyro.MISSING, settings=settings)

    def execute(self, command: str) -> int:
        """Map the recording, write the folder and say how it went."""
        from contourslam.detectors import make_detector
        from contourslam.replay import make_mapper

        settings = self.settings
        make_detector(settings.detector)  # an unknown name fails before any work is done
        continued = KeptMap(settings, self.map, self.initial_pose)
        work = Work(self, settings)
        mount = work.recording.lidar_mount

        def begin(opening: Opening) -> "NDArray[np.float64] | None":
            continued.find_start(opening, mount)
            return continued.pose

        logged = None if self.rerun is None else self._logged(self.rerun)
        make, on_scan = (continued.make, None) if logged is None else (logged.making(continued.make), logged.on_scan)
        result = work.replay(make, make_mapper, begin, on_scan)
        if len(result.stamps):
            metrics = work.write(result, {"back_end_reason": _reason(settings)}, command)
            continued.keep(self.output / "map.cmap", self.recording.name)
            for text in (*continued.notes, *_doubts(metrics, settings)):
                note(text)
            _tell(self, metrics)
        trouble = "" if logged is None else logged.finish(result)
        if trouble:
            complain(trouble)
        return work.exit_code() or int(bool(trouble))

    def _logged(self, path: Path) -> "LoggedRun":
        from contourslam.view.rerun_watch import LoggedRun, open_log

        settings = self.settings
        log = open_log(path, self.recording.name, settings, [settings.detector], overwrite=self.overwrite)
        return LoggedRun(log)


def _reason(settings: Config) -> str:
    """Say why it is this back end."""
    if settings.back_end != DEFAULTS.back_end:
        return "as asked for"
    if _GRAPH:
        return "the default, for GTSAM is installed"
    return "GTSAM is not installed: `pip install 'contourslam[graph]'` brings the graph, which closes loops"


def _doubts(metrics: dict[str, Any], settings: Config) -> list[str]:
    """Say what looks as if a setting were wrong, where the map alone would not show it."""
    doubts = []
    if metrics["scans"] >= _ENOUGH and (metrics["quality"] or 0.0) > _MATCHED and not metrics["landmarks"]["corners"]:
        doubts.append(
            "scans match well, yet there is no corner in the map: the lidar's noise may not be the "
            f"{settings.lidar.sigma_range:g} m of --sigma-range (docs/how_to/tuning.md measures it)"
        )
    if settings.back_end == "graph" and (metrics["nis"] or 0.0) > _APART:
        doubts.append(
            f"wheels and contours disagree (NIS {metrics['nis']:.1f}): is the lidar where --mount-x, --mount-y and "
            "--mount-yaw or the recording have it, and the odometry sound? --ignore-odometry goes by the scans alone"
        )
    return doubts


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
    tell_errors(metrics, "refined" if options.settings.graph.refine else "as known")  # all loops count in both
