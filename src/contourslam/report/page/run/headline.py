"""The figures that one looks for first."""

from typing import Any

from contourslam.report.page.markup import tiles
from contourslam.report.page.run.values import BACK_ENDS, RunValues, clock, count, degrees, distance, length

Tile = tuple[str, str, str]


def lead(values: RunValues) -> str:
    """Say in a sentence what was mapped, by what, and how it turned out."""
    result, metrics = values.result, values.metrics
    time = float(result.stamps.max() - result.stamps.min())
    size = metrics["landmarks"]
    said = f"{count(len(result.stamps), 'scan')} over {length(distance(result))} and {clock(time)} min "
    landmarks = f"{count(size['corners'], 'corner')} and {count(size['walls'], 'wall')}"
    if result.back_end == "localization":
        said += f"were followed in a map of {landmarks}"
    else:
        said += f"became {landmarks}, by the {BACK_ENDS.get(result.back_end, result.back_end)} back end"
    reason = metrics.get("back_end_reason")
    said += f" ({reason})" if reason else ""
    said += f"; {count(len(result.loops), 'loop')} closed" if result.loops else ""
    return f"{said}."


def headline(values: RunValues) -> str:
    """Give the tiles."""
    metrics = values.metrics
    shown = [*_relations(metrics), *_truth(metrics)]
    if values.result.loops:
        farthest = max(float((loop.shift[0] ** 2 + loop.shift[1] ** 2) ** 0.5) for loop in values.result.loops)
        shown.append(
            (f"{len(values.result.loops):,}", "loops closed", f"the largest moved the pose by {length(farthest)}")
        )
    if metrics.get("quality") is not None:
        shown.append((f"{metrics['quality']:.2f}", "matching quality", "mean; 1 is the best"))
    if metrics.get("nis") is not None:
        beside = "of contours against wheels; small is good" if values.result.back_end == "graph" else "1 is ideal"
        shown.append((f"{metrics['nis']:.2f}", "NIS per degree of freedom", beside))
    if metrics.get("scans_per_second"):
        shown.append((f"{metrics['scans_per_second']:,.0f}", "scans a second", "on one core"))
    return tiles(shown)


def _relations(metrics: dict[str, Any]) -> list[Tile]:
    ours, raw, online = (metrics.get(name) for name in ("relations", "odometry_relations", "online_relations"))
    if not ours:
        return []
    tiles = []
    for part, name, text in (("translation", "relation error", length), ("rotation", "rotation error", degrees)):
        beside = f"mean; raw odometry {text(raw[part]['mean'])}" if raw else "mean"
        beside += f", online {text(online[part]['mean'])}" if online else ""
        tiles.append((text(ours[part]["mean"]), name, beside))
    return tiles


def _truth(metrics: dict[str, Any]) -> list[Tile]:
    ours, raw = metrics.get("rmse"), metrics.get("odometry_rmse") or {}
    if not ours:
        return []
    names = {"x": ("error in x", length), "y": ("error in y", length), "theta": ("error of the heading", degrees)}
    return [
        (text(ours.get(key)), name, f"RMS; raw odometry {text(raw.get(key))}") for key, (name, text) in names.items()
    ]
