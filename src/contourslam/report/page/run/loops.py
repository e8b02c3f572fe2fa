"""The closed loops with their evidence."""

import numpy as np

from contourslam.report.page.markup import Cell, Row, Section, paragraph, table
from contourslam.report.page.run.values import RunValues, clock, count, degrees, length
from contourslam.slam.result import Loop

_MOST = 30
_GOOD = (
    "A good loop has many pairs, a residual near the lidar's noise and a runner-up far below 1. A few pairs, or a "
    "runner-up near 1, with a large shift: look at that place on the map first, for a wrong loop bends all of it."
)
_HEADERS = ("from → to (min)", "shift", "turn", "method", "pairs", "residual", "overlap", "runner-up")


def section(values: RunValues) -> Section | None:
    """Give the section; None where no loop was closed."""
    loops = values.result.loops
    if not loops:
        return None
    largest = sorted(loops, key=lambda loop: -float(np.hypot(*loop.shift[:2])))[:_MOST]
    caption = f"{count(len(loops), 'closed loop')}, those first that moved the pose the farthest"
    if len(loops) > _MOST:
        caption = f"The {_MOST} of {len(loops):,} closed loops that moved the pose the farthest"
    words = (
        "Shift and turn: by how much the estimate before the loop was off. Residual: RMS distance of the pairs. "
        "Overlap: part of the later scan's contour points that found a partner. Runner-up: score of the best other "
        "alignment as a part of this one's; near 1 the place is ambiguous. loops.csv beside this page holds every "
        "loop with its relative pose and covariance."
    )
    return Section(
        "loops",
        "Closed loops",
        paragraph(_GOOD)
        + table(caption, _HEADERS, [_row(loop, values.begin) for loop in largest])
        + paragraph(words, "note"),
    )


def _row(loop: Loop, begin: float) -> Row:
    cells = [
        length(float(np.hypot(*loop.shift[:2]))),
        degrees(float(loop.shift[2])),
        loop.method,
        str(loop.pairs),
        length(loop.residual),
        f"{100.0 * loop.overlap:.0f} %",
        f"{loop.runner_up:.2f}",
    ]
    return Row(
        f"{clock(loop.earlier_stamp - begin)} → {clock(loop.later_stamp - begin)}", [Cell(cell) for cell in cells]
    )
