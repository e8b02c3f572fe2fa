"""The building-scale back end: keyframes, factors, loop closure, and the refinement of the whole map."""

from contourslam.errors import MissingExtraError

try:
    import gtsam as gtsam
except ModuleNotFoundError as error:
    raise MissingExtraError(
        "the graph back end needs GTSAM, which is not installed: pip install 'contourslam[graph]', or choose the "
        "filter with --back-end ekf"
    ) from error

from contourslam.graph.keeping import kept, resume
from contourslam.graph.slam import GraphSlam

__all__ = ["GraphSlam", "kept", "resume"]
