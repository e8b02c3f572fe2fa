"""A fleet that is played dies as programs do: with what they had not sent, and not with what they had kept."""

from functools import cache
from pathlib import Path

import pytest

pytest.importorskip("gtsam", reason="needs the extra 'graph'")

from contourslam.config import Config
from contourslam.fleet.channel import Channel
from contourslam.fleet.play import Fleet, play
from contourslam.fleet.play_robot import Message, Player
from contourslam.live.warming import made_up_drive

CONFIG = Config(back_end="graph")


@cache
def messages() -> tuple[Message, ...]:
    return tuple(message for odometry, scan, _ in made_up_drive(0.4) for message in (odometry, scan))


MIDDLE = 0.5 * (messages()[-1].stamp - messages()[0].stamp)


def mapped(fleet: Fleet) -> dict[int, int]:
    """How many keyframes of each run have come into a common map."""
    return {run: n for shared in fleet.maps for (_, run), n in zip(shared.members, shared.counts, strict=True)}


def test_a_robot_that_dies_loses_its_map_and_all_that_it_had_not_sent(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its first half is sent into a closed air, and nobody is left who could send it again."""
    send = Channel.send
    monkeypatch.setattr(Channel, "send", lambda way, now, data: now > MIDDLE and send(way, now, data))
    fleet = play([Player("a", messages(), restarts=(MIDDLE,))], CONFIG)
    (robot,) = fleet.robots
    first, second = dict.fromkeys(told.run for told in robot.told)
    assert robot.restarts == 1
    assert mapped(fleet).keys() == {second}
    assert mapped(fleet)[second] > 0
    assert first != second


def test_what_was_sent_before_a_robot_died_still_arrives() -> None:
    fleet = play([Player("a", messages(), restarts=(MIDDLE,))], CONFIG)
    assert len(mapped(fleet)) == 2
    assert min(mapped(fleet).values()) > 0


def test_a_server_that_dies_goes_on_from_what_it_kept(tmp_path: Path) -> None:
    players = [Player("a", messages())]
    fleet, whole = play(players, CONFIG, folder=tmp_path, server_restarts=(MIDDLE,)), play(players, CONFIG)
    assert fleet.restarts == 1
    assert mapped(fleet) == mapped(whole)
    assert fleet.faults == ()


def test_a_restart_after_the_end_never_comes_and_is_not_counted(tmp_path: Path) -> None:
    fleet = play([Player("a", messages(), restarts=(1e6,))], CONFIG, folder=tmp_path, server_restarts=(1e6,))
    assert (fleet.robots[0].restarts, fleet.restarts) == (0, 0)
