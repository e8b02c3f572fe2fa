"""The scene of a simulated room against what was painted on it."""

import numpy as np

from contourslam.experiments.scene_accuracy import scene_accuracy
from contourslam.scene.raising import SceneOptions
from contourslam.simulation.config import SimulationConfig
from contourslam.simulation.rooms import FURNISHED_ROOM


def test_a_drive_through_part_of_the_room_gives_walls_in_their_own_colours():
    config = SimulationConfig(duration=12.0)
    found = scene_accuracy(FURNISHED_ROOM, 0, config=config, rate=1.0, options=SceneOptions(height=2.4, texel=0.04))
    walls = [surface for surface in found.surfaces if surface.name.startswith("wall")]
    assert len(walls) >= 8
    assert found.mean("colour_error") < 15.0 and found.mean("colour_error") < 0.8 * found.mean("plain_error")
    assert np.median([wall.colour_error for wall in walls]) < 13.0
    assert found.mean("offset") < 0.02
    assert found.mean("astray") < 0.2
