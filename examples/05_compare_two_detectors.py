"""The paper's experiment in small: two drives through a furnished room, each replayed through two detectors."""

from contourslam.experiments.compare import compare
from contourslam.simulation.config import SimulationConfig
from contourslam.simulation.rooms import ROOMS


def main() -> None:
    outcome = compare(
        ROOMS["furnished_room"],
        seeds=[1, 2],
        detectors=["matched_filter", "teh_chin"],
        simulation=SimulationConfig(duration=20.0),
    )
    for mode in ("corners", "walls"):
        for name, metrics in outcome.table(mode).items():
            rmse = {coordinate: metrics["rmse"][coordinate]["mean"] for coordinate in ("x", "y", "theta")}
            print(
                f"{name:<16}{mode:<9}RMSE x {rmse['x']:.4f} m, y {rmse['y']:.4f} m, heading {rmse['theta']:.4f} rad; "
                f"NEES {metrics['nees']['mean']:.1f}, false negatives {metrics['fnr']['mean']:.0%}"
            )


if __name__ == "__main__":
    main()
