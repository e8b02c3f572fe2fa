"""The size of a picture by its first bytes, without decoding it."""

from contourslam.recordings.picture import Picture

_SIZES = set(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}  # the JPEG segments that tell the size


def picture_size(picture: Picture) -> tuple[int, int] | None:
    """Tell width and height of a picture, pixels; None where it does not say.

    Parameters
    ----------
    picture : Picture
    """
    data = picture.data
    if picture.encoding == "png":
        return (int.from_bytes(data[16:20]), int.from_bytes(data[20:24])) if data[12:16] == b"IHDR" else None
    at = 2
    while at + 9 <= len(data) and data[at] == 0xFF:
        kind = data[at + 1]
        if kind in _SIZES:
            return int.from_bytes(data[at + 7 : at + 9]), int.from_bytes(data[at + 5 : at + 7])
        at += 1 if kind == 0xFF else 2 + int.from_bytes(data[at + 2 : at + 4])
    return None
