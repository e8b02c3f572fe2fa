"""How colcon installs the package: the nodes, and beside them what launch files and RViz read."""

from pathlib import Path

from setuptools import setup

NAME = "contourslam_ros"
SHARE = f"share/{NAME}"


def files(folder: str) -> tuple[str, list[str]]:
    """Say where the files of a folder go."""
    return f"{SHARE}/{folder}", sorted(str(path) for path in Path(folder).iterdir() if path.is_file())


setup(
    name=NAME,
    version="0.1.0",
    packages=[NAME],
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (SHARE, ["package.xml"]),
        files("launch"),
        files("config"),
        files("rviz"),
    ],
    install_requires=["setuptools"],
    zip_safe=True,
    maintainer="The contourslam developers",
    maintainer_email="developers@contourslam.invalid",
    description="Maps a building as corners and walls from a 2-D lidar, and tells a robot where it is in such a map.",
    license="Apache-2.0",
    entry_points={
        "console_scripts": [
            f"slam = {NAME}.slam:main",
            f"localization = {NAME}.localization:main",
            f"replay = {NAME}.replay:main",
            f"fleet_server = {NAME}.fleet_server:main",
            f"lidar = {NAME}.lidar:main",
            f"base = {NAME}.base:main",
            f"camera = {NAME}.camera:main",
        ]
    },
)
