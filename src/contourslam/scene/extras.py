"""The libraries that scenes need beyond the core's."""

from importlib.util import find_spec

from contourslam.errors import MissingExtraError

_NEEDED = {"cv2": "OpenCV", "PIL": "Pillow", "trimesh": "trimesh"}


def check_extras() -> None:
    """Say which library is missing, before any work is done.

    Raises
    ------
    MissingExtraError
        If one is not installed.
    """
    missing = [name for module, name in _NEEDED.items() if find_spec(module) is None]
    if missing:
        raise MissingExtraError(f"scenes need {' and '.join(missing)}: pip install 'contourslam[camera]'")
