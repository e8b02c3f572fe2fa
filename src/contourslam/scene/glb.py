"""The scene as a binary glTF file: metres, y up, colours shown as they are."""

import io
from importlib import import_module
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from contourslam import __version__
from contourslam.scene.atlas import Atlas, Place
from contourslam.scene.extras import check_extras
from contourslam.scene.surface import Surface

Floats = NDArray[np.float64]

_QUALITY = 90  # of the JPEG textures
_UNLIT = "KHR_materials_unlit"
_LINEAR, _MIPMAPPED, _CLAMP, _VERTICES, _INDICES = 9729, 9987, 33071, 34962, 34963  # OpenGL's numbers, as in glTF


def to_glb(surfaces: tuple[Surface, ...], atlas: Atlas, seen: list[float]) -> bytes:
    """Write surfaces with their textures as glTF 2.0.

    Each surface is a node of its name. Its extras say of which kind it is, and which part of it pictures show.

    Parameters
    ----------
    surfaces : tuple of Surface
    atlas : Atlas
        Their textures, in the same order.
    seen : list of float
        Part of each surface that has a colour from pictures, in [0, 1].

    Returns
    -------
    bytes
        The file.

    Raises
    ------
    MissingExtraError
        If trimesh or Pillow is not installed.
    """
    check_extras()
    from PIL import Image

    trimesh, gltf, material, texture = (  # most of which says nothing of its types
        cast(Any, import_module(f"trimesh{part}"))
        for part in ("", ".exchange.gltf", ".visual.material", ".visual.texture")
    )
    # Stand-ins, which differ so that trimesh keeps them apart; the sheets take their places as JPEG.
    standins = [Image.new("RGB", (1, 1), (n % 256, n // 256, 0)) for n in range(len(atlas.sheets))]
    materials = [
        material.PBRMaterial(name=f"sheet-{n}", baseColorTexture=standin, metallicFactor=0.0, roughnessFactor=1.0)
        for n, standin in enumerate(standins)
    ]
    scene = trimesh.Scene()
    for surface, place, part in zip(surfaces, atlas.places, seen, strict=True):
        corners, uv = _corners(surface), _uv(surface, place, atlas.sheets[place.sheet].shape)
        faces = 4 * np.arange(len(corners) // 4)[:, None, None] + np.array([[0, 1, 2], [0, 2, 3]])
        mesh = trimesh.Trimesh(
            corners[:, [0, 2, 1]] * [1.0, 1.0, -1.0],
            faces.reshape(-1, 3),
            visual=texture.TextureVisuals(uv=uv, material=materials[place.sheet]),
            process=False,
            validate=False,
        )
        mesh.metadata = {"kind": surface.kind, "seen": round(part, 3)}
        scene.add_geometry(mesh, node_name=surface.name, geom_name=surface.name)

    def put_images(buffers: Any, tree: dict[str, Any]) -> None:
        keys = list(buffers)
        for image, sheet in zip(tree["images"], atlas.sheets, strict=True):
            content = io.BytesIO()
            Image.fromarray(sheet).save(content, format="JPEG", quality=_QUALITY, subsampling=0)
            data = content.getvalue()
            buffers[keys[image["bufferView"]]] = data + b"\0" * (-len(data) % 4)
            image["mimeType"] = "image/jpeg"

    return bytes(
        gltf.export_glb(scene, include_normals=False, buffer_postprocessor=put_images, tree_postprocessor=_finish)
    )


def _finish(tree: dict[str, Any]) -> None:
    """Say what trimesh leaves out: how textures and materials are to be shown, and what the buffers are for."""
    tree["samplers"] = [{"magFilter": _LINEAR, "minFilter": _MIPMAPPED, "wrapS": _CLAMP, "wrapT": _CLAMP}]
    for texture in tree["textures"]:
        texture["sampler"] = 0
    for material in tree["materials"]:
        material["extensions"] = {_UNLIT: {}}
    for primitive in (primitive for mesh in tree["meshes"] for primitive in mesh["primitives"]):
        for accessor, target in (
            (primitive["indices"], _INDICES),
            *((number, _VERTICES) for number in primitive["attributes"].values()),
        ):
            tree["bufferViews"][tree["accessors"][accessor]["bufferView"]]["target"] = target
    tree["extensionsUsed"] = sorted({*tree.get("extensionsUsed", []), _UNLIT})
    tree["asset"] = {"version": "2.0", "generator": f"contourslam {__version__}"}


def _rectangles(surface: Surface) -> Floats:
    """Left, lower, right, upper of each rectangle of a surface, m."""
    whole = np.array([[0.0, 0.0, surface.width, surface.height]])
    return whole if surface.parts is None else surface.parts


def _corners(surface: Surface) -> Floats:
    """Corners of the rectangles, counter-clockwise to the viewer, shape (4 n, 3)."""
    parts = _rectangles(surface)
    return surface.at(parts[:, [0, 2, 2, 0]], parts[:, [1, 1, 3, 3]]).reshape(-1, 3)


def _uv(surface: Surface, place: Place, sheet: tuple[int, ...]) -> Floats:
    """The same corners on the sheet, from its lower left as trimesh counts, shape (4 n, 2)."""
    parts = _rectangles(surface)
    right = place.column + place.columns * parts[:, [0, 2, 2, 0]] / surface.width
    down = place.row + place.rows * (1.0 - parts[:, [1, 1, 3, 3]] / surface.height)
    return np.stack([right / sheet[1], 1.0 - down / sheet[0]], axis=-1).reshape(-1, 2)
