"""Figures of the theory pages: each function ``figure_NAME`` draws ``figures/NAME.svg`` with the project's own code.

python docs/theory/figures.py FOLDER [NAME ...]
"""

import sys
from collections.abc import Callable
from pathlib import Path

from matplotlib.figure import Figure

sys.path.insert(0, str(Path(__file__).parent))  # also where this file is run by its path

from drawings import contours, detectors, filter, graph, landmarks, localization, matching, motion

FIGURES: dict[str, Callable[[], Figure]] = {
    name.removeprefix("figure_"): function
    for module in (contours, detectors, landmarks, motion, filter, matching, graph, localization)
    for name, function in vars(module).items()
    if name.startswith("figure_")
}
"""Name to function."""

globals().update({f"figure_{name}": function for name, function in FIGURES.items()})


def main(folder: Path, names: list[str]) -> None:
    """Draw the figures of these names, or all."""
    from contourslam.report.figures.save import save_figure

    folder.mkdir(parents=True, exist_ok=True)
    for name in names or FIGURES:
        save_figure(FIGURES[name](), folder / f"{name}.svg")


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
