"""Bags that were cut short or damaged, read from front to back up to the damage.

rosbags reads a bag through its index and refuses one that has none, which is what a recorder leaves that was killed.
"""

from contourslam.recordings.salvage import bag1, mcap, sqlite
from contourslam.recordings.salvage.raw import DamagedError, RawMessage

SCANNERS = {bag1.MAGIC: bag1.bag1_messages, mcap.MAGIC: mcap.mcap_messages, sqlite.MAGIC: sqlite.sqlite_messages}

__all__ = ["SCANNERS", "DamagedError", "RawMessage"]
