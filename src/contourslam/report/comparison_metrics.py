"""The ``metrics.json`` of a comparison.

``detectors.NAME`` (corners only) and ``with_walls.detectors.NAME`` hold per detector: ``rmse.x``, ``rmse.y`` (m) and
``rmse.theta`` (rad), each with ``mean``, ``sd`` and ``n`` over the seeds; ``nees``, ``fnr``, ``scans_per_second`` and
``inside_two_sigma.x|y|theta`` as means over the seeds; and in ``all`` everything of
:mod:`contourslam.evaluation.metrics`, again with mean, sd and n. ``odometry`` and ``cramer_rao`` stand beside them, and
``paper`` has Table I. ``noise``, ``refinement`` and ``adaptation`` are the further experiments, ``runs`` all runs.
"""

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from contourslam.evaluation.metrics import Metrics
from contourslam.experiments.adaptation import Adaptation
from contourslam.experiments.compare import Comparison
from contourslam.experiments.noise import NoiseSweep
from contourslam.experiments.refinement import Refinement
from contourslam.experiments.replays import MODES, Mode
from contourslam.experiments.study import Study
from contourslam.report.paper import TABLE_I
from contourslam.report.provenance import machine, software


def mean(value: Any) -> float | None:
    """Mean of an aggregated number, None where it is not known."""
    return value.get("mean") if isinstance(value, dict) else None


def comparison_metrics(study: Study, *, command: str = "") -> dict[str, Any]:
    """Collect everything a study measured, by the schema of this module.

    Parameters
    ----------
    study : Study
    command : str
        The command line.

    Returns
    -------
    dict
        For :func:`contourslam.report.result_folder.to_json`.
    """
    comparison = study.comparison
    metrics: dict[str, Any] = {
        **software(),
        "machine": machine(),
        "command": command,
        "complete": study.complete,
        "room": comparison.room.name,
        "simulation": asdict(comparison.simulation),
        "config": asdict(comparison.config),
        "seeds": [seed.seed for seed in comparison.seeds],
        "detectors": _detectors(comparison, "corners"),
        "with_walls": {"detectors": _detectors(comparison, "walls")},
        "odometry": {"rmse": shared(comparison, "odometry_rmse")},
        "cramer_rao": shared(comparison, "cramer_rao"),
        "paper": {name: {"rmse": values} for name, values in TABLE_I.items()},
    }
    if study.noise is not None:
        metrics["noise"] = _noise(study.noise, comparison.detectors)
    if study.refinement is not None:
        metrics["refinement"] = _refinement(study.refinement)
    if study.adaptation is not None:
        metrics["adaptation"] = _adaptation(study.adaptation, comparison.detectors)
    metrics["runs"] = [
        {
            "seed": seed.seed,
            **{mode: {v.detector: run for v, run in seed.metrics.items() if v.mode == mode} for mode in MODES},
        }
        for seed in comparison.seeds
    ]
    return metrics


def shared(comparison: Comparison, key: str) -> Metrics | None:
    """Give what does not depend on the detector, such as raw odometry's error, from whichever has most runs."""
    tables = [table for mode in MODES for table in comparison.table(mode).values() if table.get(key)]
    return max(tables, key=lambda table: int(table["scans"]["n"]))[key] if tables else None


def _detectors(comparison: Comparison, mode: Mode) -> dict[str, Metrics]:
    return {
        name: {
            "rmse": table.get("rmse"),
            "nees": mean(table.get("nees")),
            "fnr": mean(table.get("fnr")),
            "scans_per_second": mean(table.get("scans_per_second")),
            "inside_two_sigma": {key: mean(value) for key, value in (table.get("inside_two_sigma") or {}).items()},
            "all": table,
        }
        for name, table in comparison.table(mode).items()
    }


def _noise(sweep: NoiseSweep, detectors: Sequence[str]) -> Metrics:
    curves = {name: sweep.rmse(name).T for name in detectors}
    return {
        "levels": sweep.levels,
        "rmse": {name: dict(zip(("x", "y", "theta"), rows, strict=True)) for name, rows in curves.items()},
    }


def _refinement(refinement: Refinement) -> Metrics:
    return {
        name: {
            "raw": {"rmse": refinement.raw[name]["rmse"], "corner_rms_error": score.raw_rms_error},
            "refined": {"rmse": refinement.refined[name]["rmse"], "corner_rms_error": score.rms_error},
            "precision": score.precision,
            "recall": score.recall,
            "repeatability": score.repeatability,
        }
        for name, score in refinement.scores.items()
    }


def _adaptation(adaptation: Adaptation, detectors: Sequence[str]) -> Metrics:
    pairs = {"faithful": adaptation.faithful, "adapted": adaptation.adapted}
    return {
        name: {kind: {key: runs[name][key] for key in ("rmse", "fnr")} for kind, runs in pairs.items() if name in runs}
        for name in detectors
    }
