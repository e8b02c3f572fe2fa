"""Where the computing time went."""

from contourslam.evaluation.timing import timing
from contourslam.report.page.markup import Cell, Row, Section, paragraph, table
from contourslam.report.page.run.values import RunValues

_WORDS = (
    "All stages together must take well less than the lidar's period, 100 ms at 10 Hz, on the computer that drives; "
    "one stage that takes most of it is where to look first."
)


def section(values: RunValues) -> Section | None:
    """Give the section; None where no time was recorded."""
    result = values.result
    times = timing(result)
    if not times.total:
        return None
    scans = len(result.stamps)
    rows = [_row(stage, seconds, times.shares[stage], scans) for stage, seconds in times.seconds.items()]
    rows.append(_row("all together", times.total, 1.0, scans))
    numbers = table("CPU time per stage, after warm-up", ["stage", "s", "share", "ms per scan"], rows)
    return Section("timings", "CPU time", paragraph(_WORDS) + numbers)


def _row(stage: str, seconds: float, share: float, scans: int) -> Row:
    return Row(
        stage.replace("_", " "),
        [Cell(f"{seconds:.2f}"), Cell(f"{100.0 * share:.0f} %"), Cell(f"{1000.0 * seconds / scans:.3f}")],
    )
