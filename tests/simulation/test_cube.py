"""Every ray of a lens falls on a face of the cube, where that face is drawn."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from contourslam.simulation.cube import cube_faces


@given(st.floats(20.0, 175.0), st.integers(16, 700))
def test_a_ray_is_found_again_from_its_place_on_the_sheet(widest_deg: float, pixels: int) -> None:
    chance = np.random.default_rng(0)
    angle, turn = np.radians(widest_deg) * np.sqrt(chance.random(400)), 2 * np.pi * chance.random(400)
    rays = np.stack([np.sin(angle) * np.cos(turn), np.sin(angle) * np.sin(turn), np.cos(angle)], axis=1)
    seen = chance.random(400) < 0.9
    faces, at = cube_faces(rays, seen, pixels)
    left = [face.left for face in faces]
    found = np.zeros((400, 3))
    for k, place in enumerate(at):
        face = faces[int(np.searchsorted(left, place[0], side="right")) - 1]
        # A pixel and its neighbours, between which is looked up, are within their face.
        assert face.left <= place[0] <= face.left + face.columns - 1 or not seen[k]
        assert 0 <= place[1] <= face.rows - 1
        half = (face.top - face.bottom) / face.rows * face.columns / 2
        x = face.middle - half + (place[0] - face.left + 0.5) / face.columns * 2 * half
        y = face.bottom + (place[1] + 0.5) / face.rows * (face.top - face.bottom)
        found[k] = face.axes @ [x, y, 1.0]
    found /= np.linalg.norm(found, axis=1, keepdims=True)
    np.testing.assert_allclose(found[seen], rays[seen], atol=1e-9)


@pytest.mark.parametrize(("widest_deg", "count"), [(40.0, 1), (110.0, 5), (170.0, 6)])
def test_no_face_is_drawn_that_the_lens_does_not_see(widest_deg: float, count: int) -> None:
    angle, turn = np.meshgrid(np.radians(np.linspace(0.0, widest_deg, 60)), np.linspace(0.0, 2 * np.pi, 90))
    rays = np.stack([np.sin(angle) * np.cos(turn), np.sin(angle) * np.sin(turn), np.cos(angle)], axis=-1).reshape(-1, 3)
    faces, _ = cube_faces(rays, np.ones(len(rays), dtype=bool), 100)
    assert len(faces) == count
    for face in faces:
        np.testing.assert_allclose(face.axes.T @ face.axes, np.eye(3))
        np.testing.assert_allclose(np.cross(face.axes[:, 0], face.axes[:, 1]), -face.axes[:, 2])
