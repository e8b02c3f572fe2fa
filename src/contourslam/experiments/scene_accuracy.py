"""How true a 3-D scene is: a simulated drive with camera, mapped, coloured, and held against what was painted."""

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contourslam.config import Config, SlamConfig
from contourslam.errors import ResultError
from contourslam.experiments.known_room import told
from contourslam.recordings.picture import Picture
from contourslam.replay import keep_map, make_mapper, replay
from contourslam.scene.build import Scene, build_scene
from contourslam.scene.lens import Lens
from contourslam.scene.raising import SceneOptions, raise_surfaces
from contourslam.scene.surface import FLAT, Surface
from contourslam.scene.views import Views, choose_views
from contourslam.simulation.camera import FisheyeCamera
from contourslam.simulation.config import CameraModel, SimulationConfig
from contourslam.simulation.filming import film
from contourslam.simulation.room import Room
from contourslam.simulation.simulate import Message, simulate
from contourslam.simulation.textured_world import illumination
from contourslam.simulation.textures import RoomTextures
from contourslam.slam.dense import dense_trajectory

Floats = NDArray[np.float64]

_WITHIN = 0.1  # m between a surface and the true one that it stands for
_FACING = 0.7  # cosine between their normals
_FEWEST = 50  # texels that a surface is judged by


@dataclass(frozen=True, slots=True)
class SurfaceAccuracy:
    """One upright surface against what was painted.

    Attributes
    ----------
    name : str
    texels : int
        Those that pictures show and that have a true surface behind them.
    colour_error : float
        Mean absolute difference of their colours, of 255, after one gain for the whole scene.
    plain_error : float
        The same if all of it had its own mean colour.
    offset : float
        Mean distance from the true surface, m.
    astray : float
        Part of the coloured texels that have no true surface behind them, such as those above furniture.
    """

    name: str
    texels: int
    colour_error: float
    plain_error: float
    offset: float
    astray: float


@dataclass(frozen=True, slots=True)
class SceneAccuracy:
    """A scene against the room that it shows.

    Attributes
    ----------
    scene : Scene
    views : Views
    poses : ndarray, shape (n, 3)
        The way of the base as it was estimated.
    surfaces : tuple of SurfaceAccuracy
        Walls and contours with enough texels to judge.
    gain : float
        What the scene's colours were multiplied by.
    seconds : float
        CPU time of the scene, s.
    """

    scene: Scene
    views: Views
    poses: Floats
    surfaces: tuple[SurfaceAccuracy, ...]
    gain: float
    seconds: float

    def mean(self, value: str) -> float:
        """Mean of an attribute over all surfaces, each weighted by its texels."""
        values = [getattr(surface, value) for surface in self.surfaces]
        return float(np.average(values, weights=[surface.texels for surface in self.surfaces]))


def scene_accuracy(
    room: Room,
    seed: int,
    *,
    config: SimulationConfig | None = None,
    rate: float = 2.0,
    options: SceneOptions | None = None,
    progress: Callable[[float], None] | None = None,
) -> SceneAccuracy:
    """Drive a robot with a camera through a room, map it, make a scene of it, and judge the scene.

    Parameters
    ----------
    room : Room
    seed : int
    config : SimulationConfig, optional
    rate : float
        Pictures per second.
    options : SceneOptions, optional
        By default walls are as high as the room's.
    progress : callable, optional
        Called with the fraction of the pictures that are taken.

    Raises
    ------
    ResultError
        If nothing of the scene can be judged.
    """
    config = config or SimulationConfig()
    run = simulate(room, config, seed)
    messages: list[Message] = []
    pictures: list[Picture] = []
    with FisheyeCamera(room, CameraModel(rate=rate), robot=config.robot, seed=seed) as camera:
        for message in film(run, camera, progress=progress):
            (pictures if isinstance(message, Picture) else messages).append(message)  # type: ignore[arg-type]
        lens, textures = Lens(camera.model, camera.T_base_camera), camera.textures
    settings = told(Config(back_end="graph", slam=SlamConfig(walls=True, contour_matching=True)), config.lidar)
    mapper = make_mapper(settings, lidar_mount=run.lidar_mount, initial_pose=run.initial_pose)
    result = replay(messages, settings, lidar_mount=run.lidar_mount, make=lambda *_, **__: mapper)
    stamps, poses = dense_trajectory(result)
    begun = time.process_time()
    options = options or SceneOptions(height=room.wall_height)
    views = choose_views(pictures, stamps, poses, 300)
    scene = build_scene(raise_surfaces(keep_map(mapper, {}), poses, options), poses, views, lens, options)
    seconds = time.process_time() - begun
    gain, judged = judge_scene(scene, textures)
    return SceneAccuracy(scene, views, poses, judged, gain, seconds)


def judge_scene(scene: Scene, textures: RoomTextures) -> tuple[float, tuple[SurfaceAccuracy, ...]]:
    """Hold the colours of a scene against those of a room's textures, as they are lit.

    Returns
    -------
    gain : float
        What the scene's colours are multiplied by to be as bright as the textures altogether.
    surfaces : tuple of SurfaceAccuracy
    """
    found = []
    normals = np.array([other.normal for other in textures.surfaces])
    for surface, texture, seen in zip(scene.surfaces, scene.textures, scene.seen, strict=True):
        if surface.kind in FLAT or surface.kind == "behind":
            continue
        truth, offsets, there = _truth(surface, seen, textures, normals)
        if there.sum() >= _FEWEST:
            found.append((surface.name, texture[seen][there].astype(float), truth[there], offsets[there], there.mean()))
    if not found:
        raise ResultError("nothing of the scene stands where the room has a surface")
    # The gain for which as much is too bright as too dark.
    gain = float(np.median(np.concatenate([(t.mean(axis=1) + 1.0) / (c.mean(axis=1) + 1.0) for _, c, t, *_ in found])))
    return gain, tuple(
        SurfaceAccuracy(
            name,
            len(truth),
            float(np.abs(gain * colours - truth).mean()),
            float(np.abs(truth.mean(axis=0) - truth).mean()),
            float(offsets.mean()),
            1.0 - float(part),
        )
        for name, colours, truth, offsets, part in found
    )


def _truth(
    surface: Surface, seen: NDArray[np.bool_], textures: RoomTextures, normals: Floats
) -> tuple[Floats, Floats, NDArray[np.bool_]]:
    """True colours of the texels that are seen (n, 3), how far the true surface is, m, and whether there is one."""
    rows, columns = np.nonzero(seen)
    u = (columns + 0.5) / seen.shape[1] * surface.width
    v = (1.0 - (rows + 0.5) / seen.shape[0]) * surface.height
    places = surface.at(u, v)
    colours, offsets = np.zeros((len(places), 3)), np.full(len(places), np.inf)
    for index in np.flatnonzero(normals @ surface.normal > _FACING).tolist():
        other = textures.surfaces[index]
        across, below, before = other.places(places).T
        nearer = (across >= 0) & (across <= other.width) & (below >= 0) & (below <= other.height)
        nearer &= np.abs(before) < np.minimum(offsets, _WITHIN)
        colours[nearer] = other.colours(other.places(places[nearer])[:, :2]) * illumination(normals[index])
        offsets[nearer] = np.abs(before[nearer])
    return colours, offsets, np.isfinite(offsets)
