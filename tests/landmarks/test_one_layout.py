from dataclasses import fields

import numpy as np

from contourslam.config import Config
from contourslam.detectors import make_detector
from contourslam.landmarks import detect


def test_landmarks_lie_in_memory_in_one_way_however_many_they_are(room, scan_of) -> None:
    """Else Numba compiles for each layout anew, when the first scan with a single corner comes in mid-drive."""
    seen: set[int] = set()
    for turn in np.linspace(0.0, 2.0 * np.pi, 60, endpoint=False):
        walls = room([[0.0, 0.0], [5.0, 0.0], [5.0, 4.0], [0.0, 4.0]])
        scan = scan_of(walls, (1.0, 1.0, turn), beams=180, start=-0.9, field_of_view=1.8, sigma=0.01)
        found = detect(scan, make_detector("matched_filter"), Config())
        seen |= {len(found.corners), len(found.walls.lines)}
        for part in (found.corners, found.walls):
            for field in fields(part):
                assert getattr(part, field.name).flags.c_contiguous, field.name
    assert {0, 1, 2} <= seen
