"""What is painted on a room is known: where, which colour, and the same for the same seed."""

import numpy as np
import pytest

pytest.importorskip("shapely", reason="needs the extra 'simulation'")
import shapely

from contourslam.simulation.pieces import CARTON, DARK_WOOD, FABRIC, PINE, WHITE, Box, Cylinder, shelves
from contourslam.simulation.room import Room
from contourslam.simulation.rooms import ROOMS
from contourslam.simulation.textures import RoomTextures, room_textures

ROOM = Room(
    "small",
    "a room with a recess, a cupboard, a box askew, shelves and a column",
    ((0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (2.5, 3.0), (2.5, 3.5), (1.5, 3.5), (1.5, 3.0), (0.0, 3.0)),
    (
        Box(0.3, 1.5, 0.6, 1.2, 1.9, colour=DARK_WOOD),
        Box(3.2, 0.6, 0.5, 0.4, 0.45, 30.0, colour=CARTON),
        Box(2.0, 3.4, 0.9, 0.1, 1.6, bottom=1.0, colour=FABRIC),
        Box(3.94, 2.0, 0.12, 1.0, 2.4, colour=WHITE),
        *shelves(1.2, 0.18, 1.0, 0.36),
        Box(2.0, 1.0, 0.8, 0.6, 0.5, 10.0, colour=PINE),
        Cylinder(3.0, 2.4, 0.15, 2.4),
    ),
    ((1.0, 1.0), (2.8, 1.4), (2.0, 2.5)),
)


@pytest.fixture(scope="module")
def textures() -> RoomTextures:
    return room_textures(ROOM, 3)


def test_every_side_of_the_outline_has_a_wall_that_faces_the_room(textures: RoomTextures) -> None:
    inside = shapely.Polygon(ROOM.outline)
    assert len(textures.walls) == len(ROOM.outline)
    for index, wall in enumerate(textures.walls):
        start, end = ROOM.outline[index], ROOM.outline[(index + 1) % len(ROOM.outline)]
        np.testing.assert_allclose(wall.corner, [*end, ROOM.wall_height], atol=1e-12)
        np.testing.assert_allclose(wall.points([[wall.width, wall.height]])[0], [*start, 0.0], atol=1e-12)
        middle = wall.points([[wall.width / 2, wall.height / 2]])[0]
        assert inside.contains(shapely.Point(middle[:2] + 0.01 * wall.normal[:2]))
        rows, columns = wall.image.shape[:2]
        assert columns == np.ceil(wall.width / wall.metres_per_pixel - 1e-6)
        assert rows == np.ceil(wall.height / wall.metres_per_pixel - 1e-6)


def test_the_faces_of_a_piece_look_out_of_it(textures: RoomTextures) -> None:
    for index, piece in enumerate(ROOM.pieces):
        faces = [s for s in textures.surfaces if s.name.startswith(f"piece{index}.")]
        middle = np.array([piece.x, piece.y, (piece.top + piece.bottom) / 2])
        assert len(faces) == (32 if isinstance(piece, Cylinder) else 6 if piece.bottom > 0.02 else 5)
        for face in faces:
            assert face.normal @ (face.points([[face.width / 2, face.height / 2]])[0] - middle) > 0.005
            np.testing.assert_allclose(np.linalg.norm(face.normal), 1.0)


def test_the_colour_at_a_point_of_a_wall_is_the_pixel_there(textures: RoomTextures) -> None:
    wall = textures.walls[2]
    rows, columns = np.array([[3, 17, 250], [9, 80, 120]])
    size = wall.metres_per_pixel
    points = wall.points(np.stack([(columns + 0.5) * size, (rows + 0.5) * size], axis=1))
    colours, found = textures.colours(points + 0.002 * wall.normal)
    assert found.all()
    np.testing.assert_array_equal(colours, wall.image[rows, columns])


def test_a_point_in_the_middle_of_the_room_has_no_colour(textures: RoomTextures) -> None:
    colours, found = textures.colours([[1.5, 1.5, 1.0]])
    assert not found.any() and np.isnan(colours).all()


def test_floor_and_ceiling_are_found_from_above_and_below(textures: RoomTextures) -> None:
    names = [textures.surfaces[k].name for k in textures.find([[1.5, 1.5, 0.01], [1.5, 1.5, 2.39]])]
    assert names == ["floor", "ceiling"]
    floor, ceiling = (next(s for s in textures.surfaces if s.name == name) for name in names)
    np.testing.assert_allclose([floor.normal, ceiling.normal], [[0, 0, 1], [0, 0, -1]], atol=1e-12)


def test_the_same_seed_paints_the_same_room_and_another_seed_another(textures: RoomTextures) -> None:
    again, other = room_textures(ROOM, 3), room_textures(ROOM, 4)
    for one, two in zip(textures.surfaces, again.surfaces, strict=True):
        assert one.name == two.name and one.offset == two.offset
        np.testing.assert_array_equal(one.image, two.image)
    assert any((one.image != two.image).any() for one, two in zip(textures.walls, other.walls, strict=True))


def test_a_piece_more_repaints_nothing_that_it_does_not_touch(textures: RoomTextures) -> None:
    from dataclasses import replace

    more = room_textures(replace(ROOM, pieces=(*ROOM.pieces, Box(2.0, 2.0, 0.2, 0.2, 0.3))), 3)
    for one, two in zip(textures.walls, more.walls, strict=True):
        np.testing.assert_array_equal(one.image, two.image)


def test_an_image_cannot_be_changed_by_who_reads_it(textures: RoomTextures) -> None:
    with pytest.raises(ValueError, match="read-only"):
        textures.walls[0].image[0, 0] = 0


def test_walls_are_worth_looking_at(textures: RoomTextures) -> None:
    """A scene is textured from pictures: on a blank wall nobody could tell a texture put in the wrong place."""
    for wall in textures.walls:
        if wall.width > 1.0:
            assert wall.image.reshape(-1, 3).std(axis=0).max() > 10.0


def test_a_large_building_stays_within_bounds() -> None:
    textures = room_textures(ROOMS["office_building"], 0)
    images = {id(surface.image): surface.image for surface in textures.surfaces}
    assert sum(image.size for image in images.values()) / 3 < 15e6
    assert len(images) < 900  # MuJoCo holds no more than 1000
