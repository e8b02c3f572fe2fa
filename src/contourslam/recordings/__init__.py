"""Reading and writing of recordings, trajectories and relations; everything is checked, nothing is held whole."""

from contourslam.recordings.base_readings import BaseReading, InertialReading, WheelReading
from contourslam.recordings.opening import open_recording
from contourslam.recordings.picture import Picture
from contourslam.recordings.recording import Camera, Message, Recording, Topic
from contourslam.recordings.relations import read_relations
from contourslam.recordings.trajectories import read_trajectory, write_trajectory
from contourslam.recordings.writer import RecordingWriter, write_recording

__all__ = [
    "BaseReading",
    "Camera",
    "InertialReading",
    "Message",
    "Picture",
    "Recording",
    "RecordingWriter",
    "Topic",
    "WheelReading",
    "open_recording",
    "read_relations",
    "read_trajectory",
    "write_recording",
    "write_trajectory",
]
