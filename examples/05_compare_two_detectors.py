"""The paper's experiment in small: two drives through a furnished room, each replayed through two detectors."""

import matplotlib.pyplot as plt

from contourslam.experiments.compare import compare
from contourslam.experiments.replays import MODES
from contourslam.simulation.config import SimulationConfig
from contourslam.simulation.rooms import ROOMS


def main() -> None:
    outcome = compare(
        ROOMS["furnished_room"],
        seeds=[1, 2],
        detectors=["matched_filter", "teh_chin"],
        simulation=SimulationConfig(duration=20.0),
    )
    _, axes = plt.subplots(figsize=(8.0, 3.5), layout="constrained")
    for mode, colour in zip(MODES, ("tab:orange", "tab:blue"), strict=True):
        for name, metrics in outcome.table(mode).items():
            rmse = {coordinate: metrics["rmse"][coordinate]["mean"] for coordinate in ("x", "y", "theta")}
            print(
                f"{name:<16}{mode:<9}RMSE x {rmse['x']:.4f} m, y {rmse['y']:.4f} m, heading {rmse['theta']:.4f} rad; "
                f"NEES {metrics['nees']['mean']:.1f}, false negatives {metrics['fnr']['mean']:.0%}"
            )
            axes.barh(f"{name.replace('_', ' ')}, {mode}", 1e3 * max(rmse["x"], rmse["y"]), color=colour)
    axes.set(xlabel="RMSE of the position, mm: the larger of x and y")
    plt.show()


if __name__ == "__main__":
    main()
