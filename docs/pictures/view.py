"""Draw the pictures of the live page: ``python docs/pictures/view.py``; needs Chromium, playwright and the simulation.

The furnished room is simulated, recorded and mapped as `contourslam view` does it, up to a moment; then the page is
photographed: one detector on a wide screen, four side by side, and one on a phone.
"""

import shutil
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from PIL import Image
from playwright.sync_api import Browser, Page, sync_playwright

from contourslam.cli import main as contourslam
from contourslam.cli.run import DEFAULTS
from contourslam.recordings import open_recording
from contourslam.view.pace import Pace
from contourslam.view.replayed import Replayed
from contourslam.view.server import ViewServer

HERE = Path(__file__).parent
OPTIONS = ["--no-sandbox", "--disable-gpu", "--font-render-hinting=none"]
FOUR = ("matched_filter", "wu", "teh_chin", "curvature_scale_space")
WIDE: dict[str, Any] = {"viewport": {"width": 1360, "height": 850}}
PHONE: dict[str, Any] = {
    "viewport": {"width": 390, "height": 844}, "device_scale_factor": 2, "is_mobile": True, "has_touch": True,
}  # fmt: skip
# The corner that was seen most often.
OPEN_CORNER = """() => {
  const [map] = contourslam.model.maps, goto = document.querySelector("#goto");
  goto.value = map.corner_ids[map.observed.indexOf(Math.max(...map.observed))];
  goto.dispatchEvent(new Event("change"));
  document.querySelector("#fit").click();
}"""


@contextmanager
def mapped(recording: Path, until: float, detectors: Sequence[str] = ()) -> Iterator[ViewServer]:
    """Map a recording up to a time, s, and wait there."""
    opened = open_recording(recording)
    pace = Pace(10.0, paused=True)
    pace.hurry(until)
    replayed = Replayed(
        opened.messages(), DEFAULTS, detectors, title="furnished room", duration=opened.duration,
        lidar_mount=opened.lidar_mount, pace=pace,
    )  # fmt: skip
    replayed.player.start()
    with ViewServer(replayed.show, lag=replayed.lag) as server:
        yield server
    pace.stop()
    replayed.player.join()


def photograph(browser: Browser, server: ViewServer, name: str, scheme: str, *, corner: bool, **more: Any) -> None:
    """Open the page, wait until it shows the moment, and keep a picture of it with few colours."""
    page: Page = browser.new_context(color_scheme=scheme, **more).new_page()  # type: ignore[arg-type]
    page.goto(server.url)
    while not page.evaluate("contourslam.model.status?.hurries_to === null && contourslam.model.maps.length > 0"):
        page.wait_for_timeout(100)
    if corner:
        page.evaluate(OPEN_CORNER)
    page.wait_for_timeout(2500)  # the floor is filled piece by piece, and a corner's story comes within a second
    file = HERE / f"{name}.png"
    page.screenshot(path=file)
    page.context.close()
    with Image.open(file) as image:
        few_colours(image.convert("RGB")).save(file, optimize=True)


def few_colours(image: Image.Image) -> Image.Image:
    """Give a picture 256 colours: of the thin bright lines those that are met most, which few pixels have."""
    counted = sorted(image.getcolors(1 << 24) or [], reverse=True)
    vivid = [colour for _, colour in counted if max(colour) - min(colour) > 96][:64]  # type: ignore[arg-type]
    common = image.quantize(256 - len(vivid), dither=Image.Dither.NONE).getpalette() or []
    palette = Image.new("P", (1, 1))
    palette.putpalette([*common[: 3 * (256 - len(vivid))], *(value for colour in vivid for value in colour)])
    return image.quantize(palette=palette, dither=Image.Dither.NONE)


def main() -> None:
    """Make all three."""
    chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        recording = Path(folder) / "recording"
        contourslam(["simulate", "--room", "furnished_room", "-o", str(recording), "--seed", "2"])
        browser = playwright.chromium.launch(executable_path=chromium, args=OPTIONS)
        with mapped(recording, 75.0) as server:
            photograph(browser, server, "view", "light", corner=True, **WIDE)
            photograph(browser, server, "view_phone", "dark", corner=False, **PHONE)
        with mapped(recording, 62.0, FOUR) as server:
            photograph(browser, server, "view_four", "dark", corner=False, **WIDE)
        browser.close()


if __name__ == "__main__":
    main()
