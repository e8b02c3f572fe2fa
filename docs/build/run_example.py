"""Run an example and keep its figure: ``run_example.py EXAMPLE PICTURE``."""

import runpy
import sys
from pathlib import Path


def main(example: str, picture: str) -> None:
    """Run it as a script, and save the one figure that is open when it ends."""
    sys.argv = [example]
    runpy.run_path(example, run_name="__main__")

    import matplotlib.pyplot as plt

    from contourslam.report.figures.save import save_figure

    (number,) = plt.get_fignums()
    save_figure(plt.figure(number), Path(picture))


if __name__ == "__main__":
    main(*sys.argv[1:])
