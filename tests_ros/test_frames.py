"""Where a lidar sits, out of transforms; the answers are worked out by hand or by matrices."""

import math

import numpy as np
import pytest
from geometry_msgs.msg import Quaternion, TransformStamped

from contourslam.errors import ScanError
from contourslam_ros.frames import Frames
from contourslam_ros.messages import quaternion

OVER = Quaternion(x=1.0, y=0.0, z=0.0, w=0.0)  # half a turn about x


def transform(parent: str, child: str, x: float, y: float, z: float, turn: Quaternion) -> TransformStamped:
    stamped = TransformStamped(child_frame_id=child)
    stamped.header.frame_id = parent
    place = stamped.transform.translation
    place.x, place.y, place.z = x, y, z
    stamped.transform.rotation = turn
    return stamped


def matrix(stamped: TransformStamped) -> np.ndarray:
    q, t = stamped.transform.rotation, stamped.transform.translation
    x, y, z, w = q.x, q.y, q.z, q.w
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y), t.x],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x), t.y],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y), t.z],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )


def test_a_chain_of_transforms_is_the_product_of_their_matrices() -> None:
    rng = np.random.default_rng(3)
    turns = rng.normal(size=(4, 4))
    turns /= np.linalg.norm(turns, axis=1)[:, None]
    names = ["base_link", "plate", "mast", "head", "laser"]
    chain = [
        transform(parent, child, *rng.normal(size=3).tolist(), Quaternion(**dict(zip("xyzw", q.tolist(), strict=True))))
        for parent, child, q in zip(names, names[1:], turns, strict=False)
    ]
    frames = Frames()
    frames.add(chain)
    found = frames.between("base_link", "laser")
    expected = np.linalg.multi_dot([matrix(stamped) for stamped in chain])
    assert found is not None
    whole = transform("", "", *found[:3].tolist(), Quaternion(**dict(zip("xyzw", found[3:].tolist(), strict=True))))
    np.testing.assert_allclose(matrix(whole), expected, atol=1e-12)
    back = frames.between("laser", "base_link")
    assert back is not None
    np.testing.assert_allclose(back[:3], np.linalg.inv(expected)[:3, 3], atol=1e-12)


def test_a_lidar_beside_the_base_in_the_tree_is_found_over_their_common_frame() -> None:
    frames = Frames()
    frames.add([transform("odom", "base_link", 5.0, 5.0, 0.0, quaternion(math.pi / 2.0))])
    frames.add([transform("odom", "laser", 5.0, 5.3, 0.2, quaternion(math.pi))])
    found = frames.mounting("laser", "base_link")
    assert found is not None
    np.testing.assert_allclose(found.pose, [0.3, 0.0, math.pi / 2.0], atol=1e-12)


def test_a_lidar_that_hangs_is_upside_down_and_looks_where_its_zero_beam_does() -> None:
    frames = Frames()
    frames.add([transform("base_link", "plate", 0.2, -0.1, 0.5, quaternion(math.pi / 2.0))])
    frames.add([transform("plate", "laser", 0.1, 0.0, -0.1, OVER)])
    found = frames.mounting("laser", "base_link")
    assert found is not None
    assert found.upside_down
    np.testing.assert_allclose(found.pose, [0.2, 0.0, math.pi / 2.0], atol=1e-12)


def test_a_tilted_lidar_is_refused_by_name() -> None:
    frames = Frames()
    tilt = math.radians(10.0)
    turn = Quaternion(x=0.0, y=math.sin(tilt / 2.0), z=0.0, w=math.cos(tilt / 2.0))
    frames.add([transform("base_link", "laser", 0.0, 0.0, 0.0, turn)])
    with pytest.raises(ScanError, match=r"laser.*tilted by 10"):
        frames.mounting("laser", "base_link")


def test_frames_that_nothing_joins_and_broken_transforms_give_no_place() -> None:
    frames = Frames()
    frames.add(
        [transform("a", "b", 0.0, 0.0, 0.0, quaternion(0.0)), transform("b", "a", 0.0, 0.0, 0.0, quaternion(0.0))]
    )
    frames.add([transform("base_link", "laser", math.nan, 0.0, 0.0, quaternion(0.0))])
    frames.add([transform("base_link", "laser", 0.0, 0.0, 0.0, Quaternion(x=0.0, y=0.0, z=0.0, w=0.0))])
    assert frames.mounting("laser", "base_link") is None
    assert frames.mounting("a", "base_link") is None
