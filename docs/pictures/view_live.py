"""Draw ``view_live.png``, the live page while the simulated robot drives: ``python docs/pictures/view_live.py``.

Needs ``make firmware``, Chromium, playwright and the simulation, and a machine that does nothing else for two minutes.
With a folder, ``python docs/pictures/view_live.py FOLDER``, also the page in light, with a corner, and on a phone.
"""

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from PIL import Image
from playwright.sync_api import Browser, Page, sync_playwright

HERE = Path(__file__).parent
SECONDS, TAKEN = 100, 62.0  # s that the robot drives, and after which the picture is taken
WIDE = {"width": 1360, "height": 850}
OPTIONS = ["--no-sandbox", "--disable-gpu", "--font-render-hinting=none"]
# The corner that was seen most often.
OPEN_CORNER = """() => {
  const [map] = contourslam.model.maps, goto = document.querySelector("#goto");
  goto.value = map.corner_ids[map.observed.indexOf(Math.max(...map.observed))];
  goto.dispatchEvent(new Event("change"));
  document.querySelector("#fit").click();
}"""


def main() -> None:
    """Let the robot drive, and take the pictures."""
    chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    command = [sys.executable, "-m", "contourslam", "robot-in-the-loop", "--seconds", str(SECONDS)]
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=OPTIONS)
        words = [*command, "-o", f"{folder}/loop", "--view", "--view-port", "0"]
        with subprocess.Popen(words, stderr=subprocess.PIPE, text=True) as process:
            assert process.stderr is not None
            url = next(line for line in process.stderr if "http://" in line).split()[-1]
            dark = opened(browser, url, color_scheme="dark", viewport=WIDE)
            while not dark.evaluate(f"contourslam.model.frame?.elapsed > {TAKEN}"):
                dark.wait_for_timeout(100)
            photograph(dark, HERE / "view_live.png")
            if len(sys.argv) > 1:
                others(browser, url, dark, Path(sys.argv[1]))
            process.terminate()
        browser.close()


def opened(browser: Browser, url: str, **more: Any) -> Page:
    """Open the page."""
    page = browser.new_context(**more).new_page()
    page.goto(url)
    return page


def photograph(page: Page, file: Path) -> None:
    """Keep a picture of few colours."""
    page.screenshot(path=file)
    with Image.open(file) as image:
        image.convert("RGB").quantize(256, dither=Image.Dither.NONE).save(file, optimize=True)


def others(browser: Browser, url: str, dark: Page, folder: Path) -> None:
    """Take the pictures for those who look for what is ugly."""
    folder.mkdir(parents=True, exist_ok=True)
    dark.evaluate(OPEN_CORNER)
    light = opened(browser, url, color_scheme="light", viewport=WIDE)
    phone = opened(browser, url, color_scheme="dark", viewport={"width": 390, "height": 844}, has_touch=True)
    for name, page in {"corner": dark, "light": light, "phone": phone}.items():
        while not page.evaluate("contourslam.drawn !== null && contourslam.model.maps.length > 0"):
            page.wait_for_timeout(100)
        page.wait_for_timeout(2500)  # the floor is filled piece by piece, and a corner's story comes within a second
        photograph(page, folder / f"{name}.png")
    phone.evaluate("document.querySelector('#healthcard').scrollIntoView()")
    phone.wait_for_timeout(500)
    photograph(phone, folder / "phone_health.png")


if __name__ == "__main__":
    main()
