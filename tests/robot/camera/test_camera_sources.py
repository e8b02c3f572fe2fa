"""Pictures come from every source with honest stamps, and what goes wrong is said with what to try."""

import errno
import importlib.machinery
import itertools
import sys
import threading
import time
import types
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from contourslam.errors import MissingExtraError, RecordingError
from contourslam.recordings import Picture, write_recording
from contourslam.recordings.png import encode_png
from contourslam.robot.camera.opencv import decode
from contourslam.robot.camera.sources import open_source
from contourslam.robot.camera.video import VideoCamera
from contourslam.robot.camera.view import CameraTally, half_blocks
from contourslam.robot.device_errors import (
    DeviceBusyError,
    DeviceError,
    DeviceNotFoundError,
    DevicePermissionError,
    DeviceSilentError,
    DeviceUnpluggedError,
)

cv2 = pytest.importorskip("cv2")

SCENE = np.zeros((48, 64, 3), np.uint8)
SCENE[:, :32] = 200, 30, 20  # blue, green, red as OpenCV has them: the left half is blue
JPEG = bytes(cv2.imencode(".jpg", SCENE)[1].tobytes())


class Capture:
    """What ``cv2.VideoCapture`` is to the driver: no device is here that could be the real one."""

    def __init__(
        self, path: Path, *, opened: bool = True, give: str = "jpeg", late: float = 0.02, most: int = 5
    ) -> None:
        self.path, self.opened, self.give, self.late, self.most = path, opened, give, late, most
        self.settings: dict[int, float] = {}

    def isOpened(self) -> bool:  # noqa: N802, OpenCV's name
        return self.opened

    def set(self, what: int, value: float) -> bool:
        self.settings[what] = value
        return True

    def get(self, what: int) -> float:
        if what == cv2.CAP_PROP_POS_MSEC:
            return 1000.0 * (time.monotonic() - self.late)
        return 125.0 if what == cv2.CAP_PROP_EXPOSURE else 0.0

    def read(self) -> tuple[bool, Any]:
        self.most -= 1
        if self.most < 0 and self.give != "nothing":
            self.path.unlink(missing_ok=True)  # pulled out
            return False, None
        if self.give == "nothing":
            return False, None
        if self.give == "jpeg":
            return True, np.frombuffer(JPEG + bytes(10), np.uint8)[None]
        if self.give == "cut":
            return True, np.frombuffer(JPEG[: len(JPEG) // 2], np.uint8)[None]
        raw = self.give == "raw" and not self.settings[cv2.CAP_PROP_CONVERT_RGB]
        return True, np.zeros((1, 48 * 64), np.uint8) if raw else SCENE

    def release(self) -> None:
        self.opened = False


@pytest.fixture
def device(tmp_path: Path) -> Path:
    path = tmp_path / "video7"
    path.touch()
    return path


def first(source: Iterator[Picture], count: int) -> list[Picture]:
    return list(itertools.islice(source, count))


def test_a_cameras_own_jpeg_is_passed_on_untouched_at_the_drivers_time(device: Path) -> None:
    clock = itertools.count(1000.0).__next__
    with VideoCamera(str(device), capture=lambda _: Capture(device), clock=clock) as camera:
        pictures = first(camera.frames(), 3)
    assert [picture.data for picture in pictures] == [JPEG] * 3
    assert [picture.stamp for picture in pictures] == pytest.approx([999.98, 1000.98, 1001.98], abs=0.01)
    assert camera.exposure == pytest.approx(0.0125)


def test_of_a_camera_that_gives_more_than_is_wanted_the_pictures_between_are_left_out(device: Path) -> None:
    clock = itertools.count(1000.0, 0.04).__next__
    with VideoCamera(str(device), rate=10.0, capture=lambda _: Capture(device, most=9), clock=clock) as camera:
        stamps = [picture.stamp for picture in first(camera.frames(), 3)]
    assert np.diff(stamps) == pytest.approx([0.12, 0.12], abs=0.01)


@pytest.mark.parametrize("give", ["colours", "raw"])
def test_a_camera_without_jpeg_gives_the_right_colours(device: Path, give: str) -> None:
    with VideoCamera(str(device), capture=lambda _: Capture(device, give=give)) as camera:
        (picture,) = first(camera.frames(), 1)
    pixels = decode(picture)
    assert pixels is not None and pixels.shape == SCENE.shape
    assert np.abs(pixels[24, 10].astype(int) - (20, 30, 200)).max() < 12


def test_a_stamp_of_another_clock_is_not_believed(device: Path) -> None:
    with VideoCamera(str(device), capture=lambda _: Capture(device, late=500.0), clock=lambda: 1000.0) as camera:
        assert next(camera.frames()).stamp == 1000.0


def test_a_camera_that_was_unplugged_is_taken_up_again(device: Path) -> None:
    opened: list[Capture] = []

    def plug(_: int | str) -> Capture:
        opened.append(Capture(device, most=3))
        return opened[-1]

    with VideoCamera(str(device), capture=plug, clock=itertools.count(1000.0).__next__) as camera:
        frames = camera.frames()
        assert len(first(frames, 3)) == 3
        back = threading.Timer(0.3, device.touch)
        back.start()
        assert next(frames).data == JPEG  # the reading before it found the camera gone
        back.join()
    assert camera.reconnections == 1 and len(opened) == 2


def test_a_camera_that_does_not_come_back_is_given_up(device: Path) -> None:
    with VideoCamera(str(device), capture=lambda _: Capture(device, most=1), patience=0.0) as camera:
        frames = camera.frames()
        next(frames)
        with pytest.raises(DeviceUnpluggedError, match="has not come back within 0 s"):
            next(frames)


def test_stopping_ends_the_wait_for_a_camera_that_has_gone(device: Path) -> None:
    begun = time.monotonic()
    with VideoCamera(str(device), capture=lambda _: Capture(device, most=1)) as camera:
        assert len(list(camera.frames(lambda: time.monotonic() > begun + 0.3))) == 1
    assert time.monotonic() - begun < 5.0


@pytest.mark.parametrize("give", ["nothing", "cut"])
def test_a_camera_without_whole_pictures_is_silent(device: Path, give: str) -> None:
    with (
        VideoCamera(str(device), capture=lambda _: Capture(device, give=give, most=10**9), timeout=0.1) as camera,
        pytest.raises(DeviceSilentError, match=r"no picture came for 0.1 s; try"),
    ):
        next(camera.frames())


def test_a_camera_that_is_not_there_or_held_is_named(device: Path, tmp_path: Path) -> None:
    with pytest.raises(DeviceNotFoundError, match=r"there is no such camera; .*video device"):
        VideoCamera(str(tmp_path / "video9"))
    with pytest.raises(DeviceBusyError, match="another program may hold it"):
        VideoCamera(str(device), capture=lambda _: Capture(device, opened=False))


def test_a_camera_of_another_user_names_the_group(device: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(self: Path, *_: Any) -> Any:
        raise PermissionError(errno.EACCES, "no")

    monkeypatch.setattr(Path, "open", refuse)
    with pytest.raises(DevicePermissionError, match="usermod -aG"):
        VideoCamera(str(device), capture=lambda _: Capture(device))


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("film") / "film.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 20.0, (64, 48))
    for i in range(8):
        writer.write(np.full((48, 64, 3), 30 * i, np.uint8))
    writer.release()
    return path


def test_a_film_is_read_frame_by_frame(film: Path) -> None:
    with open_source(str(film), pace=False) as source:
        pictures = list(source.frames())
        assert len(list(source.frames())) == 8  # a second pass starts anew
    assert [picture.stamp for picture in pictures] == pytest.approx([0.05 * i for i in range(8)])
    greys = [decode(picture, grey=True) for picture in pictures]
    assert [float(grey.mean()) for grey in greys if grey is not None] == pytest.approx(
        [30.0 * i for i in range(8)], abs=4
    )


def test_what_is_kept_comes_as_fast_as_it_was_taken(film: Path) -> None:
    begun = time.monotonic()
    with open_source(str(film)) as source:
        assert len(list(source.frames())) == 8
    assert time.monotonic() - begun > 0.3


def test_folders_and_recordings_are_sources(tmp_path: Path) -> None:
    data = [encode_png(np.full((20, 30, 3), 20 * i, np.uint8)) for i in range(4)]
    folder = tmp_path / "folder"
    folder.mkdir()
    for i, content in enumerate(data):
        (folder / f"{i}.png").write_bytes(content)
    (folder / "broken.png").write_bytes(data[0][:50])
    (folder / "text.png").write_text("no picture")
    (folder / "notes.txt").write_text("nothing to see")
    write_recording(tmp_path / "bag", [Picture(5.0 + 0.1 * i, content, "png") for i, content in enumerate(data)])
    for path in (folder, tmp_path / "bag", tmp_path / "bag" / "bag.mcap"):
        with open_source(str(path), pace=False) as source:
            assert [picture.data for picture in source.frames()] == data
            assert len(first(source.frames(lambda: True), 1)) == 0
    (tmp_path / "nothing").mkdir()
    with open_source(str(tmp_path / "nothing")) as source, pytest.raises(RecordingError, match="holds no picture"):
        next(source.frames())


def test_a_source_that_is_none_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DeviceNotFoundError, match="no such file, folder or camera"):
        open_source(str(tmp_path / "nothing"))
    (tmp_path / "text.avi").write_text("no film")
    with pytest.raises(RecordingError, match="is no film"):
        open_source(str(tmp_path / "text.avi"))


class Pi:
    """What ``picamera2.Picamera2`` is to the driver."""

    fails: Exception | None = None
    cameras: tuple[str, ...] = ("imx219",)
    slow = False

    @classmethod
    def global_camera_info(cls) -> list[dict[str, str]]:
        return [{"Model": name} for name in cls.cameras]

    def create_video_configuration(self, **options: Any) -> dict[str, Any]:
        return options

    def configure(self, options: dict[str, Any]) -> None:
        assert options["main"]["format"] == "RGB888"

    def start(self) -> None:
        if self.fails is not None:
            raise self.fails

    def capture_request(self, wait: bool) -> "Pi":
        return self

    def wait(self, job: "Pi", timeout: float) -> "Pi":
        if self.slow:
            raise TimeoutError
        return self

    def make_array(self, name: str) -> np.ndarray:
        return SCENE

    def get_metadata(self) -> dict[str, float]:
        begun = time.clock_gettime(time.CLOCK_BOOTTIME) - 0.05
        return {"SensorTimestamp": 1e9 * begun, "ExposureTime": 20_000.0}

    def release(self) -> None:
        pass

    stop = close = release


@pytest.fixture
def pi(monkeypatch: pytest.MonkeyPatch) -> type[Pi]:
    kind = type("FreshPi", (Pi,), {})
    module = types.ModuleType("picamera2")
    module.Picamera2 = kind  # type: ignore[attr-defined] # as the real module has it
    module.__spec__ = importlib.machinery.ModuleSpec("picamera2", None)
    monkeypatch.setitem(sys.modules, "picamera2", module)
    return kind


def test_a_pis_picture_is_stamped_in_the_middle_of_its_exposure(pi: type[Pi]) -> None:
    with open_source("auto", clock=lambda: 1000.0) as source:
        picture = next(source.frames())
    assert source.name == "picamera2" and source.exposure == pytest.approx(0.02)
    assert picture.stamp == pytest.approx(1000.0 - 0.05 + 0.01, abs=0.01)
    pixels = decode(picture)
    assert pixels is not None and np.abs(pixels[24, 10].astype(int) - (20, 30, 200)).max() < 12


def test_troubles_of_a_pis_camera_are_named(pi: type[Pi]) -> None:
    pi.slow = True
    with open_source("picamera2") as source, pytest.raises(DeviceSilentError, match="ribbon cable"):
        next(source.frames())
    pi.fails = RuntimeError("Failed to acquire camera: Device or resource busy")
    with pytest.raises(DeviceBusyError):
        open_source("picamera2")
    pi.fails = RuntimeError("odd")
    with pytest.raises(DeviceError, match=r"does not start \(odd\)"):
        open_source("picamera2")
    pi.cameras = ()
    with pytest.raises(DeviceNotFoundError, match="seat the ribbon cable anew"):
        open_source("picamera2")


def test_without_picamera2_it_is_said_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "picamera2", None)
    with pytest.raises(MissingExtraError, match="apt install python3-picamera2"):
        open_source("picamera2")


def test_a_terminal_shows_the_picture_in_shape() -> None:
    pixels = np.zeros((40, 80, 3), np.uint8)
    pixels[:, :40] = 255
    plain = half_blocks(pixels, 40, 30, colour=False)
    assert plain == ["@" * 20 + " " * 20] * 10
    coloured = half_blocks(pixels, 1000, 10, colour=True)
    assert len(coloured) == 10 and all(line.count("▀") == 40 for line in coloured)
    assert coloured[0].startswith("\x1b[38;2;255;255;255;48;2;255;255;255m▀") and coloured[0].endswith("\x1b[0m")


def test_figures_tell_rate_size_and_light() -> None:
    tally = CameraTally()
    assert tally.figures().pictures == 0
    bright = np.full((48, 64, 3), 255, np.uint8)
    for i in range(5):
        tally.add(10.0 + 0.1 * i, 2000)
        tally.look(bright)
    figures = tally.figures()
    assert (figures.width, figures.height, figures.kilobytes) == (64, 48, 2.0)
    assert figures.rate == pytest.approx(10.0) and (figures.too_bright, figures.too_dark) == (1.0, 0.0)
    noise = np.random.default_rng(0).integers(0, 255, (48, 64, 3), dtype=np.uint8)
    sharper = CameraTally()
    sharper.look(noise)
    assert sharper.figures().sharpness > figures.sharpness
