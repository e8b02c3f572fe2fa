"""Normalised errors of the relative poses that contour matching gives in simulated buildings; ideally 3 in mean."""

from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np

from contourslam.config import Config
from contourslam.experiments.match_consistency import (
    Message,
    RelativeErrors,
    bare_corridor,
    keyframe_errors,
    narrowed,
    tie_errors,
)
from contourslam.simulation.long_drive import BUILDING_LIDAR, building_drive
from table import Table, publish

LENGTH, SEEDS = 300.0, 3
LIDARS: tuple[tuple[str, float, Callable[[Iterable[Message]], Iterable[Message]]], ...] = (
    ("360°, 1 cm", 0.01, lambda messages: messages),
    ("180°, 1 cm", 0.01, narrowed),
    ("360°, 3 cm", 0.03, lambda messages: messages),
    ("180°, 3 cm", 0.03, narrowed),
)


def row(where: str, lidar: str, what: str, found: RelativeErrors) -> tuple[object, ...]:
    """One line of the table."""
    values, rms = found.nees, np.sqrt((found.errors**2).mean(axis=0))
    return (
        where,
        lidar,
        what,
        len(values),
        f"{values.mean():.2f}",
        " / ".join(f"{value:.2f}" for value in found.by_axis),
        " / ".join(f"{value:.1f}" for value in np.percentile(values, (50, 90, 99))),
        f"{1000 * rms[0]:.1f} / {1000 * rms[1]:.1f} / {np.degrees(rms[2]):.2f}",
    )


def main() -> None:
    config = Config()
    rows = []
    for lidar, sigma, change in LIDARS:
        for seed in range(SEEDS):
            drive = building_drive(LENGTH, seed, lidar=replace(BUILDING_LIDAR, sigma_range=sigma))
            messages = list(change(drive.messages()))
            where = f"building {seed}"
            rows.append(row(where, lidar, "keyframe", keyframe_errors(messages, config, drive.lidar_mount)))
            rows.append(row(where, lidar, "tie", tie_errors(messages, config, drive.lidar_mount)))
    runs = [keyframe_errors(bare_corridor(30.0, s), config, np.zeros(3), wheels_too=True) for s in range(10)]
    corridor = RelativeErrors(
        np.concatenate([run.errors for run in runs]), np.concatenate([run.covariances for run in runs])
    )
    rows.append(row("bare corridor", "360°, 1 cm", "keyframe, with wheels", corridor))
    columns = (
        "where",
        "lidar",
        "relative pose",
        "number",
        "NEES, ideally 3",
        "forward / left / heading, ideally 1",
        "NEES, 50 / 90 / 99 %, ideally 2.4 / 6.3 / 11.3",
        "rms error, mm / mm / °",
    )
    publish(Table("matching", columns, rows))


if __name__ == "__main__":
    main()
