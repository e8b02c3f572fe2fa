"""Every figure that runs have to give."""

import re
from collections.abc import Iterator, Sequence

import numpy as np
from matplotlib.figure import Figure

from contourslam.report.figures.paper_errors import (
    differences_figure,
    distribution_figure,
    nis_figure,
    relation_figure,
    truth_figure,
)
from contourslam.report.figures.paper_maps import map_figure, ways_figure
from contourslam.report.runs_groups import Group
from contourslam.report.runs_reading import JudgedRun


def figures_of(groups: Sequence[Group], width: float) -> Iterator[tuple[str, Figure]]:
    """Draw one figure after the other, each with the name for its file.

    Parameters
    ----------
    groups : sequence of Group
    width : float
        Inches.
    """
    many = sum(len(group.runs) for group in groups) > 1
    for number, group in enumerate(groups, start=1):
        for run in group.runs:
            prefix = f"{_file(run.name)}_" if many else ""
            for name, figure in _of_run(run, width):
                yield prefix + name, figure
        suffix = f"_{number}" if len(groups) > 1 else ""
        for name, figure in _of_group(group, width):
            yield name + suffix, figure


def _file(name: str) -> str:
    return re.sub(r"[^\w.-]+", "_", name)


def _of_run(run: JudgedRun, width: float) -> Iterator[tuple[str, Figure]]:
    result, judged = run.result, run.relations
    yield "map", map_figure(result, width=width)
    if run.position_errors is not None:
        yield "errors", truth_figure(result, aligned=run.aligned, width=width)
    if judged is not None and len(judged.stamps):
        errors = {"estimate" if judged.online is None else "refined": judged.estimate.translation}
        if judged.online is not None:
            errors["online"] = judged.online.translation
        errors["raw odometry"] = judged.odometry.translation
        yield "relations", relation_figure(judged.stamps[:, 1] - result.stamps.min(), errors, width=width)
    if _corrected(run):
        yield "nis", nis_figure({run.name: result}, width=width)


def _corrected(run: JudgedRun) -> bool:
    return bool(((run.result.nis_dof > 0) & np.isfinite(run.result.nis)).any())


def _of_group(group: Group, width: float) -> Iterator[tuple[str, Figure]]:
    relations = {run.name: run.relations.estimate.translation for run in group.runs if run.relations is not None}
    positions = {run.name: errors for run in group.runs if (errors := run.position_errors) is not None}
    if relations:
        yield "relation_errors", distribution_figure(relations, xlabel="relation error (m)", width=width)
        turns = {
            run.name: np.degrees(run.relations.estimate.rotation) for run in group.runs if run.relations is not None
        }
        label = "relation error, rotation (°)"
        yield "relation_turns", distribution_figure(turns, xlabel=label, least=1e-3, width=width)
    if positions:
        yield "position_errors", distribution_figure(positions, xlabel="position error (m)", width=width)
    if len(group.runs) > 1:
        ways = {run.name: group.moved(at) for at, run in enumerate(group.runs)}
        yield "trajectories", ways_figure(ways, group.runs[0].result.wall_map.end_points, width=width)
        apart = {name: (one.times, one.position, one.heading) for name, one in group.differences().items()}
        yield "differences", differences_figure(apart, width=width)
