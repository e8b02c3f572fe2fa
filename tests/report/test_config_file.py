import dataclasses

import pytest

from contourslam.config import Config, LidarConfig, MotionConfig, SlamConfig
from contourslam.errors import ConfigError
from contourslam.report.config_file import read_config, write_config


def test_a_configuration_comes_back_as_it_was(tmp_path):
    motion = MotionConfig(forward_per_sqrt_m=0.123456789012345)
    config = Config(
        detector="wu", lidar=LidarConfig(mount_x=0.1), slam=SlamConfig(walls=True, association="joint", motion=motion)
    )
    write_config(tmp_path / "config.yaml", config, header="contourslam run a.mcap\n-o x")
    assert read_config(tmp_path / "config.yaml") == config
    assert (tmp_path / "config.yaml").read_text().startswith("# contourslam run a.mcap\n# -o x\n")


def test_what_a_file_leaves_out_keeps_its_default(tmp_path):
    path = tmp_path / "config.yaml"
    path.write_text("slam:\n  walls: true\nlidar: {sigma_range: 1}\n")
    assert read_config(path) == Config(lidar=LidarConfig(sigma_range=1.0), slam=SlamConfig(walls=True))
    path.write_text("# nothing\n")
    assert read_config(path) == Config()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("slam: {wals: true}", "unknown setting slam.wals"),
        ("slam: {walls: 3}", "slam.walls must be of type bool"),
        ("lidar: {sigma_range: -1}", "sigma_range must be a positive"),
        ("lidar: {sigma_range: wide}", "lidar.sigma_range must be of type float"),
        ("contour: {min_points: 4.5}", "contour.min_points must be of type int"),
        ("contour: {min_points: true}", "contour.min_points must be of type int"),
        ("slam: {association: best}", "slam.association must be one of nearest"),
        ("slam: 3", "slam. must hold names and values"),
        ("- a\n- b", "must hold names and values"),
        ("slam: {walls: [", "not valid YAML"),
        ("slam: {walls: true, walls: false}", "not valid YAML"),
        ("detector: !!python/object/apply:os.system ['true']", "not valid YAML"),
        ("1: 2", "unknown setting 1"),
    ],
)
def test_a_wrong_file_is_refused_by_name_and_place(tmp_path, text, message):
    path = tmp_path / "mine.yaml"
    path.write_text(text)
    with pytest.raises(ConfigError, match=message) as caught:
        read_config(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(ConfigError, match=r"none\.yaml: cannot be read"):
        read_config(tmp_path / "none.yaml")


def test_every_setting_is_in_the_file(tmp_path):
    write_config(tmp_path / "config.yaml", Config())
    text = (tmp_path / "config.yaml").read_text()
    for field in dataclasses.fields(SlamConfig):
        assert f"{field.name}:" in text
