"""Every figure that runs have to give."""

import re
from collections.abc import Iterator, Sequence
from itertools import count

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
    prefixes = iter(_prefixes([run.name for group in groups for run in group.runs]))
    for number, group in enumerate(groups, start=1):
        for run in group.runs:
            prefix = next(prefixes)
            for name, figure in _of_run(run, width):
                yield prefix + name, figure
        suffix = f"_{number}" if len(groups) > 1 else ""
        for name, figure in _of_group(group, width):
            yield name + suffix, figure


def _prefixes(names: Sequence[str]) -> list[str]:
    """Give each run's name as the beginning of a file's, numbered where it would be another's; none for one run."""
    if len(names) == 1:
        return [""]
    found = ["relation_", "position_"]  # a run's "errors" would be those of all
    for name in names:
        plain = re.sub(r"[^\w.-]+", "_", name)
        tried = (f"{plain}_{number}_" if number > 1 else f"{plain}_" for number in count(1))
        taken = [prefix.lower() for prefix in found]
        found.append(next(prefix for prefix in tried if prefix.lower() not in taken))
    return found[2:]


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
    for errors in group.errors():
        yield errors.name, distribution_figure(errors, width=width)
    if len(group.runs) > 1:
        ways = {run.name: group.moved(at) for at, run in enumerate(group.runs)}
        yield "trajectories", ways_figure(ways, group.runs[0].result.wall_map.end_points, width=width)
        apart = {name: (one.times, one.position, one.heading) for name, one in group.differences().items()}
        yield "differences", differences_figure(apart, width=width)
