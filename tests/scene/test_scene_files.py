"""What is written opens elsewhere and shows what it should."""

import io
import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from painted_room import HIGH, LENS, POSES, views_of
from PIL import Image

from contourslam.errors import MissingExtraError, ResultError
from contourslam.scene import extras, preview
from contourslam.scene.atlas import BORDER, LARGEST, pack
from contourslam.scene.build import build_scene
from contourslam.scene.glb import to_glb
from contourslam.scene.raising import SceneOptions
from contourslam.scene.render import look_at, panels, render
from contourslam.scene.store import write_scene
from contourslam.scene.surface import Surface, upright

VALIDATOR = Path(__file__).parents[1] / "validator"


@pytest.fixture(scope="module")
def scene(room, images):
    surfaces = tuple(painted.surface for painted in room if painted.surface.kind != "top")
    views = views_of(images[:6])
    return build_scene(surfaces, POSES, views, LENS, SceneOptions(height=HIGH, find_heights=False, texel=0.04)), views


@pytest.fixture(scope="module")
def glb(scene):
    built, _ = scene
    return to_glb(built.surfaces, pack(list(built.textures)), [built.seen_part(n) for n in range(len(built.surfaces))])


@given(st.lists(st.tuples(st.integers(1, 90), st.integers(1, 90)), min_size=1, max_size=12))
@settings(max_examples=40, deadline=None)
def test_textures_are_on_their_sheet_whole_and_apart(sizes):
    images = [np.full((*size, 3), n + 1, np.uint8) for n, size in enumerate(sizes)]
    atlas = pack(images)
    for n, (image, place) in enumerate(zip(images, atlas.places, strict=True)):
        sheet = atlas.sheets[place.sheet]
        top, left = place.row - BORDER, place.column - BORDER
        around = sheet[top : top + image.shape[0] + 2 * BORDER, left : left + image.shape[1] + 2 * BORDER]
        assert around.shape[:2] == (image.shape[0] + 2 * BORDER, image.shape[1] + 2 * BORDER)
        assert (around == n + 1).all()


def test_more_than_a_sheet_holds_goes_on_further_sheets():
    images = [np.full((1500, 3000, 3), n, np.uint8) for n in range(4)]
    atlas = pack(images)
    assert len(atlas.sheets) == 2
    assert max(max(sheet.shape) for sheet in atlas.sheets) <= LARGEST


def test_a_scene_passes_the_validator_of_khronos(glb, tmp_path):
    if shutil.which("node") is None or not (VALIDATOR / "node_modules" / "gltf-validator").is_dir():
        pytest.skip("node or gltf-validator is not here: npm ci --prefix tests/validator")
    path = tmp_path / "scene.glb"
    path.write_bytes(glb)
    done = subprocess.run(["node", VALIDATOR / "validate.js", path], capture_output=True, text=True, check=True)
    issues = json.loads(done.stdout)["issues"]
    assert [m for m in issues["messages"] if m["code"] != "IMAGE_NPOT_DIMENSIONS"] == []


def test_a_scene_says_its_names_and_stands_upright_in_metres(glb, scene):
    loaded = trimesh.load(io.BytesIO(glb), file_type="glb")
    names = {surface.name for surface in scene[0].surfaces}
    assert set(loaded.graph.nodes_geometry) == names
    low, high = loaded.bounds  # x as it is, y up, z is -y
    np.testing.assert_allclose([*low, *high], [0, 0, -3, 4, HIGH, 0], atol=0.05)
    wall = loaded.geometry["wall-0"]  # at y = 0, seen from inside, which is now towards -z
    np.testing.assert_allclose(wall.face_normals, [[0, 0, -1]] * 2, atol=1e-9)
    assert wall.metadata["kind"] == "wall" and 0.0 < wall.metadata["seen"] <= 1.0


def test_a_scene_shows_each_texture_the_right_way_round(glb, scene):
    built, _ = scene
    loaded = trimesh.load(io.BytesIO(glb), file_type="glb")
    for surface, texture in zip(built.surfaces, built.textures, strict=True):
        mesh = loaded.geometry[surface.name]
        sheet = np.asarray(mesh.visual.material.baseColorTexture).astype(float)
        for part in ((0.1, 0.1), (0.9, 0.2), (0.3, 0.9)):
            place = surface.at(part[0] * surface.width, part[1] * surface.height)[[0, 2, 1]] * [1, 1, -1]
            triangle = int(
                np.argmin(
                    [
                        np.linalg.norm(p - place)
                        for p in trimesh.triangles.closest_point(
                            mesh.triangles, np.tile(place, (len(mesh.triangles), 1))
                        )
                    ]
                )
            )
            weights = trimesh.triangles.points_to_barycentric(mesh.triangles[[triangle]], [place])[0]
            u, v = weights @ mesh.visual.uv[mesh.faces[triangle]]
            shown = sheet[int((1 - v) * sheet.shape[0]), int(u * sheet.shape[1])]
            row, column = int((1 - part[1]) * texture.shape[0]), int(part[0] * texture.shape[1])
            assert np.abs(shown - texture[row, column]).mean() < 20


