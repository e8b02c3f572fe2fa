"""``contourslam localize``: a recording to a trajectory in a map that is known."""

import math
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from contourslam.cli.console import complain, print_json
from contourslam.cli.locate import UNSURE
from contourslam.cli.options import Settings
from contourslam.cli.reading import Reading, Work, tell_errors
from contourslam.config import Config

if TYPE_CHECKING:
    from contourslam.slam.mapper import Mapper
    from contourslam.slam.result import RunResult

UNKNOWN = "scans at which the robot was not localised"


@dataclass(frozen=True, kw_only=True)
class Localize(Reading):
    """Follow a robot through a recording in a known map, which stays as it is, and write the trajectory into a folder.

    The robot is looked for in the whole map at first, or near --initial-pose. The folder holds what that of `run` does,
    except for a map to go on in; scans at which it was not known where the robot is are left out and counted. Errors
    against true poses are those in the frame of the map. The exit code is 3 where the robot was never found. Ctrl-C
    stops and keeps what is done.

    Example: contourslam localize out/tuesday --map out/monday/map.cmap -o out/where
    """

    map: Annotated[Path, tyro.conf.arg(metavar="FILE")]
    """Map to localise in, the map.cmap of an earlier run."""
    initial_pose: tuple[float, float, float] | None = None
    """About where the robot is in the map at first, x (m), y (m), heading (degrees), to half a metre and 15 degrees."""
    settings: Settings = field(default_factory=Config)

    def execute(self, command: str) -> int:
        """Follow the robot, write the folder and say how it went."""
        import numpy as np

        from contourslam.detectors import make_detector
        from contourslam.localization.follow import Localizer
        from contourslam.localization.known_map import KnownMap
        from contourslam.localization.locate import Locator
        from contourslam.maps import load_map

        make_detector(self.settings.detector)  # an unknown name fails before any work is done
        saved = load_map(self.map)
        finder = Locator(KnownMap(saved))
        pose = None if self.initial_pose is None else np.array(self.initial_pose) * (1.0, 1.0, math.radians(1.0))

        def make(config: Config, detector: Any = None, *, initial_pose: object = None, **options: Any) -> "Mapper":
            """Make the localiser; where the recording knows the first pose, that is not told."""
            return Localizer(saved, config, detector, finder=finder, initial_pose=pose, **options)

        work = Work(self, self.settings)
        whole = replace(work.replay(make, make), back_end="localization")
        result = localized_part(whole)
        scans, found = len(whole.stamps), len(result.stamps)
        if not found:
            if code := work.exit_code():
                return code
            complain(f"the robot was not found in {self.map} by {scans} scans; say about where with --initial-pose")
            return UNSURE
        more = {"back_end_reason": f"in {self.map}", "localization": summary(whole)}
        metrics = work.write(result, more, command)
        if self.json:
            print_json(metrics)
        else:
            told = metrics["localization"]
            print(
                f"{self.output}: {found} of {scans} scans localised in {self.map}, "
                f"the first after {told['found_after']:.1f} s, lost {told['lost']} times"
            )
            tell_errors(metrics)
        return work.exit_code()


def summary(whole: "RunResult") -> dict[str, Any]:
    """Say how long after the first scan the robot was found (s), how often it was lost, and the part it was known."""
    import numpy as np

    known = _known(whole)
    return {
        "found_after": float(whole.stamps[np.argmax(known)] - whole.stamps[0]),
        "lost": int(np.count_nonzero(known[:-1] & ~known[1:])),
        "localised": float(known.mean()),
    }


def localized_part(whole: "RunResult") -> "RunResult":
    """Leave out the scans at which it was not known where the robot is."""
    import numpy as np

    known = _known(whole)
    skipped = dict(whole.skipped)
    if not known.all():
        skipped[UNKNOWN] = int(np.count_nonzero(~known))
    readings = whole.readings
    if readings is not None:
        kept_before = np.concatenate([[0], np.cumsum(known)])
        readings = replace(readings, scans_before=kept_before[readings.scans_before])
    return replace(
        whole,
        stamps=whole.stamps[known],
        poses=whole.poses[known],
        covariances=whole.covariances[known],
        odometry=whole.odometry[known],
        truth=None if whole.truth is None else whole.truth[known],
        nis=whole.nis[known],
        nis_dof=whole.nis_dof[known],
        matched_count=whole.matched_count[known],
        corner_count=whole.corner_count[known],
        wall_count=whole.wall_count[known],
        quality=None if whole.quality is None else whole.quality[known],
        readings=readings,
        skipped=skipped,
    )


def _known(whole: "RunResult") -> Any:
    import numpy as np

    return np.zeros(len(whole.stamps), np.bool_) if whole.quality is None else whole.quality > 0.0
