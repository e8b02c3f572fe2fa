"""A robot that is watched while somebody pushes it: its parts brought up, what they see mapped, nothing driven."""

from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

from contourslam.cli.console import note
from contourslam.cli.interrupt import Interrupt
from contourslam.cli.serving import Page, print_link

if TYPE_CHECKING:
    from contourslam.config import Config
    from contourslam.robot.bring_up import Event

_LOOK = 0.1  # s between two looks at Ctrl-C
_PATIENCE = 30.0  # s that a part that was unplugged is waited for before its trouble is told; it is after that too
_PICTURES = 1.0  # a second, which nobody looks at but whoever asks whether the camera works


def watch_robot(path: Path | None, settings: "Config", page: Page, *, with_base: bool) -> int:
    """Map what a robot sees until Ctrl-C, and serve the page.

    Parameters
    ----------
    path : Path or None
        The robot.yaml; None for the defaults.
    settings : Config
    page : Page
    with_base : bool
        Bring up the base too; else its lidar alone, carried by hand.

    Returns
    -------
    int
        Exit code: 1 where no turn of the lidar was completed.
    """
    from contourslam.live.warming import warm_up
    from contourslam.robot.bring_up import Openers, Robot, openers
    from contourslam.robot.config import RobotConfig, load_robot
    from contourslam.robot.journey import Journey
    from contourslam.robot.live_map import PATIENT, LiveMap, settings_of

    config = RobotConfig() if path is None else load_robot(path)
    settings = settings_of(config, settings)
    parts = openers(config, patience=_PATIENCE, rate=_PICTURES)
    if not with_base:
        parts = Openers(lidar=parts.lidar)
    with ExitStack() as stack:
        robot = Robot(parts)
        title = "robot" if path is None else path.stem
        witness = page.witness(stack, settings, title, driven=False, say=print_link)(robot)
        note("making ready")
        warm_up(settings)
        interrupt = stack.enter_context(Interrupt())
        live_map = LiveMap(
            settings, PATIENT, lidar_mount=config.lidar.mount, onlooker=witness.follow, keeps=False,
            expects_odometry=with_base,
        )  # fmt: skip
        stack.callback(live_map.close)
        stack.enter_context(robot)

        def watch(event: "Event") -> None:
            witness.watch(event)
            tell_trouble(event)

        journey = Journey(robot, live_map, watch=watch)
        while not interrupt.requested:
            event = robot.next(_LOOK)
            if event is not None:
                journey.take(event)
    if not journey.scans:
        note("no turn of the lidar was completed")
    return 0 if journey.scans else 1


def tell_trouble(event: "Event") -> None:
    """Say what went wrong with a part, or that it is there again."""
    from contourslam.robot.bring_up import Trouble

    if isinstance(event, Trouble):
        note(event.message or f"the {event.part} is there again")
