"""The simulated room in 3-D (the paper's Fig. 4)."""

from contourslam.errors import MissingExtraError, ResultError
from contourslam.experiments.study import Study
from contourslam.report.page.common import Gallery
from contourslam.report.page.markup import Picture, Section, figure
from contourslam.simulation.picture import render_room

_SIZE = (1280, 860)


def section(study: Study, gallery: Gallery) -> Section | None:
    """Give the section; None where the machine cannot render."""
    room = study.comparison.room
    try:
        render_room(room, gallery.folder / "figures" / "room.png", width=_SIZE[0], height=_SIZE[1])
    except (MissingExtraError, ResultError):
        return None
    alt = f"The simulated room in 3-D: {room.description}"
    caption = f"{room.description[0].upper()}{room.description[1:]} (the paper's Fig. 4)."
    return Section("room", "The room", figure(Picture("figures/room.png", *_SIZE, alt, caption, chart=False)))
