"""Take rerun.png: `python docs/pictures/rerun.py out/intel.rrd 2940` shows one scan of a file in Rerun's own viewer."""

import sys
import tempfile
import time
from pathlib import Path

from PIL import Image
from rerun.experimental import ViewerClient

TITLE_BAR, WIDTH, COLOURS = 37, 1440, 128
LOADING, DRAWING = 10.0, 8.0  # s; the viewer does not say when it is done


def main(recording: str, scan: int) -> None:
    """Open the file in a viewer without a window, go to the scan, and keep what is seen."""
    shot = Path(tempfile.mkdtemp()) / "shot.png"
    viewer = ViewerClient.spawn(headless=True, port=9899)
    try:
        viewer.open(str(Path(recording).resolve()))
        time.sleep(LOADING)
        viewer.set_time("scan", sequence=scan, play_state="paused")
        time.sleep(DRAWING)
        viewer.save_screenshot(str(shot))
        time.sleep(DRAWING)
    finally:
        viewer.quit()
    picture = Image.open(shot).convert("RGB")
    picture = picture.crop((0, TITLE_BAR, picture.width, picture.height))
    picture = picture.resize((WIDTH, round(WIDTH * picture.height / picture.width)), Image.Resampling.LANCZOS)
    picture.quantize(COLOURS, dither=Image.Dither.NONE).save(Path(__file__).with_suffix(".png"), optimize=True)


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
