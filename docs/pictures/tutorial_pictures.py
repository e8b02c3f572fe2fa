"""Draws docs/pictures/tutorial_*.png for the tutorial and the how-to pages: python docs/pictures/tutorial_pictures.py.

Drives are simulated and mapped in a temporary folder by the commands that the pages give; a headless Chromium
photographs the pages of the runs.
"""

import subprocess
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

from PIL import Image
from playwright.sync_api import Page, sync_playwright

from contourslam.recordings import open_recording, write_recording
from contourslam.scan import LaserScan

HERE = Path(__file__).parent
WIDTH = 880  # px
RUNS = {
    "map": ("flat",),
    "map_noisy": ("noisy",),
    "map_noisy_told": ("noisy", "--sigma-range", "0.05"),
    "map_mirrored": ("mirrored",),
    "map_no_wheels": ("flat", "--ignore-odometry"),
}
BROKEN = {
    "map": "as it is",
    "map_noisy": "5 cm of noise, and 1 cm believed",
    "map_noisy_told": "5 cm of noise, and told so",
    "map_mirrored": "upside down, and not told so",
}
CROPS = {
    "tutorial_map": ("map", "section[aria-labelledby=map] figure"),
    "tutorial_headline": ("map", "header"),
    "tutorial_truth": ("map", "section[aria-labelledby=truth]"),
    "tutorial_truth_bad": ("map_no_wheels", "section[aria-labelledby=truth]"),
    "tutorial_matching": ("map", "section[aria-labelledby=matching]"),
    "tutorial_matching_bad": ("map_mirrored", "section[aria-labelledby=matching]"),
    "tutorial_loops": ("map", "section[aria-labelledby=loops]"),
    "tutorial_timings": ("map", "section[aria-labelledby=timings]"),
}
"""Picture: run, and which part of its page."""


def contourslam(folder: Path, *arguments: str) -> None:
    """Run a command in a folder."""
    subprocess.run([sys.executable, "-m", "contourslam", *arguments], cwd=folder, check=True, stdout=subprocess.DEVNULL)


def drives(folder: Path) -> None:
    """Simulate and map, as the tutorial does."""
    contourslam(folder, "simulate", "--duration", "60", "-o", "flat")
    contourslam(folder, "simulate", "--duration", "60", "--noise", "0.05", "-o", "noisy")
    flat = open_recording(folder / "flat")
    turned = (replace(m, angles=-m.angles) if isinstance(m, LaserScan) else m for m in flat.messages())
    write_recording(folder / "mirrored", turned, lidar_mount=flat.lidar_mount)
    for output, arguments in RUNS.items():
        contourslam(folder, "run", *arguments, "-o", output)
    contourslam(folder, "detect", "flat", "--scan", "50", "-o", "scan.png")


def four_maps(page: Page, folder: Path) -> None:
    """Photograph the maps of four runs beside each other."""
    figures = "".join(
        f'<figure><img src="file://{folder / name / "map.svg"}"><figcaption>{words}</figcaption></figure>'
        for name, words in BROKEN.items()
    )
    style = (
        "body{margin:0;background:#fff;font:15px sans-serif;display:grid;grid-template-columns:1fr 1fr;gap:12px}"
        "figure{margin:0;text-align:center}img{width:100%}"
    )
    (folder / "four.html").write_text(f"<!doctype html><style>{style}</style>{figures}", encoding="utf-8")
    page.goto(f"file://{folder / 'four.html'}")
    page.locator("body").screenshot(path=folder / "tutorial_broken.png")


def keep(picture: Path) -> None:
    """Write a picture with few colours, as drawings have, and so small."""
    image = Image.open(picture).convert("RGB")
    image.thumbnail((2 * WIDTH, 4 * WIDTH))
    image.quantize(96, method=Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE).save(
        HERE / picture.name, optimize=True
    )


def main() -> None:
    """Draw all of them."""
    with tempfile.TemporaryDirectory() as place, sync_playwright() as playwright:
        folder = Path(place)
        drives(folder)
        (folder / "scan.png").rename(folder / "tutorial_scan.png")
        browser = playwright.chromium.launch(executable_path="/usr/bin/chromium", args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": WIDTH, "height": 900}, color_scheme="light", device_scale_factor=1.5)
        for name, (run, part) in CROPS.items():
            page.goto(f"file://{folder / run / 'index.html'}")
            page.locator(part).first.screenshot(path=folder / f"{name}.png")
        four_maps(page, folder)
        browser.close()
        for picture in sorted(folder.glob("tutorial_*.png")):
            keep(picture)


if __name__ == "__main__":
    main()
