import numpy as np
from ruamel.yaml import YAML

from contourslam.report.nav2_map import write_nav2_map
from contourslam.report.occupancy import FREE, OCCUPIED, UNKNOWN, OccupancyGrid


def load_as_the_map_server_does(folder):
    """What Nav2's and ROS 1's map servers make of it in trinary mode: rows from the bottom, values -1, 0, 100."""
    settings = YAML(typ="safe").load(folder / "map.yaml")
    assert settings["mode"] == "trinary"
    content = (folder / settings["image"]).read_bytes()
    magic, size, depth, pixels = content.split(b"\n", 3)
    assert (magic, depth) == (b"P5", b"255")
    width, height = map(int, size.split())
    assert len(pixels) == width * height
    shade = np.frombuffer(pixels, dtype=np.uint8).reshape(height, width) / 255.0
    occupied = shade if settings["negate"] else 1.0 - shade
    free = np.where(occupied < settings["free_thresh"], FREE, UNKNOWN)
    cells = np.where(occupied > settings["occupied_thresh"], OCCUPIED, free)
    return cells[::-1], settings


def test_the_map_server_sees_the_cells_where_they_are(tmp_path):
    grid = OccupancyGrid(0.1)
    grid.add(np.array([[-0.95, -2.05]]), np.array([[0.55, -2.05]]))  # to the right along the lowest row
    grid.add(np.array([[-0.95, -2.05]]), np.array([[-0.95, 1.05]]))  # up along the first column
    cells, _ = grid.cells()
    write_nav2_map(tmp_path, grid)
    loaded, settings = load_as_the_map_server_does(tmp_path)
    np.testing.assert_array_equal(loaded, cells)
    x, y, yaw = settings["origin"]
    assert yaw == 0.0
    assert settings["resolution"] == 0.1
    np.testing.assert_allclose([x, y], [-1.0, -2.1], atol=1e-9)
    assert loaded[0, -1] == OCCUPIED  # the end of the first beam: bottom right
    assert loaded[-1, 0] == OCCUPIED  # the end of the second: top left
    assert loaded[-1, -1] == UNKNOWN
    assert loaded[0, 0] == FREE


def test_an_empty_grid_is_a_map_of_one_unknown_cell(tmp_path):
    write_nav2_map(tmp_path, OccupancyGrid())
    loaded, _ = load_as_the_map_server_does(tmp_path)
    assert loaded.tolist() == [[UNKNOWN]]
