"""The trajectory against true poses, where the recording has them."""

import numpy as np

from contourslam.report.page.album import drawn
from contourslam.report.page.markup import Cell, Row, Section, paragraph, table
from contourslam.report.page.run.values import RunValues, degrees, length
from contourslam.report.svg.series import error_drawing

_WORDS = (
    "A good error stays inside the grey band nineteen times in twenty and touches all of it. One that runs outside for "
    "long tells of an estimate that is surer than it may be; a band much wider than the error, of one too cautious."
)


def section(values: RunValues) -> Section | None:
    """Give the section; None without true poses."""
    result, metrics = values.result, values.metrics
    if result.truth is None or not np.isfinite(result.truth).any() or not metrics.get("rmse"):
        return None
    rows = [
        Row(name, [Cell(length(rmse["x"])), Cell(length(rmse["y"])), Cell(degrees(rmse["theta"]))], aside)
        for name, rmse, aside in (
            ("estimate", metrics["rmse"], False),
            ("raw odometry", metrics["odometry_rmse"], True),
        )
    ]
    inside = metrics.get("inside_two_sigma") or {}
    rows.append(Row("estimate inside ±2σ (ideal 95.4 %)", [Cell(_percent(inside.get(k))) for k in ("x", "y", "theta")]))
    numbers = table("RMS error against the true poses", ["trajectory", "x", "y", "heading"], rows)
    figure = drawn(
        error_drawing(result),
        kind="chart",
        name="error",
        alt="Error of x, y and heading over time inside the bounds of two standard deviations",
        caption=f"Error over time and ±2σ of what the filter states. NEES {metrics['nees'] or 0.0:.2f}, ideal 3.",
    )
    return Section("truth", "Error against the true poses", paragraph(_WORDS) + numbers + figure)


def _percent(share: float | None) -> str:
    return "–" if share is None else f"{100.0 * share:.1f} %"
