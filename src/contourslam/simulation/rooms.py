"""The rooms that come with the package; one more is one more description."""

from contourslam.simulation.buildings import Building, office_building
from contourslam.simulation.pieces import (
    CARTON,
    DARK_WOOD,
    FABRIC,
    GREEN,
    GREY,
    PINE,
    RED,
    STEEL,
    WHITE,
    Box,
    Cylinder,
    chair,
    desk,
    door,
    partition,
    plant,
    shelves,
    sofa,
    table,
)
from contourslam.simulation.room import Room

FURNISHED_ROOM = Room(
    name="furnished_room",
    description="8 x 6 m living room: recess, cupboard, shelves, table and chairs, boxes at odd angles, a round column",
    outline=(
        *((0.0, 0.0), (8.0, 0.0), (8.0, 6.0)),
        *((4.4, 6.0), (4.4, 6.8), (2.6, 6.8), (2.6, 6.0)),  # recess
        *((0.0, 6.0), (0.0, 1.95), (-0.12, 1.95), (-0.12, 1.05), (0.0, 1.05)),  # doorway
    ),
    pieces=(
        Box(-0.095, 1.5, 0.05, 0.9, 2.0, colour=DARK_WOOD),  # its closed door
        Box(0.3, 4.5, 0.6, 1.6, 2.0, colour=DARK_WOOD),  # cupboard
        Box(7.8, 3.7, 0.4, 1.4, 2.4, colour=WHITE),  # chimney breast
        *shelves(6.2, 5.81, 1.8, 0.38, 180.0),
        Box(2.6, 0.22, 2.0, 0.44, 0.85, colour=PINE),  # sideboard
        *sofa(5.5, 0.45, 2.0),
        *sofa(7.3, 0.85, 0.9, 50.0, RED),  # armchair
        *table(3.9, 3.1, 1.6, 0.9, 12.0, colour=PINE),
        *chair(3.75, 3.75, -75.0),
        *chair(4.05, 2.45, 105.0),
        *chair(2.85, 2.85, 20.0),
        Box(3.5, 6.72, 0.9, 0.16, 1.5, bottom=0.9, colour=FABRIC),  # picture on the wall, above the lidar
        Box(0.5, 2.85, 0.55, 0.40, 0.5, 25.0, colour=CARTON),
        Box(5.4, 3.0, 0.50, 0.50, 0.45, -35.0, colour=RED),
        Box(7.45, 2.4, 0.60, 0.45, 0.6, 62.0, colour=CARTON),
        Box(2.1, 5.8, 0.50, 0.40, 0.45, colour=PINE),
        Cylinder(6.0, 3.9, 0.2, 2.4),
        *plant(0.4, 0.4),
    ),
    route=((1.5, 1.3), (6.4, 1.6), (6.9, 3.2), (6.8, 4.9), (4.2, 5.1), (3.4, 5.9), (2.3, 5.0), (1.5, 3.9)),
)

_STOREY = 2.6

# Into an office of the corridor, round, and out again, by where along the corridor its door is.
_IN_3 = ((3.05, 3.0), (3.7, 2.3), (4.0, 1.6), (3.5, 1.0), (2.8, 1.2), (2.6, 1.9), (3.05, 3.0))
_IN_8 = ((7.95, 6.8), (8.3, 7.6), (8.2, 8.4), (7.6, 8.7), (7.1, 8.2), (7.3, 7.5), (7.95, 6.8))
_IN_15 = ((15.45, 3.1), (15.0, 2.6), (14.9, 2.0), (15.5, 1.6), (16.1, 2.0), (16.0, 2.6), (15.45, 3.1))
_IN_22 = ((22.45, 6.7), (21.4, 7.1), (20.6, 7.7), (20.0, 7.3), (20.5, 6.8), (21.4, 6.7), (22.45, 6.7))

