"""Pictures are placed by their stamps, and spread over the way."""

import numpy as np
from painted_room import LENS, MODEL, as_picture

from contourslam.recordings.picture import Picture
from contourslam.scene.blending import blend
from contourslam.scene.filling import fill
from contourslam.scene.views import choose_views

PICTURE = as_picture(np.zeros((4, 4, 3)), 0.0)


def at(stamp):
    return Picture(stamp, PICTURE.data, "png")


def test_a_picture_is_where_the_trajectory_was_at_its_stamp():
    stamps, poses = np.array([2.0, 1.0, 1.5]), np.array([[1.0, 0, 0.4], [0.0, 0, 0], [0.5, 0, 0.2]])
    views = choose_views([at(1.25)], stamps, poses, 10)
    np.testing.assert_allclose(views.chosen[0].pose[:2], [0.25, 0.0], atol=0.03)
    np.testing.assert_allclose(views.chosen[0].pose[2], 0.1)
    np.testing.assert_allclose(views.chosen[0].turning, 0.4)


def test_pictures_without_a_pose_near_by_are_left_out_and_counted():
    stamps = np.array([1.0, 1.5, 9.0, 9.5])
    views = choose_views([at(0.5), at(1.2), at(5.0), at(9.2), at(10.0)], stamps, np.outer(stamps, [1.0, 0, 0]), 10)
    assert (views.seen, views.placeless, len(views.chosen)) == (5, 3, 2)
    assert len(choose_views([at(1.0)], np.array([1.0]), np.zeros((1, 3)), 10).chosen) == 0


def test_a_robot_that_stands_needs_one_picture_and_a_long_way_keeps_to_the_limit():
    stamps = np.arange(0.0, 100.0, 0.1)
    still = choose_views((at(t) for t in stamps), stamps, np.zeros((1000, 3)), 50)
    assert (still.seen, len(still.chosen)) == (1000, 1)
    driven = choose_views((at(t) for t in stamps), stamps, np.outer(stamps, [0.5, 0, 0]), 50)
    assert 25 <= len(driven.chosen) <= 50
    assert np.ptp([view.pose[0] for view in driven.chosen]) > 45.0


def test_a_place_straight_on_and_near_is_seen_best():
    stand = LENS.stand(np.zeros(3))
    eye = stand[:3, 3]
    places = eye + np.array([[1.0, 0, 0], [3.0, 0, 0], [1.0, 1.5, 0], [-3.0, 0, 0]])
    scores = LENS.look(stand, places, np.array([-1.0, 0, 0]), 0.02).scores
    assert scores[0] > scores[1] > 0 and scores[0] > scores[2] > 0 and scores[3] == 0
    assert not LENS.look(stand, places, np.array([1.0, 0, 0]), 0.02).scores.any()  # from behind
    covered = np.ones((MODEL.height, MODEL.width), bool)
    assert not LENS.without(covered).look(stand, places, np.array([-1.0, 0, 0]), 0.02).scores.any()


def blended(colours, weights, factors, trusted):
    """The kernel's twin for one texel."""
    worth = weights / 255 * trusted
    light = (colours * factors).mean(axis=1)
    order = [s for s in np.argsort(light, kind="stable") if worth[s] > 0]
    middle = light[order[int(np.searchsorted(np.cumsum(worth[order]), 0.5 * worth[order].sum()))]]
    w = worth[order] ** 3 * np.exp(-0.5 * ((light[order] - middle) / 18) ** 2) + 1e-12
    return (w[:, None] * (colours * factors)[order]).sum(axis=0) / w.sum()


def test_blending_is_a_mean_about_the_weighted_median():
    rng = np.random.default_rng(8)
    colours = rng.integers(60, 190, (3, 4, 8, 3)).astype(np.uint8)
    weights = rng.integers(0, 255, (3, 4, 8)).astype(np.uint8)
    weights[0, 0] = 0
    factors = rng.uniform(0.9, 1.1, (3, 8, 3)).astype(np.float32)
    trusted = rng.uniform(0.2, 1, (3, 8)).astype(np.float32)
    out, count = blend(colours, weights, factors, trusted)
    assert count[0, 0] == 0 and (count.ravel()[1:] > 0).all()
    for cell in range(3):
        for texel in range(4):
            if (cell, texel) != (0, 0):
                expected = blended(colours[cell, texel], weights[cell, texel], factors[cell], trusted[cell])
                np.testing.assert_allclose(out[cell, texel], expected, atol=1.0)


def test_small_holes_are_filled_and_large_ones_are_hatched():
    image = np.full((60, 60, 3), (200, 120, 40), np.uint8)
    seen = np.ones((60, 60), bool)
    seen[5:8, 5:8] = seen[20:60, 20:60] = False
    filled = fill(np.where(seen[..., None], image, 0).astype(np.uint8), seen, 4)
    np.testing.assert_allclose(filled[5:8, 5:8], image[5:8, 5:8], atol=2)
    np.testing.assert_array_equal(filled[seen], image[seen])
    middle = filled[35:55, 35:55].reshape(-1, 3).astype(int)
    assert np.ptp(middle[0]) < 100 and np.ptp(middle, axis=0).min() >= 10  # greyer, with strokes
    assert fill(np.zeros((4, 4, 3), np.uint8), np.zeros((4, 4), bool), 2, np.array([9.0, 8, 7]))[0, 0].tolist() == [
        9,
        8,
        7,
    ]
