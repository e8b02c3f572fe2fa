"""A recording as a show: a player, its lanes, and what the pages are told of them."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from contourslam.config import Config
from contourslam.contour.contours import Floats
from contourslam.detectors import make_detector
from contourslam.errors import ConfigError
from contourslam.replay import MakeMapper, Message, make_mapper
from contourslam.view.fed_lane import FedLane
from contourslam.view.lag import Lag
from contourslam.view.memory import Memory
from contourslam.view.pace import Pace
from contourslam.view.painter import Painter
from contourslam.view.player import Player
from contourslam.view.show import Show

MOST_LANES = 4


class Replayed:
    """A recording that is mapped while it is watched.

    Parameters
    ----------
    messages : iterable of LaserScan, Odometry or TruePose
    config : Config
        Its detector is that of the only lane where `detectors` is left out.
    detectors : sequence of str, optional
        Names, one a lane, side by side.
    title : str
        What the page calls the recording.
    duration : float, optional
        Its length, s, where it is known.
    lidar_mount : tuple of float, optional
        ``T_base_lidar``; that of the configuration by default.
    pace : Pace, optional
    memory : Memory, optional
    make : callable
        Makes the mappers.

    Attributes
    ----------
    player : Player
        Not yet started.
    show : Show
    lag : Lag
    pace : Pace

    Raises
    ------
    ConfigError
        If a detector does not exist, is named twice, or there are more than four.
    """

    def __init__(
        self,
        messages: Iterable[Message],
        config: Config,
        detectors: Sequence[str] = (),
        *,
        title: str,
        duration: float | None = None,
        lidar_mount: tuple[float, float, float] | None = None,
        pace: Pace | None = None,
        memory: Memory | None = None,
        make: MakeMapper = make_mapper,
    ) -> None:
        names = tuple(detectors) or (config.detector,)
        if not len(set(names)) == len(names) <= MOST_LANES:
            raise ConfigError(f"name one to {MOST_LANES} detectors, each once, got {', '.join(names)}")
        self._configs = [replace(config, detector=name) for name in names]
        self._detectors = [make_detector(name, adapted=config.adapted) for name in names]
        self._mount = None if lidar_mount is None else np.array(lidar_mount, dtype=np.float64)
        self._make = make
        self.pace, self.lag = pace or Pace(), Lag()
        self._memory = memory or Memory(len(names))
        self.player = Player(messages, self._make_lanes, self._memory, self.pace)
        mount = np.array(config.lidar.mount) if self._mount is None else self._mount
        about = {
            "title": title,
            "lanes": names,
            "back_end": config.back_end,
            "duration": duration,
            "mount": mount,
            "live": False,
            "max_false_negative_rate": config.slam.max_false_negative_rate,
        }
        painter = Painter(config, self._detectors)
        self.show = Show(about, self._memory, painter, self.pace, self._status, self._story)

    def _make_lanes(self, start: Floats | None) -> Sequence[FedLane]:
        return [
            FedLane(config, detector, self._make, start, self._mount)
            for config, detector in zip(self._configs, self._detectors, strict=True)
        ]

    def _status(self) -> Mapping[str, Any]:
        player, pace, newest = self.player, self.pace, self._memory.newest
        return {
            "state": player.state,
            "trouble": player.trouble,
            "hurries_to": pace.hurries_to if player.state in ("starting", "mapping") else None,
            "reached": pace.reached(),
            "head": 0.0 if newest is None else newest.elapsed,
            "scans": 0 if newest is None else newest.index + 1,
            "scan_rate": pace.rate(),
            "beams": 0 if newest is None else player.keeper.beams,
            "returned": 0 if newest is None else player.keeper.returned,
            "lag": self.lag.summary(),
            "pages": self.lag.pages,
        }

    def _story(self, lane: int, number: int) -> Mapping[str, Any]:
        lanes = self.player.lanes
        return lanes[lane].stories.story(number) if lane < len(lanes) else {}