OFFICE_CORRIDOR = Room(
    name="office_corridor",
    description="25 m office corridor with cabinets and eight offices, five doors open, two offices driven through",
    outline=((0.0, 0.0), (25.0, 0.0), (25.0, 10.0), (0.0, 10.0)),
    pieces=(
        # The corridor runs along x between y = 3.9 and y = 6.1.
        *partition((0, 3.84), (25, 3.84), _STOREY, (3, 1), (9, 1), (15.5, 1), (21.5, 1)),
        *partition((0, 6.16), (25, 6.16), _STOREY, (2.5, 1), (8, 1), (14.5, 1), (22.5, 1)),
        *partition((6, 0), (6, 3.8), _STOREY),
        *partition((12.5, 0), (12.5, 3.8), _STOREY),
        *partition((18.5, 0), (18.5, 3.8), _STOREY, (1.6, 1)),
        *partition((5, 6.2), (5, 10), _STOREY),
        *partition((11, 6.2), (11, 10), _STOREY),
        *partition((18, 6.2), (18, 10), _STOREY),
        # Closed doors, set back in their frames, and open ones, swung into the office.
        door((2.0, 6.18), 0.0, 1.0),
        door((8.5, 3.82), 0.0, 1.0),
        door((14.0, 6.18), 0.0, 1.0),
        door((2.52, 3.78), -80.0),
        door((8.48, 6.22), 65.0),
        door((16.02, 3.76), -15.0),
        door((22.02, 3.76), -20.0),
        door((22.98, 6.22), 50.0),
        # along the corridor
        Box(5.2, 4.1, 1.2, 0.4, 1.2, colour=GREY),
        Box(12.2, 4.1, 0.8, 0.4, 1.8, colour=STEEL),
        Box(18.6, 4.1, 1.6, 0.4, 1.0, colour=PINE),
        Box(5.0, 5.9, 0.9, 0.4, 1.8, colour=STEEL),
        Box(11.0, 5.92, 1.4, 0.36, 0.9, colour=PINE),
        Box(17.4, 5.9, 0.8, 0.4, 1.2, colour=GREY),
        Box(20.3, 5.88, 0.6, 0.44, 1.1, colour=WHITE),
        Box(24.75, 4.3, 0.5, 0.8, 0.8, colour=PINE),
        *plant(0.35, 5.75),
        # offices, south side
        *desk(1.2, 0.8, 180.0),
        *shelves(4.6, 0.18, 1.6, 0.36),
        *desk(8.0, 1.0, 180.0),
        *shelves(12.24, 2.6, 1.4, 0.36, 90.0),
        *desk(13.6, 0.75, 180.0),
        Box(13.0, 3.55, 0.9, 0.46, 1.4, colour=STEEL),
        Box(17.2, 0.5, 0.60, 0.45, 0.4, 30.0, colour=CARTON),
        *desk(23.8, 1.0, 90.0),
        *shelves(20.2, 0.18, 1.6, 0.36),
        Box(19.3, 3.2, 0.8, 0.6, 0.6, -25.0, colour=CARTON),
        # offices, north side
        *desk(1.5, 9.2),
        *desk(9.5, 9.0),
        Box(7.2, 9.75, 1.6, 0.5, 1.4, colour=STEEL),
        Box(5.9, 7.6, 0.6, 0.6, 0.7, 40.0, colour=RED),
        *desk(16.0, 9.2),
        *desk(20.0, 9.2),
        *sofa(23.9, 9.5, 1.6, 180.0),
        *table(22.4, 8.0, 1.2, 0.8, 15.0),
    ),
    route=(
        *((1.2, 4.8), (15.0, 4.75), (15.5, 4.6), (15.5, 2.3), (16.4, 1.6), (20.5, 1.6), (21.5, 2.5)),
        *((21.5, 4.9), (23.6, 4.9), (23.8, 5.2), (1.3, 5.2)),
    ),
    wall_height=_STOREY,
    loops=(  # on the right: eastward at y = 4.7, westward at y = 5.3
        (
            *((1.2, 4.7), (2.6, 4.7), (3.05, 4.3), *_IN_3, (3.05, 4.3), (3.5, 4.7), (7.5, 4.7), (7.95, 5.2), *_IN_8),
            *((7.95, 5.7), (7.5, 5.3), (1.2, 5.3)),
        ),
        (
            *((10.2, 4.7), (15.0, 4.7), (15.45, 4.3), (15.45, 2.3), (16.4, 1.6), (20.5, 1.6), (21.5, 2.5)),
            *((21.5, 4.3), (21.9, 4.7), (23.6, 4.7), (23.6, 5.3), (22.9, 5.3), (22.45, 5.7), *_IN_22, (22.45, 5.7)),
            *((22.0, 5.3), (10.2, 5.3)),
        ),
        (
            *((5.6, 4.7), (15.0, 4.7), (15.45, 4.3), *_IN_15, (15.45, 4.3), (15.9, 4.7), (17.5, 4.7), (17.5, 5.3)),
            *((8.4, 5.3), (7.95, 5.7), *_IN_8, (7.95, 5.7), (7.5, 5.3), (5.6, 5.3)),
        ),
    ),
)

