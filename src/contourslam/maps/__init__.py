"""Maps that are kept: what a later drive needs to go on in them, or to find itself there."""

from contourslam.maps.file import SUFFIX, load_map, save_map
from contourslam.maps.saved_map import Contoured, Relations, SavedMap, Seen, Stretches

__all__ = ["SUFFIX", "Contoured", "Relations", "SavedMap", "Seen", "Stretches", "load_map", "save_map"]
