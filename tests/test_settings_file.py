import dataclasses

import pytest

from contourslam.config import Config, LidarConfig, MotionConfig, SlamConfig
from contourslam.errors import ConfigError
from contourslam.settings_file import read_settings, write_settings


def test_a_configuration_comes_back_as_it_was(tmp_path):
    motion = MotionConfig(forward_per_sqrt_m=0.123456789012345)
    config = Config(
        detector="wu", lidar=LidarConfig(mount_x=0.1), slam=SlamConfig(walls=True, association="joint", motion=motion)
    )
    write_settings(tmp_path / "config.yaml", config, header="contourslam run a.mcap\n-o x")
    assert read_settings(tmp_path / "config.yaml", Config) == config
    assert (tmp_path / "config.yaml").read_text().startswith("# contourslam run a.mcap\n# -o x\n")


def test_what_a_file_leaves_out_keeps_its_default(tmp_path):
    path = tmp_path / "config.yaml"
    path.write_text("slam:\n  walls: true\nlidar: {sigma_range: 1}\n")
    assert read_settings(path, Config) == Config(lidar=LidarConfig(sigma_range=1.0), slam=SlamConfig(walls=True))
    path.write_text("# nothing\n")
    assert read_settings(path, Config) == Config()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("slam: {wals: true}", "unknown setting slam.wals"),
        ("slam: {walls: 3}", "slam.walls must be true or false"),
        ("lidar: {sigma_range: -1}", "sigma_range must be a positive"),
        ("lidar: {sigma_range: wide}", "lidar.sigma_range must be a finite number"),
        ("lidar: {sigma_range: .inf}", "lidar.sigma_range must be a finite number"),
        (f"lidar: {{sigma_range: 1{'0' * 400}}}", "lidar.sigma_range must be a finite number"),
        ("contour: {min_points: 4.5}", "contour.min_points must be a whole number"),
        ("contour: {min_points: true}", "contour.min_points must be a whole number"),
        ("slam: {association: best}", "slam.association must be one of nearest"),
        ("slam: 3", "slam must hold names and values"),
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
        read_settings(path, Config)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(ConfigError, match=r"none\.yaml: cannot be read"):
        read_settings(tmp_path / "none.yaml", Config)


def test_every_setting_is_in_the_file(tmp_path):
    write_settings(tmp_path / "config.yaml", Config())
    text = (tmp_path / "config.yaml").read_text()
    for field in dataclasses.fields(SlamConfig):
        assert f"{field.name}:" in text
