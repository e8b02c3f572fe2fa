"""A scene has the colours of the room, whatever single pictures do."""

from dataclasses import replace

import numpy as np
import pytest
from painted_room import BOX, HIGH, LENS, MODEL, POSES, as_picture, colours_at, views_of, with_picture

from contourslam.errors import RecordingError
from contourslam.recordings.picture import Picture
from contourslam.scene.build import build_scene
from contourslam.scene.raising import SceneOptions, cut_to_height
from contourslam.scene.views import Views

OPTIONS = SceneOptions(height=HIGH, find_heights=False, texel=0.04)


def scene_of(room, views, options=OPTIONS, surfaces=None):
    surfaces = surfaces or tuple(painted.surface for painted in room if painted.surface.kind != "top")
    return build_scene(surfaces, POSES, views, LENS, options)


def errors(room, scene):
    """Mean absolute error of the colours of each surface where it is seen, after one gain for all of the scene."""
    painted = {p.surface.name: p for p in room}
    truth, found = {}, {}
    for surface, texture, seen in zip(scene.surfaces, scene.textures, scene.seen, strict=True):
        rows, columns = np.nonzero(seen)
        u = (columns + 0.5) / seen.shape[1] * surface.width
        v = (1 - (rows + 0.5) / seen.shape[0]) * surface.height
        truth[surface.name] = colours_at(painted[surface.name], u, v)
        found[surface.name] = texture[rows, columns].astype(float)
    gain = np.median(
        np.concatenate(list(truth.values())).mean(axis=1) / np.concatenate(list(found.values())).mean(axis=1)
    )
    return {name: float(np.abs(gain * found[name] - truth[name]).mean()) for name in truth}


@pytest.fixture(scope="module")
def plain(room, images):
    return scene_of(room, views_of(images))


def test_walls_furniture_and_floor_get_their_own_colours(room, plain):
    assert max(errors(room, plain).values()) < 5.0
    assert plain.share("wall") > 0.97 and plain.share("contour") > 0.9


def test_what_nobody_sees_is_said_to_be_unseen(room, plain):
    floor = [s.name for s in plain.surfaces].index("floor-0")
    rows, columns = plain.seen[floor].shape
    y = (1 - (np.arange(rows) + 0.5) / rows) * 3.0
    x = (np.arange(columns) + 0.5) / columns * 4.0
    under_the_box = plain.seen[floor][np.ix_((y > 1.42) & (y < 1.68), (x > 1.82) & (x < 2.08))]
    assert not under_the_box.any()
    assert plain.seen_part(floor) < 0.99


def test_pictures_of_other_exposure_and_a_dark_rim_leave_no_trace(room, images, plain):
    rng = np.random.default_rng(2)
    rows, columns = np.indices((MODEL.height, MODEL.width))
    rays, _ = MODEL.unproject(np.stack([columns.ravel(), rows.ravel()], axis=1))
    angle = np.nan_to_num(np.arccos(np.clip(rays[:, 2], -1, 1)) / MODEL.half_view).reshape(rows.shape)
    rim = 1.0 - 0.3 * angle[..., None] ** 2
    gains = np.exp(rng.normal(0.0, 0.12, len(images)))
    scene = scene_of(room, views_of([image * gain * rim for image, gain in zip(images, gains, strict=True)]))
    assert np.mean(list(errors(room, scene).values())) < 1.5 + np.mean(list(errors(room, plain).values()))
    found = scene.exposure.gains.mean(axis=1)
    np.testing.assert_allclose(found - found.mean(), np.log(gains) - np.log(gains).mean(), atol=0.02)
    assert scene.exposure.falloff.sum() == pytest.approx(np.log(0.7), abs=0.03)


def test_who_walks_through_one_picture_is_not_in_the_scene(room, images, plain):
    disturbed = [image.copy() for image in images]
    disturbed[3][60:160, 80:140] = 0.0
    scene = scene_of(room, views_of(disturbed))
    assert np.mean(list(errors(room, scene).values())) < 0.7 + np.mean(list(errors(room, plain).values()))


@pytest.mark.parametrize("kind", ["tilted", "misplaced"])
def test_a_picture_from_elsewhere_than_its_pose_says_is_outvoted(room, images, plain, kind):
    views = views_of(images)
    wrong = np.roll(images[5], 25, axis=0) if kind == "tilted" else images[11]
    scene = scene_of(room, with_picture(views, 5, as_picture(wrong, views.chosen[5].picture.stamp)))
    assert np.mean(list(errors(room, scene).values())) < 1.5 + np.mean(list(errors(room, plain).values()))


def test_a_corrupt_picture_is_counted_and_loses_nothing_else(room, images):
    views = views_of(images)
    data = views.chosen[4].picture.data
    corrupt = Picture(8.0, data[:400] + bytes(200) + data[600:], "png")
    other_size = as_picture(np.zeros((50, 60, 3)), 12.0)
    scene = scene_of(room, with_picture(with_picture(views, 4, corrupt), 6, other_size))
    assert scene.damaged == 2
    assert max(errors(room, scene).values()) < 7.0


def test_pictures_of_which_none_can_be_used_are_an_error(room, images):
    views = views_of(images[:3])
    for number in range(3):
        views = with_picture(views, number, as_picture(np.zeros((20, 20, 3)), 2.0 * number))
    with pytest.raises(RecordingError, match="220 by 220"):
        scene_of(room, views)
    with pytest.raises(RecordingError, match="none of the 7 pictures"):
        scene_of(room, Views((), 7, 7))


def test_two_pictures_are_enough_to_see_something(room, images):
    scene = scene_of(room, views_of(images[:2]))
    assert 0.2 < scene.share("wall") < 0.95


def test_a_scene_that_would_be_too_large_is_coarser_and_says_so(room, images):
    scene = scene_of(room, views_of(images[:3]), replace(OPTIONS, most_texels=8000))
    assert scene.texel > OPTIONS.texel
    assert sum(texture.shape[0] * texture.shape[1] for texture in scene.textures) <= 8000
    assert "cm wide, not 4.0" in scene.notes[0]


def test_furniture_is_cut_to_the_height_that_pictures_show(room, images):
    tall = tuple(p.surface if p.surface.kind == "floor" else p.surface.cut(1.2) for p in room[:-1])
    options = replace(OPTIONS, height=1.2, find_heights=True, texel=0.02, furniture_height=0.9)
    cut = cut_to_height(tall, POSES, views_of(images), LENS, options)
    heights = {s.name: s.height for s in cut}
    assert all(heights[f"wall-{n}"] == 1.2 for n in range(4))
    assert [heights[f"contour-{n}"] for n in range(4)] == pytest.approx([BOX] * 4, abs=0.08)
    lid = next(s for s in cut if s.kind == "top")
    assert lid.area == pytest.approx(0.25, rel=0.15)


def test_the_robot_in_its_own_pictures_is_not_on_the_floor(room, images):
    body = np.arange(MODEL.height)[:, None, None] > 185
    scene = scene_of(room, views_of([np.where(body, 10.0, image) for image in images]))
    assert errors(room, scene)["floor-0"] < 6.0
