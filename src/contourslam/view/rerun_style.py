"""How a Rerun file looks when it is opened: colours and widths, and which views there are."""

from collections.abc import Sequence

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from contourslam.contour.contours import Floats
from contourslam.view.rerun_file import SCAN, STAMP, RerunFile
from contourslam.view.rerun_rows import turned

CONTOURS = (
    0x4E9BE0FF, 0xE8A33DFF, 0x3FB58AFF, 0xE06A50FF, 0xB57EDCFF, 0x8FB339FF, 0xD96BA8FF, 0x5AC8D8FF, 0xC9A66BFF,
)  # fmt: skip
"""Colours of neighbouring contours, in turn."""
SHADES = (0x4B2F8AFF, 0x6A3FA0FF, 0x8F4AA8FF, 0xB4559FFF, 0xD5688CFF, 0xEE8375FF, 0xF9A863FF, 0xFCCF5FFF, 0xF7F06AFF)
"""Of a response, from none to the threshold and beyond."""
LANES = (0x3D9BE9FF, 0xF0A030FF, 0x5CC26BFF, 0xB98CF0FF)
TRUTH, RAW, LOOP, GOOD, BAD = 0x4CAF50FF, 0xC08457FF, 0xE86AB5FF, 0x3FBF6FFF, 0xF0625AFF
WALL, CONVEX, CONCAVE, OLD, DIM, PALE = 0x9FB6CCFF, 0xF08A3CFF, 0xF4C542FF, 0x56616CFF, 0x35506BFF, 0x707C8AFF
RING = rr.components.FillMode.MajorWireframe
_BEGINNING = rrb.TimeRangeBoundary.infinite()
_NOW = rrb.TimeRangeBoundary.cursor_relative()


