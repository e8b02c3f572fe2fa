"""How to get these numbers again: command, configuration, versions, machine."""

from contourslam.experiments.study import Study
from contourslam.report.page.markup import Section, definitions, folded, heading, paragraph, verbatim
from contourslam.report.provenance import machine, software
from contourslam.settings_file import settings_text


def section(study: Study, command: str) -> Section:
    """Give the section; every study has it."""
    comparison = study.comparison
    lidar, noise = comparison.simulation.lidar, comparison.config.lidar.sigma_range
    terms = {
        "room": f"{comparison.room.name}: {comparison.room.description}",
        "seeds": ", ".join(str(seed.seed) for seed in comparison.seeds),
        "lidar": f"{lidar.samples_per_second / lidar.turn_rate:.0f} beams at {lidar.turn_rate:g} Hz, "
        f"{100 * noise:g} cm noise, {lidar.mount_x:g} m ahead of the axle",
        **software(),
        **machine(),
    }
    parts = [heading("Command"), verbatim(command)] if command else []
    parts += [
        heading("Run, versions and machine"),
        definitions(terms),
        heading("Configuration"),
        folded("Every setting of the pipeline that was used", verbatim(settings_text(comparison.config))),
        folded("Every setting of the simulation", verbatim(settings_text(comparison.simulation))),
        paragraph("metrics.json beside this page holds every number, figures/ the figures as files.", "note"),
    ]
    return Section("reproduce", "Reproduce this", "\n".join(parts))
