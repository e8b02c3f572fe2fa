"""Drawings inside the page itself, so that it can be sent around as one file and its scripts can move what is drawn."""

import json
from html import escape
from typing import Any

from contourslam.report.svg.drawing import Drawing

SCRIPTS = ("panel.js", "moment.js", "facts.js", "layers.js", "gestures.js", "map.js", "chart.js", "save.js", "drawn.js")
"""What a page with drawings runs, in this order."""


def drawn(
    drawing: Drawing, *, kind: str, name: str, alt: str, caption: str, facts: dict[str, Any] | None = None
) -> str:
    """Give a drawing as a figure; without scripts it is a picture, with them a map or a chart that answers.

    Parameters
    ----------
    drawing : Drawing
    kind : str
        "map" or "chart".
    name : str
        Unique in the page; a part of the name of the file under which the reader keeps the figure.
    alt : str
        The figure in words.
    caption : str
    facts : dict, optional
        For each layer of the drawing what is to be told of its members: lists in the order in which they are drawn.
        Their places are in the drawing already.
    """
    told = "" if facts is None else f'<script type="application/json">{_json(facts)}</script>'
    named = f'<svg role="img" aria-label="{escape(alt)}" '
    picture = drawing.text.strip().replace('<svg xmlns="http://www.w3.org/2000/svg" ', named, 1)
    return (
        f'<figure class="drawn" data-kind="{escape(kind)}" data-name="{escape(name)}">\n'
        f'<div class="stage">{picture}</div>{told}\n<figcaption>{escape(caption)}</figcaption></figure>'
    )


def _json(values: dict[str, Any]) -> str:
    """Give JSON that no text in it can end or turn into markup."""
    return json.dumps(values, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
