import os
from pathlib import Path

import numpy as np
import pytest

from contourslam.simulation.hardware.line import Damage, Line, Noise


@pytest.mark.parametrize("burst", [1.0, 20.0])
def test_as_many_bytes_are_hit_as_asked_and_in_rows_as_long_as_asked(burst: float) -> None:
    noise = Noise(np.random.default_rng(3))
    noise.damage = Damage(0.05, burst)
    sent = np.random.default_rng(4).integers(0, 256, 200_000, dtype=np.uint8)
    came = np.frombuffer(b"".join(noise(sent[at : at + 90].tobytes()) for at in range(0, sent.size, 90)), np.uint8)
    hit = came != sent
    assert came.size == sent.size == noise.passed
    assert hit.sum() == noise.hit
    assert hit.mean() == pytest.approx(0.05, rel=0.15)
    rows = np.count_nonzero(np.diff(hit.astype(np.int8)) == 1)
    assert hit.sum() / rows == pytest.approx(max(burst, 1.05), rel=0.15)


def test_lost_bytes_never_arrive() -> None:
    noise = Noise(np.random.default_rng(3))
    noise.damage = Damage(0.1, lost=1.0)
    came = noise(bytes(range(250)) * 40)
    assert 10_000 - len(came) == noise.hit
    assert noise.hit == pytest.approx(1000, rel=0.15)


def test_a_sound_line_changes_nothing() -> None:
    noise = Noise(np.random.default_rng(3))
    assert noise(b"abc") == b"abc"
    assert noise(b"") == b""
    assert (noise.passed, noise.hit) == (3, 0)


def test_bytes_go_both_ways_and_a_pulled_cable_ends_it(tmp_path: Path) -> None:
    line = Line(tmp_path / "port", np.random.default_rng(0))
    driver = os.open(tmp_path / "port", os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    line.send(b"\x00\x11\x03\n")  # control characters are bytes like others
    assert os.read(driver, 100) == b"\x00\x11\x03\n"
    os.write(driver, b"\x04\r")
    assert line.receive() == b"\x04\r"
    assert line.receive() == b""
    line.unplug()
    assert not line.plugged and not (tmp_path / "port").exists()
    line.send(b"lost")
    assert line.overrun == 4 and line.receive() == b""
    with pytest.raises(OSError, match=r".*"):
        os.write(driver, b"x")
    os.close(driver)
    line.plug()
    again = os.open(tmp_path / "port", os.O_RDWR | os.O_NOCTTY)
    line.send(b"back")
    assert os.read(again, 100) == b"back"
    os.close(again)
    line.unplug()
