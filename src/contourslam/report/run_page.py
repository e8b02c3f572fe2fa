"""The page of one run: a single file that opens offline, its figures inside."""

from pathlib import Path
from typing import Any

from contourslam import __version__
from contourslam.atomic import make_folder, remove, write_text
from contourslam.config import Config
from contourslam.evaluation.relations import JudgedRelations
from contourslam.report.page import album
from contourslam.report.page.markup import page
from contourslam.report.page.run import building, loops, matching, reproduce, timings, truth
from contourslam.report.page.run import relations as known
from contourslam.report.page.run.headline import headline, lead
from contourslam.report.page.run.values import RunValues
from contourslam.report.relation_table import write_relation_table
from contourslam.slam.result import RunResult

_INCOMPLETE = "INCOMPLETE: the run was stopped early, or its recording is damaged; this page shows what was done."


def write_run_page(
    folder: Path,
    result: RunResult,
    config: Config,
    metrics: dict[str, Any],
    relations: JudgedRelations | None = None,
    *,
    command: str = "",
    name: str = "",
) -> None:
    """Write ``index.html`` and, where relations are given, ``relation_errors.csv``.

    Parameters
    ----------
    folder : Path
        The result folder; made where needed.
    result : RunResult
        The run, of one scan or more.
    config : Config
        The configuration it really used.
    metrics : dict
        Of :func:`contourslam.evaluation.metrics.run_metrics`. A text under "back_end_reason" is shown as the reason
        for the back end.
    relations : JudgedRelations, optional
        Its errors against known relative poses.
    command : str
        The command line, shown as it stands.
    name : str
        Title of the page; the folder's name where left out.

    Raises
    ------
    ResultError
        If a file cannot be written.
    """
    make_folder(folder)
    if relations is None:
        remove(folder / "relation_errors.csv")  # an earlier run's would not belong to this one
    else:
        write_relation_table(folder / "relation_errors.csv", relations)
    values = RunValues(result, config, metrics, relations, command)
    parts = [
        building.section(values),
        known.section(values),
        truth.section(values),
        matching.section(values),
        loops.section(values),
        timings.section(values),
        reproduce.section(values),
    ]
    text = page(
        name or folder.resolve().name,
        lead=lead(values),
        summary=headline(values),
        sections=[part for part in parts if part is not None],
        footer=f"Written by contourslam {__version__}.",
        banner="" if result.complete else _INCOMPLETE,
        scripts=album.SCRIPTS,
    )
    write_text(folder / "index.html", text)
