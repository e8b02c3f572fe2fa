"""``contourslam scene``: a run's map as a 3-D model, coloured from the camera's pictures."""

import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from contourslam.cli.console import Bar, complain, note, print_json
from contourslam.cli.options import Flag, Json, Overwrite
from contourslam.errors import ConfigError, RecordingError, ResultError
from contourslam.nearest import near_file

if TYPE_CHECKING:
    from collections.abc import Iterator

    from contourslam.maps import SavedMap
    from contourslam.recordings import Recording
    from contourslam.recordings.picture import Picture
    from contourslam.scene.lens import Lens


@dataclass(frozen=True)
class Scene:
    """Raise the walls of a run's map, colour them from the pictures of the recording, and write a 3-D model.

    The folder `scene` in DIR gets scene.glb, which any glTF viewer opens, preview.png and inside.png, pictures of it,
    and scene.json. How high furniture is, up to the height of the walls, is found from the pictures; what no picture
    shows is plain and hatched. The page of the run, index.html, then shows the preview.

    Example: contourslam scene out/room --height 2.4
    """

    folder: Annotated[tyro.conf.Positional[Path], tyro.conf.arg(metavar="DIR")]
    """Folder that `contourslam run` wrote."""
    recording: Path | None = None
    """The recording that was mapped, with pictures; where left out, the one that the run names."""
    robot: Annotated[Path | None, tyro.conf.arg(metavar="robot.yaml")] = None
    """Take the camera's lens and place from this file, in place of the recording's."""
    picture_topic: str | None = None
    """Topic of the pictures; found by itself where there is only one."""
    height: float = 2.5
    """Height of the walls, m."""
    furniture_height: float = 0.8
    """Height of furniture where the pictures do not tell it, m."""
    given_heights: Flag = False
    """Do not look at the pictures for heights: walls and furniture get these two."""
    texel: float = 0.015
    """Side of the squares that surfaces are coloured in, m."""
    max_pictures: int = 300
    """How many pictures to use at the most, spread over the way."""
    overwrite: Overwrite = False
    json: Json = False

    def execute(self, command: str) -> int:
        """Build the scene, write it and say what came out."""
        from contourslam.recordings import open_recording
        from contourslam.recordings.trajectories import read_trajectory
        from contourslam.scene.build import build_scene
        from contourslam.scene.raising import SceneOptions, raise_surfaces
        from contourslam.scene.store import GLB, write_scene
        from contourslam.scene.views import choose_views

        options = self._options(SceneOptions)
        target = self.folder / "scene"
        if (target / GLB).exists() and not self.overwrite:
            raise ResultError(f"{target / GLB} is there already; replace it with --overwrite")
        saved = _map(self.folder)
        try:
            stamps, poses = read_trajectory(self.folder / "trajectory.tum")
        except RecordingError as missing:
            raise ResultError(f"{missing}; `contourslam run` writes it") from missing
        path = self.recording or _recording_of(self.folder, saved)
        recording = open_recording(path)
        lens = _lens(recording, self.robot, self.picture_topic)
        damage: list[RecordingError] = []

        def undamaged() -> "Iterator[Picture]":
            try:
                yield from recording.pictures(self.picture_topic)
            except RecordingError as error:
                damage.append(error)

        with Bar("colouring") as bar:
            views = choose_views(undamaged(), stamps, poses, self.max_pictures)
            if not views.seen:
                raise damage[0] if damage else RecordingError(_no_pictures(recording))
            surfaces = raise_surfaces(saved, poses, options)
            scene = build_scene(surfaces, poses, views, lens, options, bar.to)
            about = write_scene(target, scene, views, poses)
        _add_to_page(self.folder)
        for text in scene.notes:
            note(text)
        for reason, count in recording.skipped_pictures.items():
            note(f"skipped {count}: {reason}")
        if self.json:
            print_json(about)
        else:
            _tell(target / GLB, about)
        if damage:
            complain(f"{damage[0]}; the scene shows what came before")
            return 1
        return 0

    def _options(self, kind: Any) -> Any:
        for name in ("height", "furniture_height"):
            if not 0.1 <= getattr(self, name) <= 20.0:
                raise ConfigError(
                    f"--{name.replace('_', '-')} must lie between 0.1 and 20 m, got {getattr(self, name)}"
                )
        if not 0.002 <= self.texel <= 0.5:
            raise ConfigError(f"--texel must lie between 0.002 and 0.5 m, got {self.texel}")
        if self.max_pictures < 2:
            raise ConfigError(f"--max-pictures must be 2 or more, got {self.max_pictures}")
        return kind(self.height, self.furniture_height, not self.given_heights, self.texel)


