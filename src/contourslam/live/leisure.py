"""What would hold up a pose, done while no scan waits: the map drawn up, its outlines, and saving by itself."""

import math
from collections.abc import Callable
from pathlib import Path

from contourslam.config import LiveConfig
from contourslam.live.autosave import Autosave
from contourslam.live.backing import Backing
from contourslam.live.outlines import Outlines, outlines
from contourslam.live.processed import Drawn
from contourslam.maps.saved_map import SavedMap
from contourslam.slam.mapper import Mapper


class Leisure:
    """Work that can wait; changed in place.

    Parameters
    ----------
    backing : Backing
    config : LiveConfig
    autosave : Path or None
        Where the map is saved by itself.
    clock : callable or None
        Tells how long it takes to make a map.

    Attributes
    ----------
    drawn : Drawn or None
    outlines : Outlines or None
        As they were drawn up last.
    """

    def __init__(
        self, backing: Backing, config: LiveConfig, autosave: Path | None, clock: Callable[[], float] | None
    ) -> None:
        self._backing, self._clock = backing, clock
        self._autosave: Autosave | None = None
        if autosave is not None and backing.keep and backing.write and not backing.fixed and config.autosave_period > 0:
            self._autosave = Autosave(autosave, config.autosave_period, backing.write)
        self._map_wanted = self._outlines_wanted = False
        self.drawn: Drawn | None = None
        self.outlines: Outlines | None = None

    def want_map(self) -> None:
        """Have the map drawn up."""
        self._map_wanted = True

    def want_outlines(self) -> None:
        """Have the outlines drawn up."""
        self._outlines_wanted = True

    def waited_for(self, version: int) -> bool:
        """Whether somebody waits for what is not there for this version of the map."""
        return (self._map_wanted and (self.drawn is None or self.drawn.version != version)) or (
            self._outlines_wanted and (self.outlines is None or self.outlines.version != version)
        )

    def use(self, mapper: Mapper, keep: Callable[[], SavedMap], version: int, now: float) -> None:
        """Do what is wanted and due."""
        if self._map_wanted and (self.drawn is None or self.drawn.version != version):
            self.drawn = Drawn(version, mapper.corner_map(), mapper.wall_map())
            self._map_wanted = False
        if self._outlines_wanted and (self.outlines is None or self.outlines.version != version):
            self.outlines = outlines(*self._backing.standing(mapper), version)
            self._outlines_wanted = False
        saving = self._autosave
        if saving is not None and saving.due(version, now):
            saving.hand_over(keep, version, now)
            if self._clock is not None:
                saving.took(self._clock() - now, now)

    def set_aside(self, keep: Callable[[], SavedMap], version: int) -> None:
        """Save the map that is about to be left; whatever is wrong with that must not keep from going on."""
        if self._autosave is not None and version > 0:
            self._autosave.set_aside(keep)

    def close(self, keep: Callable[[], SavedMap], version: int, now: float) -> None:
        """Save what has not been saved by itself yet."""
        if self._autosave is not None:
            self._autosave.close(keep, version, now)

    @property
    def saving_to(self) -> str:
        """Where the map is saved by itself; empty for nowhere."""
        return "" if self._autosave is None else str(self._autosave.path)

    @property
    def saved_at(self) -> float:
        """When it was last, s on the caller's clock; NaN where it never was."""
        return math.nan if self._autosave is None else self._autosave.saved_at

    @property
    def trouble(self) -> str:
        """What was wrong with saving; empty where nothing was."""
        return "" if self._autosave is None else self._autosave.trouble
