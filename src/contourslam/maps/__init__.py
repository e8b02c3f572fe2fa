"""Maps that are kept: what a later drive needs to go on in them, or to find itself there."""

from contourslam.maps.saved_map import Contoured, Relations, SavedMap, Seen, Stretches

__all__ = ["Contoured", "Relations", "SavedMap", "Seen", "Stretches"]
