"""``contourslam camera``: what a camera sees, live, and pictures of it to keep."""

import shutil
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from contourslam.cli.console import colour_wanted, note, print_json
from contourslam.cli.interrupt import Interrupt
from contourslam.cli.options import Json
from contourslam.errors import ConfigError, ResultError

if TYPE_CHECKING:
    from contourslam.recordings import Picture
    from contourslam.robot.camera.source import PictureSource
    from contourslam.robot.camera.view import CameraTally

_REDRAW = 0.2  # s


@dataclass(frozen=True)
class Camera:
    """Look at a camera: pictures a second, size, exposure, and on a terminal a small live picture.

    On a terminal it goes on until Ctrl-C; elsewhere, and with --json, it looks for some seconds and says what it saw.

    Example: contourslam camera --source 0 --save-folder out/pictures --every 2
    """

    source: str = "auto"
    """picamera2, the number of a video device, a film, a folder of pictures, or a recording; auto is the Pi's camera
    where there is one, else the video device 0."""
    width: int = 1280
    """Wanted of a camera, pixels; it takes the nearest that it has."""
    height: int = 960
    """Wanted of a camera, pixels."""
    rate: float = 15.0
    """Wanted of a camera, pictures a second."""
    seconds: float | None = None
    """How long to look, s; on a terminal until Ctrl-C where left out, elsewhere 3."""
    patience: float = 30.0
    """How long to wait for a camera that was unplugged, s."""
    save: Annotated[Path | None, tyro.conf.arg(metavar="FILE")] = None
    """Where to keep the last picture."""
    save_folder: Annotated[Path | None, tyro.conf.arg(metavar="DIR")] = None
    """Where to keep one picture each --every seconds, such as for a calibration."""
    every: float = 2.0
    """Seconds between two pictures kept."""
    json: Json = False

    def execute(self, command: str) -> int:
        """Watch the camera and say what was seen."""
        from contourslam.robot.camera.opencv import opencv
        from contourslam.robot.camera.sources import open_source
        from contourslam.robot.camera.view import CameraTally

        for name in ("seconds", "rate", "every", "width", "height"):
            value = getattr(self, name)
            if value is not None and not value > 0.0:
                raise ConfigError(f"--{name} must be above 0, got {value}")
        opencv()
        live = sys.stdout.isatty() and not self.json
        span = self.seconds if self.seconds is not None or live else 3.0
        tally, kept, last = CameraTally(), 0, None
        seen_at = kept_at = -float("inf")
        options: dict[str, Any] = {"width": self.width, "height": self.height, "rate": self.rate}
        with Interrupt() as interrupt, open_source(self.source, patience=self.patience, **options) as source:
            for last in source.frames(interrupt.or_after(span)):
                now = time.monotonic()
                tally.add(last.stamp, len(last.data))
                if now - seen_at > _REDRAW:
                    seen_at = now
                    _look(last, source, tally, kept, live=live)
                if self.save_folder is not None and now - kept_at >= self.every:
                    kept_at, kept = now, kept + 1
                    _keep(self.save_folder / f"{_name(last.stamp)}{_suffix(last)}", last)
        if last is None:
            note("no picture came; look for longer with --seconds")
            return 1
        found = _found(source, tally, kept)
        if self.save is not None:
            if self.save.suffix.lower() not in ((".jpg", ".jpeg") if last.encoding == "jpeg" else (".png",)):
                note(f"{self.save}: what it holds is {last.encoding}")
            _keep(self.save, last)
            found["saved"] = str(self.save)
        if self.json:
            print_json(found)
        else:
            _print(found)
        return 0


def _suffix(picture: "Picture") -> str:
    return ".jpg" if picture.encoding == "jpeg" else ".png"


def _name(stamp: float) -> str:
    return f"{stamp:017.6f}".replace(".", "_")


def _keep(path: Path, picture: "Picture") -> None:
    from contourslam.atomic import write_bytes

    if path.is_dir():
        raise ResultError(f"{path} is a folder; give the name of a file")
    write_bytes(path, picture.data)


def _look(picture: "Picture", source: "PictureSource", tally: "CameraTally", kept: int, *, live: bool) -> None:
    """Decode a picture for its figures, and draw it on a terminal."""
    from contourslam.robot.camera.opencv import decode
    from contourslam.robot.camera.view import half_blocks

    pixels = decode(picture)
    if pixels is None:
        return
    tally.look(pixels)
    if not live:
        return
    size = shutil.get_terminal_size()
    figures = tally.figures()
    exposure = "" if source.exposure is None else f"exposed {1000.0 * source.exposure:.1f} ms  "
    head = (
        f"{figures.rate:5.1f} pictures/s  {figures.width} x {figures.height}  {figures.kilobytes:.0f} kB  {exposure}"
        f"brightness {figures.brightness:.0f}, {figures.too_bright:.0%} burnt  sharpness {figures.sharpness:.0f}"
        + (f"  kept {kept}" if kept else "")
    )
    lines = half_blocks(pixels, size.columns - 1, size.lines - 2, colour=colour_wanted(sys.stdout))
    text = "\n".join([head[: size.columns - 1], *lines])
    print(f"\x1b[H\x1b[2J{text}", flush=True)


def _found(source: "PictureSource", tally: "CameraTally", kept: int) -> dict[str, Any]:
    from dataclasses import asdict

    figures = asdict(tally.figures())
    return {
        "source": source.name,
        "exposure": source.exposure,
        "reconnections": source.reconnections,
        "kept": kept,
    } | figures


def _print(found: dict[str, Any]) -> None:
    print(f"{found['source']}: {found['width']} x {found['height']} pixels, {found['kilobytes']:.0f} kB each")
    print(f"rate:        {found['rate']:.1f} a second")
    exposure = "not told" if found["exposure"] is None else f"{1000.0 * found['exposure']:.1f} ms"
    print(f"exposure:    {exposure}; brightness {found['brightness']:.0f} of 255, {found['too_dark']:.1%} too dark, "
          f"{found['too_bright']:.1%} burnt")  # fmt: skip
    print(f"sharpness:   {found['sharpness']:.0f}")
    if found["reconnections"]:
        print(f"trouble:     opened {found['reconnections']} times anew")
    if found["kept"] or found.get("saved"):
        print(
            f"kept:        {found['kept']} pictures" + (f"; the last in {found['saved']}" if "saved" in found else "")
        )
