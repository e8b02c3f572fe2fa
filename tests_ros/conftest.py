"""A ROS graph of the tests' own: nobody else's nodes are heard, and none of ours are heard by others."""

import os
from collections.abc import Iterator

import pytest

# Before rclpy is loaded, and for the nodes that tests start as processes. Ids up to 101 are safe on every system.
os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
os.environ["ROS_DOMAIN_ID"] = str(40 + os.getpid() % 60)


@pytest.fixture(scope="session")
def ros() -> Iterator[None]:
    import rclpy

    rclpy.init()
    yield
    rclpy.shutdown()