def test_the_folder_holds_the_model_two_pictures_and_what_they_show(scene, tmp_path, monkeypatch):
    monkeypatch.setattr(preview, "_WIDTH", 350)
    monkeypatch.setattr(preview, "_HEIGHT", 225)
    built, views = scene
    about = write_scene(tmp_path / "scene", built, views, POSES)
    assert sorted(p.name for p in (tmp_path / "scene").iterdir()) == [
        "inside.png",
        "preview.png",
        "scene.glb",
        "scene.json",
    ]
    assert json.loads((tmp_path / "scene" / "scene.json").read_text()) == about
    assert about["bytes"] == (tmp_path / "scene" / "scene.glb").stat().st_size
    assert about["walls"] == 4 and about["pictures"] == {"recorded": 6, "without_pose": 0, "used": 6, "damaged": 0}
    picture = np.asarray(Image.open(tmp_path / "scene" / "preview.png"))
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 200


def test_a_folder_that_cannot_be_written_is_an_error(scene, tmp_path):
    (tmp_path / "scene").write_text("a file")
    with pytest.raises(ResultError):
        write_scene(tmp_path / "scene", *scene, POSES)


def frame(surface):
    return np.concatenate([surface.origin, surface.across, surface.up, [surface.width, surface.height]])


def coloured(colour):
    return np.array([[[*colour, 255]]], np.uint8)


def test_a_picture_shows_the_nearer_of_two_and_no_backs():
    far = upright("far", "wall", np.array([-2.0, 4.0]), np.array([2.0, 4.0]), 2.0)
    near = upright("near", "wall", np.array([-0.5, 2.0]), np.array([0.5, 2.0]), 2.0)
    back = upright("back", "wall", np.array([1.0, 1.5]), np.array([-1.0, 1.5]), 2.0)
    drawn = panels([(frame(s), coloured(c)) for s, c in ((near, (255, 0, 0)), (far, (0, 255, 0)), (back, (0, 0, 255)))])
    eye = look_at(np.array([0.0, 0.0, 1.0]), np.array([0.0, 5.0, 1.0]), 90.0, 80, 60)
    image = render(drawn, eye, (9, 9, 9))
    assert image[30, 40].tolist() == [255, 0, 0]
    assert image[30, 40 + 15].tolist() == [0, 255, 0]  # 15 of 40 pixels aside: 1.5 m at 4 m, 0.75 m at 2 m
    assert image[30, 40 + 25].tolist() == [9, 9, 9]
    assert not (image == [0, 0, 255]).all(axis=2).any()
    columns = np.flatnonzero((image[30] == [255, 0, 0]).all(axis=1))
    assert (columns[0], columns[-1]) == (30, 49)  # 0.5 m aside at 2 m


def test_a_picture_shows_a_texture_the_right_way_round():
    wall = upright("wall", "wall", np.array([-1.0, 2.0]), np.array([1.0, 2.0]), 2.0)
    corners = np.array([[[200, 0, 0, 255], [0, 200, 0, 255]], [[0, 0, 200, 255], [99, 99, 99, 255]]], np.uint8)
    image = render(
        panels([(frame(wall), corners)]),
        look_at(np.array([0.0, 0.0, 1.0]), np.array([0.0, 5.0, 1.0]), 90.0, 60, 60),
        (9, 9, 9),
    )
    assert image[17, 17].tolist() == [200, 0, 0] and image[17, 42].tolist() == [0, 200, 0]
    assert image[42, 17].tolist() == [0, 0, 200] and image[42, 42].tolist() == [99, 99, 99]


def test_a_picture_from_within_reaches_behind_the_eye():
    axes = np.eye(3)
    floor = Surface("floor-0", "floor", np.array([-5.0, -5.0, 0.0]), axes[0], axes[1], 10.0, 10.0)
    eye = look_at(np.array([0.0, 0.0, 1.0]), np.array([0.0, 5.0, 0.9]), 90.0, 80, 60)
    image = render(panels([(frame(floor), coloured((1, 2, 3)))]), eye, (9, 9, 9))
    assert (image[59] == [1, 2, 3]).all() and (image[0] == [9, 9, 9]).all()


def test_a_missing_library_is_named_before_any_work(monkeypatch):
    monkeypatch.setattr(extras, "find_spec", lambda name: None if name == "cv2" else name)
    with pytest.raises(MissingExtraError, match=r"OpenCV: pip install 'contourslam\[camera\]'"):
        extras.check_extras()
