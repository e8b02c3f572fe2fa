"""The simulated Mega seen from Python; what its firmware does is tested in firmware/mega/tests."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from contourslam.robot.base.messages import HelloReply, State
from contourslam.robot.base.protocol import Decoder
from contourslam.simulation.hardware.board import BoardError, SimulatedBoard

BUILD = Path(__file__).parents[3] / "firmware" / "mega" / "build"
BOARD, FIRMWARE = BUILD / "board", BUILD / "mega.elf"
built = pytest.mark.skipif(not (BOARD.exists() and FIRMWARE.exists()), reason="make firmware builds the board")


@pytest.fixture
def board() -> Iterator[SimulatedBoard]:
    with SimulatedBoard(BOARD, FIRMWARE) as board:
        yield board


@built
def test_time_passes_as_asked_whatever_the_steps(board: SimulatedBoard) -> None:
    cycles = 0
    for _ in range(3000):
        cycles = board.step(1 / 30_000).cycles
    assert cycles == pytest.approx(0.1 * 16e6, abs=20)


@built
def test_the_firmware_runs_and_counts_the_wheels(board: SimulatedBoard) -> None:
    sent = board.step(0.1).sent + board.step(0.1, (300, -200)).sent + board.step(0.1).sent
    greeting, *states = [received.message for received in Decoder().feed(sent)]
    assert isinstance(greeting, HelloReply)
    assert len(states) == 15
    assert isinstance(states[-1], State)
    assert states[-1].ticks == (300, -200)


@built
def test_the_same_steps_give_the_same_bytes() -> None:
    runs = []
    for _ in range(2):
        with SimulatedBoard(BOARD, FIRMWARE) as board:
            runs.append([board.step(0.01, (7 * count, -3 * count), received=b"\x05\x00") for count in range(20)])
    assert runs[0] == runs[1]


@built
def test_the_figures_are_there_when_it_is_switched_off(board: SimulatedBoard) -> None:
    board.step(0.1)
    assert board.figures is None
    board.close()
    board.close()
    assert board.figures is not None
    assert 0 < board.figures.in_interrupts < board.figures.cycles - board.figures.asleep
    assert board.figures.resets == 0


@built
def test_a_wrong_option_is_said(tmp_path: Path) -> None:
    with SimulatedBoard(BOARD, FIRMWARE, ("--imu-axes", "up")) as board, pytest.raises(BoardError, match="--imu-axes"):
        board.step(0.01)


@built
def test_what_is_no_firmware_is_said(tmp_path: Path) -> None:
    nothing = tmp_path / "nothing.elf"
    nothing.write_bytes(b"no program")
    with SimulatedBoard(BOARD, nothing) as board, pytest.raises(BoardError):
        board.step(0.01)


def test_a_missing_file_says_how_it_is_made(tmp_path: Path) -> None:
    with pytest.raises(BoardError, match="make firmware"):
        SimulatedBoard(tmp_path / "board", tmp_path / "mega.elf")