def _map(folder: Path) -> "SavedMap":
    """The map with its contours, or where an older run kept none, its walls alone."""
    from contourslam.maps import SavedMap, load_map
    from contourslam.report.map_reader import read_geojson

    if not folder.is_dir():
        raise ResultError(
            f"{folder}: there is no such result folder{near_file(folder)}; "
            f"`contourslam run RECORDING -o {folder}` writes one"
        )
    if (folder / "map.cmap").exists():
        return load_map(folder / "map.cmap")
    return SavedMap(*read_geojson(folder / "map.geojson"))


def _recording_of(folder: Path, saved: "SavedMap") -> Path:
    """The recording in the folder, where a drive left it, or that the run's command names, if it is still there."""
    from contourslam.report.result_folder import read_metrics

    if (folder / "recording").exists():
        return folder / "recording"

    words = shlex.split(str(read_metrics(folder / "metrics.json").get("command", "")))
    name = saved.about.get("recordings", "").splitlines()[-1:]
    for word in words[2:]:
        if Path(word).exists() and not word.startswith("-") and (not name or Path(word).name == name[0]):
            return Path(word)
    mapped = f" ({name[0]})" if name else ""
    raise ResultError(f"{folder}: the recording that it was made from{mapped} is not found; name it with --recording")


def _lens(recording: "Recording", robot: Path | None, topic: str | None) -> "Lens":
    from contourslam.scene.lens import Lens

    if robot is not None:
        from contourslam.robot.config import load_robot

        part = load_robot(robot).camera
        if part is None:
            raise ConfigError(f"{robot}: names no camera; `contourslam calibrate camera` finds its lens")
        return Lens(part.model, part.T_base_camera)
    camera = recording.camera(topic)
    if camera is None:
        if next(recording.pictures(topic), None) is None:
            raise RecordingError(_no_pictures(recording))
        raise RecordingError(
            f"{recording.path}: does not say what its camera's lens is and where it sits; give both with --robot "
            f"robot.yaml, as `contourslam calibrate camera` and `calibrate extrinsics` write it; {_topics(recording)}"
        )
    return Lens(*camera)


def _no_pictures(recording: "Recording") -> str:
    return f"{recording.path}: holds no pictures, of which a scene is coloured; {_topics(recording)}"


def _topics(recording: "Recording") -> str:
    return "topics: " + (", ".join(f"{t.name} ({t.message_type})" for t in recording.topics()) or "none")


def _add_to_page(folder: Path) -> None:
    """Show the preview in the page of the run."""
    from contourslam.report.scene_page import add_scene

    add_scene(folder)


def _tell(path: Path, about: dict[str, Any]) -> None:
    pictures, seen = about["pictures"], about["seen"]
    size = about["bytes"] / 1e6
    print(f"{path}: {size:.1f} MB, {about['walls']} walls, {about['surfaces']} surfaces of {about['area']:.0f} m²")
    shares = ", ".join(f"{kind} {share:.0%}" for kind, share in seen.items() if share is not None)
    print(f"seen in pictures: {shares}")
    left = [
        f"{pictures[key]} {text}"
        for key, text in (("without_pose", "without pose"), ("damaged", "damaged"))
        if pictures[key]
    ]
    print(f"pictures: {pictures['used']} of {pictures['recorded']} used" + "".join(f", {text}" for text in left))
