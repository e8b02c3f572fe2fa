import subprocess
from pathlib import Path

from mega_bench import MEGA


def build(folder: Path, *words: str) -> bytes:
    """Build the firmware there; what is flashed."""
    command = ["make", "-s", "-C", str(MEGA), f"BUILD={folder}", *words, "all"]
    subprocess.run(command, check=True, capture_output=True)
    return (folder / "mega.hex").read_bytes()


def test_another_configuration_is_built_over_what_was_built_before(tmp_path: Path) -> None:
    config = tmp_path / "robot.h"
    config.write_text((MEGA / "config.h").read_text().replace("#define GAIN_KP 0.15f", "#define GAIN_KP 0.16f"))
    plain = build(tmp_path / "build")
    other = build(tmp_path / "build", f"CONFIG={config}")
    assert other != plain
    built = (tmp_path / "build" / "mega.elf").stat().st_mtime_ns
    assert build(tmp_path / "build", f"CONFIG={config}") == other
    assert (tmp_path / "build" / "mega.elf").stat().st_mtime_ns == built  # nothing had changed
    config.unlink()
    assert build(tmp_path / "build") == plain
