"""Each detector's own figures: map, errors with their bounds, landmarks seen and missed (the paper's Figs. 5 to 7)."""

from contourslam.experiments.replays import MODES, Mode
from contourslam.experiments.study import Study
from contourslam.report.figures.errors import error_figure
from contourslam.report.figures.landmarks import landmark_figure
from contourslam.report.figures.style import label
from contourslam.report.figures.world import world_figure
from contourslam.report.page.common import MODE_NAMES, Gallery
from contourslam.report.page.markup import Picture, Section, pair, paragraph
from contourslam.slam.result import RunResult


def sections(study: Study, gallery: Gallery) -> list[Section]:
    """Give a section for each detector that has a run of the first seed."""
    comparison = study.comparison
    found = []
    for name in comparison.detectors:
        runs = [(mode, run) for mode in MODES if (run := comparison.first(name, mode)) is not None and len(run.stamps)]
        if runs:
            pictures = [*_maps(study, gallery, runs), *_errors(gallery, runs), *_landmarks(gallery, runs)]
            words = f"The drive of seed {comparison.seeds[0].seed}: corners only, and corners with walls."
            title = label(name)[0].upper() + label(name)[1:]
            found.append(Section(f"detector-{name}", title, paragraph(words) + pair(pictures)))
    return found


def _maps(study: Study, gallery: Gallery, runs: list[tuple[Mode, RunResult]]) -> list[Picture]:
    room, height = study.comparison.room, study.comparison.simulation.lidar.mount_height
    segments, circles = room.segments(height), room.circles(height)
    pictures = []
    for mode, run in runs:
        title = f"{label(run.detector)}, {MODE_NAMES[mode]}"
        size = f"{len(run.corner_map.ids)} corners, {len(run.wall_map.ids)} walls"
        drawn = world_figure(run, segments=segments, circles=circles, title=title)
        caption = f"Map of {size} over the true room (the paper's Fig. 5)."
        pictures.append(
            gallery.add(f"map_{run.detector}_{mode}", drawn, alt=f"Map by {title}: {size}", caption=caption)
        )
    return pictures


def _errors(gallery: Gallery, runs: list[tuple[Mode, RunResult]]) -> list[Picture]:
    return [
        gallery.add(
            f"errors_{run.detector}_{mode}",
            error_figure(run),
            alt=f"Errors of x, y and heading over time with their bounds, {label(run.detector)}, {MODE_NAMES[mode]}",
            caption=f"Error of the pose and the filter's ±2σ bounds, {MODE_NAMES[mode]} (Fig. 6).",
        )
        for mode, run in runs
        if run.truth is not None
    ]


def _landmarks(gallery: Gallery, runs: list[tuple[Mode, RunResult]]) -> list[Picture]:
    pictures = []
    for mode, run in runs:
        corners = run.corner_map
        if len(corners.ids):
            rate = corners.failed.sum() / max(int((corners.failed + corners.observed).sum()), 1)
            pictures.append(
                gallery.add(
                    f"landmarks_{run.detector}_{mode}",
                    landmark_figure(run.detector, corners.observed, corners.failed),
                    alt=f"Bars of how often each of {len(corners.ids)} corners was seen and missed; {rate:.1%} missed",
                    caption=f"How often each mapped corner was seen (o) and missed (f), {MODE_NAMES[mode]} (Fig. 7).",
                )
            )
    return pictures
