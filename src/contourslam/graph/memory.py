"""What the graph knows of a building, from all drives in it."""

from dataclasses import dataclass

import gtsam

from contourslam.config import Config
from contourslam.contour.contours import Floats
from contourslam.detectors import Detector
from contourslam.graph.doubt import DoubtTree
from contourslam.graph.landmarks import Landmarks
from contourslam.graph.places import Keyframe, Places
from contourslam.graph.pose_graph import PoseGraph
from contourslam.matching.odometry import LENGTH, ContourOdometry


@dataclass(frozen=True, slots=True)
class Settled:
    """Keyframes as a refinement found them.

    Attributes
    ----------
    poses, covariances : ndarray, shape (k, 3) and (k, 3, 3)
        In the world.
    factors : gtsam.NonlinearFactorGraph or None
        What binds them: the factors of the graph, and after them the ties of the refinement. None where they are those
        of the graph.
    """

    poses: Floats
    covariances: Floats
    factors: gtsam.NonlinearFactorGraph | None = None


class Memory:
    """Keyframes, places, landmarks and what binds them; changed in place by every keyframe.

    Parameters
    ----------
    config : Config
    detector : Detector
    mount : ndarray, shape (3,)
        ``T_base_lidar``.

    Attributes
    ----------
    graph : PoseGraph
    keyframes : list of Keyframe
    places : Places
    doubt : DoubtTree
    landmarks : Landmarks
    nodes : dict of int to int
        Node in the tree of doubt of each local map, by its anchor.
    contour : ContourOdometry or None
        Of the drive that goes on.
    settled : Settled or None
        The keyframes of earlier drives as they were kept, until the drive adds one.
    """

    def __init__(self, config: Config, detector: Detector, mount: Floats) -> None:
        self.graph, self.doubt = PoseGraph(), DoubtTree()
        self.keyframes: list[Keyframe] = []
        self.places = Places(self.keyframes, config.lidar.max_range + LENGTH)
        self.landmarks = Landmarks(config, detector, mount, self.doubt)
        self.nodes: dict[int, int] = {}
        self.contour: ContourOdometry | None = None
        self.settled: Settled | None = None