LARGE_HALL = Room(
    name="large_hall",
    description="25 x 18 m hall with square and round columns, racks, crates at odd angles and a loading bay",
    outline=(
        *((0.0, 0.0), (9.0, 0.0), (9.0, -1.5), (14.0, -1.5), (14.0, 0.0), (25.0, 0.0)),  # loading bay
        *((25.0, 14.5), (20.5, 14.5), (20.5, 18.0)),  # an office is walled off
        *((6.0, 18.0), (6.0, 17.0), (3.0, 17.0), (3.0, 18.0), (0.0, 18.0)),
    ),
    pieces=(
        *(Box(x, y, 0.5, 0.5, 5.0, colour=GREY) for x, y in ((5, 5.5), (5, 12), (15, 5.5), (15, 12), (20, 9))),
        *(Cylinder(x, y, 0.3, 5.0) for x, y in ((10, 5.5), (10, 12), (20, 5), (1.0, 16.9))),
        *table(2.0, 8.8, 1.0, 5.0, height=2.2, leg=0.12, colour=RED),
        *table(2.0, 8.8, 1.0, 5.0, height=1.1, leg=0.12, colour=RED),
        *table(12.5, 16.9, 5.0, 1.0, height=2.2, leg=0.12, colour=RED),
        Box(12.5, 8.8, 2.4, 1.2, 1.3, 20.0, colour=CARTON),
        Box(7.6, 8.6, 1.2, 1.0, 0.9, -35.0, colour=PINE),
        Box(17.5, 8.4, 1.2, 0.8, 1.2, 65.0, colour=STEEL),
        Box(24.3, 7.5, 1.4, 3.0, 1.6, colour=STEEL),
        Box(23.8, 12.6, 1.2, 1.2, 1.0, 15.0, colour=CARTON),
        Box(19.2, 16.9, 1.2, 0.8, 1.4, -20.0, colour=CARTON),
        Box(1.2, 1.3, 1.2, 1.0, 1.0, 30.0, colour=CARTON),
        Box(5.5, 0.6, 2.4, 1.2, 2.2, colour=GREEN),
        Box(18.0, 0.5, 1.6, 1.0, 1.2, colour=PINE),
        Box(22.2, 1.6, 1.2, 0.8, 0.8, 50.0, colour=CARTON),
        Box(12.2, -0.9, 0.8, 1.2, 0.15, colour=PINE),  # pallet, below the lidar
        Box(1.2, 13.2, 1.2, 0.9, 1.1, 30.0, colour=CARTON),
        Box(5.8, 10.0, 1.0, 0.8, 0.8, -15.0, colour=RED),
        Box(7.4, 6.3, 1.2, 0.8, 1.0, 40.0, colour=CARTON),
        Box(8.2, 16.4, 1.2, 0.9, 1.1, 10.0, colour=PINE),
    ),
    route=(
        *((3.5, 3.2), (8.0, 3.4), (12.3, 2.6), (16.5, 3.2), (21.8, 3.6), (22.4, 10.5), (18.5, 13.8), (13.8, 14.2)),
        *((12.6, 11.0), (9.4, 9.6), (7.0, 13.6), (3.6, 14.4), (3.7, 8.0)),
    ),
    wall_height=5.0,
)

_OFFICE = office_building(corridors=2, seed=4)  # `long_drive` has larger ones
OFFICE_BUILDING = _OFFICE.room

ROOMS: dict[str, Room] = {room.name: room for room in (FURNISHED_ROOM, OFFICE_CORRIDOR, LARGE_HALL, OFFICE_BUILDING)}
"""Name to room: those that the command line offers."""

BUILDINGS: dict[str, Building] = {OFFICE_BUILDING.name: _OFFICE}
"""Those of them that are buildings, whose corridors and doors are known, by name."""
