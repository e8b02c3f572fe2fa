"""A room as pictures show it: a MuJoCo model of its textured surfaces, its light, and the robot in it.

Nothing in it is ever stepped, and no lidar looks at it: the world of the physics, :mod:`contourslam.simulation.world`,
is another model and knows nothing of textures, ceiling or mast.
"""

from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contourslam.simulation.config import RobotModel
from contourslam.simulation.mjcf import add, import_mujoco
from contourslam.simulation.pieces import Cylinder
from contourslam.simulation.robot import Standing, add_robot, draw_flaws
from contourslam.simulation.textures import RoomTextures, Surface

Floats = NDArray[np.float64]

_AMBIENT = 0.62
_LAMPS = (((0.5, 0.3, 0.81), 0.22), ((-0.6, 0.75, 0.28), 0.16), ((0.0, 0.0, -1.0), 0.32))  # whence, and how bright


def illumination(normals: ArrayLike) -> Floats:
    """How bright surfaces are lit: what a picture shows is the texture's values times this, before exposure.

    The light is white, the same all over a flat surface, from all around and from three sides; there are no cast
    shadows and no gloss. Values are those of the picture file (sRGB), not of linear light.

    Parameters
    ----------
    normals : array_like, shape (n, 3)
        Unit vectors out of the surfaces, world frame.

    Returns
    -------
    ndarray, shape (n,)
        0.62 to 1.
    """
    normals = np.asarray(normals, dtype=np.float64).reshape(-1, 3)
    return _AMBIENT + sum(
        (gain * np.clip(normals @ (np.array(at) / np.linalg.norm(at)), 0.0, None) for at, gain in _LAMPS),
        start=np.zeros(len(normals)),
    )


def compile_textured_world(textures: RoomTextures, robot: RobotModel, T_base_camera: Floats) -> Any:
    """Compile the model (``mujoco.MjModel``): its first joint is the robot's, free.

    Parameters
    ----------
    textures : RoomTextures
    robot : RobotModel
    T_base_camera : ndarray, shape (4, 4)
        Where the mast ends that carries the camera.

    Raises
    ------
    MissingExtraError
        If MuJoCo is not installed.
    """
    mujoco = import_mujoco()
    root = ElementTree.Element("mujoco", model=textures.room.name)
    world = add(root, "worldbody")
    add_robot(root, world, Standing(robot, draw_flaws(0), textures.room.start))
    body = world[0]
    _add_mast(body, T_base_camera, robot.wheel_radius)
    spec = mujoco.MjSpec.from_string(ElementTree.tostring(root, encoding="unicode"))
    spec.visual.quality.offsamples = 0
    spec.visual.map.znear, spec.visual.map.zfar = 0.01, 100.0
    spec.visual.headlight.ambient = [_AMBIENT] * 3
    spec.visual.headlight.diffuse = spec.visual.headlight.specular = [0.0, 0.0, 0.0]
    directional = mujoco.mjtLightType.mjLIGHT_DIRECTIONAL
    for whence, gain in _LAMPS:
        looks = {"ambient": [0, 0, 0], "diffuse": [gain] * 3, "specular": [0, 0, 0], "castshadow": False}
        spec.worldbody.add_light(type=directional, dir=[-x for x in whence], **looks)
    groups: dict[int, list[Surface]] = {}
    for surface in textures.surfaces:
        groups.setdefault(id(surface.image), []).append(surface)
    for index, group in enumerate(groups.values()):
        _add_surfaces(mujoco, spec, f"surfaces{index}", group)
    for piece in textures.room.pieces:
        if isinstance(piece, Cylinder):  # its mantle is a surface; this closes it above and below
            size = [0.98 * piece.radius, (piece.top - piece.bottom) / 2 - 0.001, 0.0]
            at, colour = [piece.x, piece.y, (piece.top + piece.bottom) / 2], [*piece.colour, 1]
            spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_CYLINDER, size=size, pos=at, rgba=colour)
    return spec.compile()


def _add_surfaces(mujoco: Any, spec: Any, name: str, surfaces: list[Surface]) -> None:
    """Add the surfaces that share an image, as one mesh."""
    image = surfaces[0].image
    rows, columns = image.shape[:2]
    texture = spec.add_texture(name=name, type=mujoco.mjtTexture.mjTEXTURE_2D, width=columns, height=rows, nchannel=3)
    # MuJoCo keeps the image's rows from the top; v of a vertex below runs upwards.
    texture.data = image.tobytes()
    material = spec.add_material(name=name, specular=0.0, shininess=0.0, reflectance=0.0)
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = name
    corners, texels = zip(*(_quad(surface) for surface in surfaces), strict=True)
    first = 4 * np.arange(len(surfaces))[:, None]
    mesh = spec.add_mesh(name=name, inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL, smoothnormal=False)
    mesh.uservert = np.concatenate(corners).ravel()
    mesh.userface = np.concatenate([first + np.array([0, 1, 2]), first + np.array([0, 2, 3])]).ravel()
    mesh.usertexcoord = np.concatenate(texels).ravel()
    mesh.usernormal = np.repeat([surface.normal for surface in surfaces], 4, axis=0).ravel()
    shape = {"type": mujoco.mjtGeom.mjGEOM_MESH, "meshname": name, "material": name}
    spec.worldbody.add_geom(name=name, contype=0, conaffinity=0, **shape)


def _quad(surface: Surface) -> tuple[Floats, Floats]:
    """Corners counter-clockwise from the upper left as seen from its front, (4, 3), and their texture coordinates."""
    places = np.array([[0, 0], [0, surface.height], [surface.width, surface.height], [surface.width, 0]])
    rows, columns = surface.image.shape[:2]
    texels = (places / surface.metres_per_pixel + surface.offset) / [columns, rows]
    return surface.points(places), np.stack([texels[:, 0], texels[:, 1]], axis=1)


def _add_mast(body: Any, T_base_camera: Floats, wheel_radius: float) -> None:
    """Add a thin post behind the lidar and an arm over it, to just behind the lens."""
    x, y, z = T_base_camera[:3, 3] - 3.0 * 0.01 * T_base_camera[:3, 2]
    foot, grey = min(0.04, x), [0.25, 0.25, 0.27, 1]
    z, low = z - wheel_radius, 0.115 - wheel_radius
    if z - low > 0.01:
        add(body, "geom", type="cylinder", size=[0.004, (z - low) / 2], pos=[foot, y, (z + low) / 2], rgba=grey)
    if x - foot > 0.01:
        add(body, "geom", type="cylinder", size=[0.004], fromto=[foot, y, z, x, y, z], rgba=grey)
