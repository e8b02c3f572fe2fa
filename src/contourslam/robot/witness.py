"""Who watches a robot."""

from collections.abc import Callable
from dataclasses import dataclass

from contourslam.contour.contours import Floats
from contourslam.live.session import Session
from contourslam.live.worker import Onlooker
from contourslam.robot.bring_up import Event, Robot


@dataclass(frozen=True, slots=True)
class Witness:
    """What is called while a robot maps; it must be quick.

    Attributes
    ----------
    watch : callable
        Shown each event of the robot.
    follow : callable
        Given the session before its first scan, and ``T_base_lidar``, gives who watches the mapping.
    """

    watch: Callable[[Event], None]
    follow: Callable[[Session, Floats], Onlooker]


MakeWitness = Callable[[Robot], Witness]
"""Makes one for a robot before its parts are brought up."""