def set_style(file: RerunFile, names: Sequence[str]) -> None:
    """Say once and for all how each entity is drawn."""
    ids = [(i, None, colour) for i, colour in enumerate((*CONTOURS, *SHADES))]
    kinds = (("seen", GOOD), ("missed", BAD), ("convex", CONVEX), ("concave", CONCAVE))
    classes = [rr.AnnotationInfo(id=i, label=label, color=colour) for i, label, colour in ids]
    classes += [rr.AnnotationInfo(id=turned(kind), label=kind, color=colour) for kind, colour in kinds]
    file.fix("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP)
    file.fix("world", rr.AnnotationContext(classes))
    lines, points, ellipses = rr.LineStrips3D.from_fields, rr.Points3D.from_fields, rr.Ellipsoids3D.from_fields
    width = rr.components.Radius.ui_points

    file.fix("world/odometry", lines(colors=RAW, radii=width(0.8)))
    file.fix("world/truth", lines(colors=TRUTH, radii=width(0.8)))
    for number, name in enumerate(names):
        place, colour = f"world/{name}", LANES[number % len(LANES)]
        file.fix(f"{place}/trajectory", lines(colors=colour, radii=width(1.2)))
        file.fix(f"{place}/uncertainty", ellipses(colors=colour, line_radii=width(1.0), fill_mode=RING))
        arrow = np.array([[0.35, 0.0, 0.0], [-0.2, 0.2, 0.0], [-0.1, 0.0, 0.0], [-0.2, -0.2, 0.0], [0.35, 0.0, 0.0]])
        file.fix(f"{place}/robot/body", rr.LineStrips3D([arrow], colors=colour, radii=width(1.8)))
        file.fix(f"{place}/robot/lidar/scan", points(radii=width(2.0)))
        file.fix(f"{place}/look/response", points(radii=width(1.5)))
        file.fix(f"{place}/look/candidates", points(colors=BAD, radii=width(4.0)))
        file.fix(f"{place}/look/corners", points(colors=GOOD, radii=width(3.0)))
        file.fix(f"{place}/look/associations", lines(radii=width(0.7), show_labels=False))
        file.fix(f"{place}/map/corners", points(radii=width(3.0), show_labels=False))
        file.fix(f"{place}/map/ellipses", ellipses(colors=CONVEX, line_radii=width(0.6), fill_mode=RING))
        file.fix(f"{place}/map/walls", lines(colors=WALL, radii=width(1.2)))
        file.fix(f"{place}/map/loops", lines(colors=LOOP, radii=width(0.7)))
        file.fix(f"{place}/final/walls", lines(colors=OLD, radii=width(0.6)))
        file.fix(f"{place}/final/trajectory", lines(colors=DIM, radii=width(0.5)))
        for what in ("nis", "sigma", "error"):
            file.fix(f"plots/{what}/{name}", rr.SeriesLines(colors=colour, names=name))
        bounds = rr.SeriesLines(colors=[PALE, PALE], names=["95 %, lower", "95 %, upper"])
        file.fix(f"plots/nis/{name}/bounds", bounds)


def lay_out(file: RerunFile, names: Sequence[str], middle: Floats, half: float, *, truth: bool) -> None:
    """Place the views; the map is seen from above.

    Parameters
    ----------
    file : RerunFile
    names : sequence of str
        Of the lanes.
    middle : ndarray, shape (2,)
        What the map view looks at, m.
    half : float
        Half of what it spans, m.
    truth : bool
        Whether the true poses are known.
    """
    high = half * (4.0 if len(names) == 2 else 2.4)  # two stand side by side, and are narrow
    maps = [_map_view(name, middle, high) for name in names]
    scans = [_scan_view(name) for name in names]
    plots = [
        rrb.TimeSeriesView(origin="plots/nis", name="NIS / degrees of freedom"),
        rrb.TimeSeriesView(origin="plots/sigma", name="sigma of the position (m)"),
        *([rrb.TimeSeriesView(origin="plots/error", name="error of the position (m)")] if truth else []),
    ]
    more = rrb.Tabs(
        rrb.TextLogView(origin="log", name="loops, and what was skipped"),
        *[rrb.TimeSeriesView(origin=f"plots/stages/{name}", name=f"ms per scan, {name}") for name in names],
    )
    scan = rrb.Tabs(*scans) if len(scans) > 1 else scans[0]
    beside = rrb.Vertical(scan, *plots, more, row_shares=[2.4, *[1.0] * len(plots), 1.2])
    blueprint = rrb.Blueprint(
        rrb.Horizontal(rrb.Grid(*maps) if len(maps) > 1 else maps[0], beside, column_shares=[1.7, 1.0]),
        rrb.TimePanel(state="collapsed", timeline=STAMP),
        collapse_panels=True,
    )
    file.lay_out(blueprint)


def _map_view(name: str, middle: Floats, high: float) -> rrb.Spatial3DView:
    x, y = (float(value) for value in middle)
    so_far = rrb.VisibleTimeRanges(
        [rrb.VisibleTimeRange(timeline, start=_BEGINNING, end=_NOW) for timeline in (STAMP, SCAN)]
    )
    ways = (f"world/{name}/trajectory", "world/odometry", "world/truth")
    return rrb.Spatial3DView(
        origin="world",
        name=f"map, {name}",
        contents=[f"+ /world/{name}/**", "+ /world/odometry", "+ /world/truth", f"- /world/{name}/look/response/**"],
        overrides={way: [so_far] for way in ways},
        eye_controls=rrb.EyeControls3D(
            kind=rrb.Eye3DKind.Orbital, position=(x, y, high), look_target=(x, y, 0.0), eye_up=(0.0, 1.0, 0.0)
        ),
        line_grid=False,
    )


def _scan_view(name: str) -> rrb.Spatial3DView:
    return rrb.Spatial3DView(
        origin=f"world/{name}/robot",
        name=f"scan and responses, {name} (height: response / threshold)",
        contents=[f"+ /world/{name}/robot/**", f"+ /world/{name}/look/**", f"+ /world/{name}/map/corners"],
        eye_controls=rrb.EyeControls3D(
            kind=rrb.Eye3DKind.Orbital, position=(-7.0, 0.0, 7.0), look_target=(2.5, 0.0, 0.0), eye_up=(0.0, 0.0, 1.0)
        ),
        line_grid=False,
    )
