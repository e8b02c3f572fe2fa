"""The figures, each one function from data to a matplotlib figure; nothing here touches pyplot's global state."""

from contourslam.errors import MissingExtraError

try:
    import matplotlib
except ImportError as error:
    raise MissingExtraError("figures need matplotlib; install it with: pip install 'contourslam[report]'") from error

__all__ = ["matplotlib"]
