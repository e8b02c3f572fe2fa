"""The paper's experiment over ten seeds, as ``contourslam compare --seeds 10`` runs it."""

import json
import sys
import tempfile
from pathlib import Path
from typing import Any

from contourslam.cli import main as contourslam
from table import Table, publish

ARGUMENTS = ("compare", "--seeds", "10", "--room", "furnished_room", "--no-noise-sweep", "--no-details")


def row(name: str, landmarks: str, found: dict[str, Any], paper: dict[str, float]) -> list[object]:
    """Give one detector's figures beside the paper's."""
    rmse = [f"{value['mean']:.4f} ± {value['sd']:.4f}" for value in found["rmse"].values()]
    inside = min(found["inside_two_sigma"].values())
    printed = " / ".join(f"{value:g}" for value in paper.values())
    return [name, landmarks, *rmse, printed, found["nees"], inside, found["fnr"], found["scans_per_second"]]


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        code = contourslam([*ARGUMENTS, "--output", f"{folder}/report"])
        if code:
            sys.exit(code)
        metrics = json.loads((Path(folder) / "report" / "metrics.json").read_text())
    rows = []
    for landmarks, detectors in (
        ("corners only", metrics["detectors"]),
        ("with walls", metrics["with_walls"]["detectors"]),
    ):
        rows += [row(name, landmarks, found, metrics["paper"][name]["rmse"]) for name, found in detectors.items()]
    columns = ["detector", "landmarks", "x", "y", "heading", "paper x / y / heading", "NEES", "inside 2σ"]
    publish(Table("compare", [*columns, "false negatives", "scans/s"], rows))


if __name__ == "__main__":
    main()
