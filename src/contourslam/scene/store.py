"""The folder of a scene: the model, two pictures of it, and what there is to say about it."""

import io
import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contourslam import __version__
from contourslam.atomic import make_folder, write_bytes, write_text
from contourslam.scene.atlas import pack
from contourslam.scene.build import Scene
from contourslam.scene.glb import to_glb
from contourslam.scene.preview import doll_house, from_inside
from contourslam.scene.views import Views

Floats = NDArray[np.float64]

GLB, ABOVE, INSIDE, ABOUT = "scene.glb", "preview.png", "inside.png", "scene.json"


def write_scene(folder: Path, scene: Scene, views: Views, poses: Floats) -> dict[str, Any]:
    """Write a scene's files; they are made before the first is written, and each is whole or not there.

    Parameters
    ----------
    folder : Path
        Made where needed; files of the same names are replaced.
    scene : Scene
    views : Views
        The pictures that it was coloured from.
    poses : ndarray, shape (n, 3)
        The way of the base.

    Returns
    -------
    dict
        What ``scene.json`` holds.

    Raises
    ------
    ResultError
        If a file cannot be written.
    MissingExtraError
        If trimesh or Pillow is not installed.
    """
    make_folder(folder)
    parts = [scene.seen_part(index) for index in range(len(scene.surfaces))]
    model = to_glb(scene.surfaces, pack(list(scene.textures)), parts)
    pictures = {ABOVE: _png(doll_house(scene)), INSIDE: _png(from_inside(scene, poses))}
    about = {
        "contourslam": __version__,
        "bytes": len(model),
        "walls": sum(surface.kind == "wall" for surface in scene.surfaces),
        "surfaces": len(scene.surfaces),
        "area": sum(surface.area for surface in scene.surfaces),
        "texel": scene.texel,
        "seen": {kind: scene.share(kind) for kind in dict.fromkeys(surface.kind for surface in scene.surfaces)},
        "pictures": {
            "recorded": views.seen,
            "without_pose": views.placeless,
            "used": len(views.chosen) - scene.damaged,
            "damaged": scene.damaged,
        },
        "notes": list(scene.notes),
    }
    for name, content in pictures.items():
        write_bytes(folder / name, content)
    write_text(folder / ABOUT, json.dumps(about, indent=2) + "\n")
    write_bytes(folder / GLB, model)
    return about


def _png(image: NDArray[np.uint8]) -> bytes:
    from PIL import Image

    content = io.BytesIO()
    Image.fromarray(image).save(content, format="PNG")
    return content.getvalue()
