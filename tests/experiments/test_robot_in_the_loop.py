"""A robot in the loop that is ended before its drive."""

from contextlib import ExitStack
from types import SimpleNamespace
from typing import Any

import pytest

from contourslam.errors import ContourslamError
from contourslam.experiments.loop_values import SETTINGS, LoopConfig
from contourslam.experiments.robot_in_the_loop import _drive
from contourslam.robot.bring_up import Openers
from contourslam.robot.config import RobotConfig


def test_one_that_is_ended_before_it_drives_says_so() -> None:
    world: Any = SimpleNamespace(start=(0.0, 0.0, 0.0))
    with ExitStack() as stack, pytest.raises(ContourslamError, match="was ended before it drove"):
        _drive(LoopConfig(), SETTINGS, RobotConfig(), Openers(), world, None, lambda share: None, lambda: True, stack)
