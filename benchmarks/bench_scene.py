"""How true the 3-D scene of the furnished room is, and what it costs."""

import numpy as np

from contourslam.experiments.scene_accuracy import scene_accuracy
from contourslam.scene.atlas import pack
from contourslam.scene.glb import to_glb
from contourslam.simulation.config import SimulationConfig
from contourslam.simulation.rooms import FURNISHED_ROOM
from table import Table, publish

SEEDS = (0, 1, 2)
SECONDS, RATE = 100.0, 1.0  # of the drive, s; pictures per second


def main() -> None:
    rows = []
    for seed in SEEDS:
        found = scene_accuracy(FURNISHED_ROOM, seed, config=SimulationConfig(duration=SECONDS), rate=RATE)
        scene = found.scene
        parts = [scene.seen_part(index) for index in range(len(scene.surfaces))]
        size = len(to_glb(scene.surfaces, pack(list(scene.textures)), parts))
        walls = [surface.colour_error for surface in found.surfaces if surface.name.startswith("wall")]
        rows.append(
            [
                str(seed),
                len(found.views.chosen),
                found.mean("colour_error"),
                float(np.median(walls)),
                found.mean("plain_error"),
                f"{1000.0 * found.mean('offset'):.0f} mm",
                f"{found.mean('astray'):.1%}",
                f"{scene.share('wall') or 0.0:.1%}",
                f"{scene.share('floor') or 0.0:.1%}",
                f"{size / 1e6:.2f} MB",
                f"{found.seconds:.0f} s",
            ]
        )
    columns = [
        *(
            "seed",
            "pictures",
            "colour error of walls and furniture, of 255",
            "median wall",
            "one colour for each instead",
        ),
        *(
            "distance from the true surface",
            "coloured where nothing is",
            "walls seen",
            "floor seen",
            "scene.glb",
            "CPU",
        ),
    ]
    publish(Table("scene", columns, rows))


if __name__ == "__main__":
    main()
